"""The campaign on upsets: what is drawn, how it starts in the plant, and a few of its flights."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.strict import ConfigError, convert
from ground.link.packets import IDS, decode, packet_id, split
from hil_scripts.studies.integrity.snapshot import STATUS, Flying, phase_in
from hil_scripts.studies.upset.draw import draw, rotation
from hil_scripts.studies.upset.flight import OUTCOMES, Seen, run_case
from hil_scripts.studies.upset.study import STUDY
from sim_plant.kernels import layout as n
from sim_plant.lost import HOLD_S, Watch
from sim_plant.scenario import Scenario, load_scenario
from sim_plant.truth import truth_of
from sim_plant.world import World

AC = load_aircraft("learjet24")
CASES = {c.name: c for c in STUDY.cases}
UPSET: dict[str, Any] = {
    "attitude_deg": [30.0, 80.0, 170.0], "rates_degps": [10.0, -20.0, 5.0], "V_mps": 160.0, "alpha_deg": 6.0, "beta_deg": -3.0,
}  # fmt: skip
HEARTBEAT, HEALTH, TEXT = IDS["HEARTBEAT"], IDS["HEALTH_STATUS"], IDS["STATUSTEXT"]


# --- what is drawn -----------------------------------------------------------------------------------------------------


def test_every_rotation_is_as_likely() -> None:
    """The nose then points anywhere alike: each of its components is uniform, and so is the vertical's in body axes."""
    rng = np.random.default_rng(1)
    q = np.array([rotation(rng.uniform(size=3)) for _ in range(4000)])
    assert np.allclose(np.linalg.norm(q, axis=1), 1.0)
    w, x, y, z = q.T
    for c in (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * z - w * y), 1.0 - 2.0 * (x * x + y * y)):
        sample = np.sort(c)
        off = np.abs(sample - np.linspace(-1.0, 1.0, len(sample))).max() / 2.0  # Kolmogorov
        assert off < 1.63 / math.sqrt(len(sample))  # 1 %


def test_a_draw_is_within_its_bounds_and_repeats() -> None:
    for seed in range(200):
        u = draw(AC, 195.0, 7010.0, (0.0, 2.0), False, seed)
        assert u == draw(AC, 195.0, 7010.0, (0.0, 2.0), False, seed)
        assert max(map(abs, u.rates_degps)) <= 30.0 and 156.0 <= u.V_mps <= 214.5 and abs(u.beta_deg) <= 5.0
        assert abs(u.alpha_deg) <= AC.limits.alpha_max_deg + 1.0
        assert 14.0 <= draw(AC, 195.0, 7010.0, (0.0, 2.0), True, seed).alpha_deg <= 28.0


# --- how it starts -----------------------------------------------------------------------------------------------------


def world(upset: dict[str, Any]) -> World:
    """Tanker and receiver, this one started upset."""
    return World(load_scenario("refueling", {"aircraft.receiver.start.upset": upset}), 1)


def test_the_plant_starts_as_asked() -> None:
    m = world(UPSET).members[1]
    t = truth_of(m, 0)
    assert np.degrees(t.euler) == pytest.approx(UPSET["attitude_deg"]) and np.degrees(t.w_b) == pytest.approx(
        UPSET["rates_degps"]
    )
    assert (t.V, *np.degrees((t.alpha, t.beta))) == pytest.approx((160.0, 6.0, -3.0))
    assert m.trim == pytest.approx(
        World(load_scenario("refueling"), 1).members[1].trim
    )  # controls are those of the trim


def test_it_is_judged_by_attitude_once_it_has_been_upright() -> None:
    m = world(UPSET).members[1]
    w, dt = Watch(m, 0.01), 0.01
    assert not any(w.step() for _ in range(round(2.0 * HOLD_S / dt)))  # upside down all the time
    m.view.o[n.O_EULER : n.O_EULER + 3] = [0.0, 0.0, 0.0]
    m.view.s[n.S_W : n.S_W + 3] = [0.0, 0.0, 0.0]
    assert not any(w.step() for _ in range(round(1.01 * HOLD_S / dt)))
    m.view.o[n.O_EULER + 2] = 3.0
    assert any("out of control" in w.step() for _ in range(round(1.1 * HOLD_S / dt)))


def test_what_cannot_start_upset_is_named() -> None:
    with pytest.raises(ConfigError, match=r"aircraft\.alexis\.start\.upset: nothing obeys it with model = 'alexis'"):
        load_scenario("gust", {"aircraft.alexis.start.upset": UPSET})
    with pytest.raises(ConfigError, match=r"aircraft\.receiver\.start: 120\.0 m/s"):
        world(UPSET | {"V_mps": 120.0})
    with pytest.raises(ConfigError, match=r"start\.upset\.roll_deg: unknown key"):
        convert({"meta": {"name": "x", "duration_s": 1.0}, "aircraft": [
            {"name": "a", "file": "kc135r", "sysid": 1, "start": {"upset": {"roll_deg": 1.0}}}]}, Scenario, "x")  # fmt: skip


# --- what is flown -----------------------------------------------------------------------------------------------------


def test_level_is_what_holds_without_a_break() -> None:
    t = truth_of(
        world({"V_mps": 190.0}).members[1], 0
    )  # still air has none of it: level by attitude, path and incidence
    t.vel_n = t.wind_n
    seen = Seen(AC, 7000.0)
    assert not any(seen.look(k * 0.05, t, 1.0) for k in range(100)) and seen.look(5.0, t, 1.0)
    t.euler = (0.0, 0.0, 0.1)
    assert not seen.look(5.05, t, 1.0) and math.isinf(seen.since)


@pytest.mark.parametrize(("case", "seed"), [("receiver", 3), ("receiver", 8), ("receiver_stalled", 2), ("tanker", 6)])
def test_it_comes_back(case: str, seed: int) -> None:
    v = run_case(CASES[case], seed).values
    assert v["is.recovered"] == 1.0 and sum(v[f"is.{o}"] for o in OUTCOMES) == 1.0
    assert v["height_lost_m"] < 1500.0 and v["load_max_g"] < 4.7 and v["load_min_g"] > -1.5


def test_beside_the_tanker_it_says_so_leaves_and_comes_back() -> None:
    """Bank 80 deg on the observation position: warned at once, breakaway for good, the law has it back at the end of it."""
    at = "plant.aircraft.receiver.start.upset"
    flight = Flying("refueling", 3, (f"{at}.attitude_deg=[0.0, -5.0, 80.0]", f"{at}.alpha_deg=3.0"))
    texts, phases, states, flags = [], [], set(), 0
    for _ in range(1600):
        _, telemetry = flight.tick()
        for packet, _ in (p for d in telemetry[1] for p in split(d)):
            kind, f = packet_id(packet), decode(packet)
            if kind == TEXT:
                texts.append((f["severity"], str(f["text"])))
            elif kind == STATUS:
                phases.append(phase_in(f))
            elif kind == HEARTBEAT and flight.t_s < 5.0:
                states.add(f["system_status"])
            elif kind == HEALTH and flight.t_s < 5.0:
                flags |= int(f["failed"])
    said = [t for _, t in texts if t.startswith("recovery")]
    assert (4, "recovery: bank 80 deg") in texts and said[1:] == ["recovery: level", "recovery: control given back"]
    assert set(phases) <= {"init", "observation", "breakaway"} and phases[-1] == "breakaway"
    assert phases.count("observation") <= 1 and 6 in states and flags & 1024
    r = truth_of(flight.server.world.members[1], flight.server.t_us)
    assert math.dist(r.xi, (-100.0, 70.0, 60.0)) < 30.0 and not flight.nodes[1].app.mission.recovering
