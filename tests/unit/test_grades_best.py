"""The least error that sensors of a grade allow, by closed forms; what is published of the position and said in a flight."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.integrity.integrity import Integrity
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.sixdof.windcal.feed import WindCalibration
from flightsw.sixdof.windcal.params import WindCalParams
from flightsw.types import NavState
from ground.report.grades.build import SAID as SHOWN
from hil_scripts.studies.grades import twin as tw
from hil_scripts.studies.grades import words as wd
from hil_scripts.studies.grades.posterior import RATE_HZ, PositionBound, terms_of
from sim_plant.sensors.terms import Group, Terms

BOOM, LEVEL = load_aircraft("kc135r").boom, (1.0, 0.0, 0.0, 0.0)
XI = (-35.5, 0.0, 8.5)


def alone(**columns: dict[str, Terms]) -> dict[str, Group]:
    """Sensors without errors but for those told: `group = {family: terms}`."""
    names = {
        "imu": ("gyro", "acc"), "att": ("tilt", "heading"), "gnss": ("pos_h", "pos_v", "vel_h", "vel_v"), "rel": ("pos", "vel"),
        "boom": ("angle", "extension"),
    }  # fmt: skip
    return {g: Group({f: columns.get(g, {}).get(f, Terms()) for f in fams}) for g, fams in names.items()}


def flown(terms: dict[str, Group], steps: int, latched: bool, yaw: float = 0.0) -> np.ndarray:
    """Variances [3] m^2 after so many steps on station behind a tanker of that heading [rad]."""
    assert BOOM is not None
    q = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    b = PositionBound(terms, BOOM, (0.0, 0.0, 0.0))
    t, r = SimpleNamespace(q_nb=q), SimpleNamespace(
        q_nb=LEVEL, xi=XI, boom_elevation=-0.5, boom_azimuth=0.1, boom_extension=3.6
    )  # fmt: skip
    for _ in range(steps):
        sigma = b.step(t, r, latched)  # type: ignore[arg-type]
    return np.asarray(sigma**2)


BLIND = {k: Terms(white=1e6) for k in ("pos_h", "pos_v", "vel_h", "vel_v")}


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_of_constant_errors_informations_add_up(yaw: float) -> None:
    """Noise averaged out, each source leaves its constants: the boom's angles over its length and its extension, along and across
    it; the relative sensor's offset, mounting and scale at its place. P^-1 = sum of P_k^-1."""
    rel = {"pos": Terms(white=1e-5, constant=0.1, scale=0.005, align=0.0026), "vel": Terms(white=1e-5)}
    both = {"angle": Terms(white=1e-6, constant=0.0035), "extension": Terms(white=1e-6, constant=0.05)}
    x = np.array(XI)
    own = 0.1**2 * np.eye(3) + 0.005**2 * np.diag(x * x) + 0.0026**2 * (x @ x * np.eye(3) - np.outer(x, x))
    assert BOOM is not None
    length, ce, se, ca, sa = BOOM.length_retracted_m + 3.6, math.cos(0.5), -math.sin(0.5), math.cos(0.1), math.sin(0.1)
    along = np.array([-ce * ca, ce * sa, -se])
    down, side = np.array([se * ca, -se * sa, -ce]), np.array([sa, ca, 0.0]) * ce
    across = (0.0035 * length) ** 2 * (np.outer(down, down) + np.outer(side, side))
    arm = across + 0.05**2 * np.outer(along, along)
    terms = alone(gnss=BLIND, rel=rel, boom=both)
    assert flown(terms, 400, False, yaw) == pytest.approx(np.diag(own), rel=0.01)
    joint = np.linalg.inv(np.linalg.inv(own) + np.linalg.inv(arm))
    assert flown(terms, 400, True, yaw) == pytest.approx(np.diag(joint), rel=0.01)


@pytest.mark.parametrize("n", [50, 200])
def test_white_positions_alone_are_the_end_of_a_straight_line(n: int) -> None:
    """Uniform motion, n readings of variance s^2, nothing of the velocity: 2 s^2 (2n - 1) / (n (n + 1)) at the last one."""
    terms = alone(gnss=BLIND, rel={"pos": Terms(white=0.1), "vel": Terms(white=1e6)})
    assert flown(terms, n, False) == pytest.approx(np.full(3, 0.01 * 2 * (2 * n - 1) / (n * (n + 1))), rel=0.01)


def test_tactical_is_bounded_by_its_lasting_errors() -> None:
    """Latched: below what the boom alone leaves, above that with everything else at once; a better grade is better."""
    tactical, navigation = (flown(terms_of(g), round(60 * RATE_HZ), True) for g in ("tactical", "navigation"))
    apart = flown(terms_of("tactical"), round(60 * RATE_HZ), False)
    assert (np.sqrt(tactical) < 0.05).all() and (np.sqrt(tactical) > 0.03).all()
    assert (navigation < 0.5 * tactical).all() and (apart > 9.0 * tactical).all()


def test_the_twin_of_a_filter_that_believes_the_truth_knows_as_much() -> None:
    """And of one that believes more, less; what is flown by is handed on."""
    p = WindCalParams(on=True)
    e = tw.exact(p, "tactical")
    assert tw.exact(e, "tactical") == e and (e.slow_q_mps, e.wake_down_mps) == (p.slow_q_mps, p.wake_down_mps)
    assert (e.V_scale, e.V_offset_mps, e.vane_offset, e.att_gm) == (0.01, 0.5, 0.0035, pytest.approx(0.00175))
    ac = load_aircraft("learjet24")
    mine = WindCalibration(ac, p, behind=True)
    t = tw.Twin(mine, ac, "tactical", behind=True)
    assert t.flown is mine and t.report() is mine.out and t.p == e
    mine.texts.append("x")  # type: ignore[arg-type]
    nav = NavState(t_us=50_000, valid=True)
    t.publish(nav)
    assert t.tell() == ["x"] and math.isnan(t.sigma(50_000)[0]) and math.isnan(t.sigma(0)[0]) and not nav.wind_valid


def test_the_published_sigma_is_the_banks_and_the_way_to_it() -> None:
    """A position that begins anywhere the readings tell and comes to the bank's: (error / sigma)^2 is one in the mean, beside the
    bank as upon it; the own position moves with it, by the tanker's attitude."""
    guard = Integrity(IntegrityParams(on=True), load_aircraft("kc135r"), load_aircraft("learjet24"))
    guard.ready, rng, still = True, np.random.default_rng(1), (0.0, 0.0, 0.0)
    guard.horizon._axes[:9] = [0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0]  # heading east
    for upon in (False, True):
        ratio = []
        for k in range(4000):
            sigma = rng.uniform(0.03, 0.2, 3)
            x, y, z = xi = np.array(XI) + rng.standard_normal(3)
            guard.bank = SimpleNamespace(xi=(x, y, z), sigma=tuple(sigma))  # type: ignore[assignment]
            guard._place = ((x, y, z), still)
            if not upon or k == 0:
                guard._flown.forget()
            own = xi + 0.1 * rng.standard_normal(3)
            nav = NavState(t_us=50_000 * (k + 1), valid=True, rel_pos_t=tuple(own), scatter=(9.0, 9.0, 9.0))
            guard.publish(nav, False, False)
            moved = np.array(nav.rel_pos_t) - own
            assert not upon or k < 100 or nav.rel_pos_t == pytest.approx((x, y, z), abs=1e-12)
            assert nav.pos_n == pytest.approx((-moved[1], moved[0], moved[2]), abs=1e-12)
            true = xi + sigma * rng.standard_normal(3)
            ratio.append(((np.array(nav.rel_pos_t) - true) / np.array(nav.rel_sigma)) ** 2)
        assert np.mean(ratio) == pytest.approx(1.0, abs=4.0 * np.std(ratio) / math.sqrt(12000))
    guard.ready = False
    nav = replace(nav, rel_sigma=(0.3, 0.3, 0.3), rel_pos_t=(1.0, 2.0, 3.0))
    guard.publish(nav, False, False)
    assert nav.rel_sigma == (0.3, 0.3, 0.3) and nav.rel_pos_t == (1.0, 2.0, 3.0)


def test_what_is_said_is_told_by_its_words(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = {
        "position bound 5.1 m, allowed 3": "bound", "no bound on the position": "bound", "boom left out: walks away": "sources",
        "relative sensor, GNSS disagree": "sources", "turbulence 5.7 m/s, allowed 3.5": "air", "boom has let go": "boom",
        "station error 3.4 m": "station", "gyro left out: stands still": "attitude", "relative sensor silent": "navigation",
        "contact is only allowed from pre-contact, not from": "order",
        "a command has been at its limit for 10 s": "limits", "fuel low: 200 kg": "other",
    }  # fmt: skip
    assert {k: wd.kind_of(k) for k in cases} == cases and list(SHOWN) == list(wd.SAID)
    w = wd.Words()
    doubts = [(0, 0), (2, 0), (2, 0), (0, 3), (0, 0), (2, 0)]
    heard = [[(wd.INTEGRITY, {"excluded": a, "undecided": b})] for a, b in doubts]
    heard.append([(wd.STATUS, {"phase": 5, "reason": ""}), (wd.TEXT, {"severity": 6, "text": "boom has let go"})])
    heard += [[(wd.STATUS, {"phase": 8, "reason": "position bound 5.1 m, allowed 3"})]] * 2
    monkeypatch.setattr(wd, "said", lambda d: d)
    for h in heard:
        w.hear(h)  # type: ignore[arg-type]
    v = w.figures()
    assert (v["alerts"], v["breakaways"]) == (3.0, 1.0)
    assert {k for k in wd.SAID if v[f"says.{k}"]} == {"bound"}
