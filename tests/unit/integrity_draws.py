"""Sensors of relative position drawn as the tactical grade has them, behind a tanker in level flight."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import load_aircraft
from flightsw.kernels.atmosphere import G0
from flightsw.missions.receiver.airdata.witness import WakeRows
from flightsw.missions.receiver.integrity.integrity import Integrity
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.refuel import CONTACT, PRECONTACT
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.types import (
    NO_GAIN,
    UPD_FIX,
    UPD_GNSS,
    UPD_IMU,
    UPD_REL,
    Gain,
    Health,
    NavState,
    PeerFix,
    PeerState,
    SensorFrame,
)

Arr = np.ndarray
DT, T0 = 0.05, 1_000_000  # [s], [us]
REL_LATE = 2  # steps; the boom's is 1
V_T = np.array([195.0, 0.0, 0.0])  # [m/s] tanker's, NED
PLACES = {PRECONTACT: np.array([-47.0, 0.0, 12.5]), CONTACT: np.array([-35.5, 0.0, 8.5])}


@dataclass(frozen=True)
class Fault:
    """An error of one source ("rel", "gnss", "boom") along an axis from `at_s` on: a step [m], or a walk [m/s] with its rate or
    without; off: silent."""

    source: str
    axis: int = 2
    step: float = 0.0
    walk: float = 0.0
    whole: bool = False  # its velocity walks with it
    off: bool = False
    at_s: float = 20.0
    until_s: float = math.inf

    def error(self, t: float) -> tuple[Arr, Arr]:
        """Error of position [m] and rate [m/s] of a sample of time t [s]."""
        pos, vel = np.zeros(3), np.zeros(3)
        if self.at_s <= t < self.until_s:
            pos[self.axis] = self.step + self.walk * (t - self.at_s)
            vel[self.axis] = self.walk * self.whole
        return pos, vel


@dataclass
class Seen:
    """Step by step: t [N] s, error of the bank, of the reading handed on and of what is flown by [N,3] m, bound, sigma [N,3] m,
    ratio [N,4], over [N]; texts with their times."""

    t: Arr
    error: Arr
    fed: Arr
    flown: Arr
    pl: Arr
    sigma: Arr
    ratio: Arr
    over: Arr
    gnss: Arr  # [N] a fix is handed on to the estimator
    texts: list[tuple[float, str]]
    bank: Integrity


def slow(rng: np.random.Generator, n: int, tau: float, sigma: float | Arr) -> Arr:
    """First-order Gauss-Markov draws [n,3]."""
    a = math.exp(-DT / tau)
    x = rng.standard_normal((n, 3))
    x[1:] *= math.sqrt(1.0 - a * a)
    for i in range(1, n):
        x[i] += a * x[i - 1]
    return x * sigma


class WakeSeen:
    """What air data say of the place across, at every step: noise (as 9 m below the vortices), a passing error, a lasting one."""

    def __init__(self, seed: int, fault: Fault | None = None) -> None:
        self._rng, self._fault = np.random.default_rng((seed, 2)), fault
        self._lasting, self._passing = 2.0 * self._rng.standard_normal(2), np.zeros(2)
        self.number = 1

    def rows(self, t_us: int, xi: Arr) -> WakeRows:
        """Of the true place xi [3] m, behind a tanker in level flight to the north."""
        kept = math.exp(-DT / 2.7)
        passing, noise = self._rng.standard_normal((2, 2))
        self._passing = kept * self._passing + 0.15 * math.sqrt(1.0 - kept * kept) * passing
        y = xi[1:] + self._lasting + self._passing + 0.95 * noise
        if self._fault is not None:
            y = y + self._fault.error((t_us - T0) * 1e-6)[0][1:]
        H = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        return WakeRows(t_us, y, H, np.full(2, 0.95**2), np.full(2, 4.0), self.number)


@dataclass(frozen=True)
class Air:
    """Gusts: acceleration of the tanker [m/s^2], 0.7 s long, that the receiver follows late; told: its gains are heard."""

    gust: float = 0.0
    told: bool = True


CALM = Air()


def draw(
    seed: int,
    seconds: float,
    phase: int,
    fault: Fault | None = None,
    air: Air = CALM,
    off_m: float = 0.0,
    off_s: float = 20.0,
) -> Seen:
    """One draw on a station of `phase`; the receiver wanders 0.3 m about it. off_m: the estimator is so far aside of the
    bank from off_s on."""
    n = round(seconds / DT)
    bank, t = (
        Integrity(IntegrityParams(on=True), load_aircraft("kc135r"), load_aircraft("learjet24")),
        np.arange(n) * DT,
    )
    true = PLACES[phase] + 0.3 * np.sin(t[:, None] * np.array([0.2, 0.25, 0.3]))
    tanker = slow(np.random.default_rng((seed, 1)), n, 0.7, air.gust)
    away, drift = np.zeros(3), np.zeros(3)
    for i in range(n):
        drift += DT * (-tanker[i] - 1.5 * drift - away)
        away = away + DT * drift
        true[i] += away
    peer, rows = PeerTracker(), []
    texts: list[tuple[float, str]] = []
    for i, (f, sample) in enumerate(frames(seed, true, phase, fault, tanker, air.told)):
        if i % 2 == 0:
            peer.take(sample)
        new = f.updated
        g, handed, _ = bank.step(f, new, Health(), peer, phase)
        o, (x, y, z) = bank.out, bank.out.pos
        nav = NavState(t_us=f.t_us, valid=True, rel_pos_t=(x, y + off_m * (t[i] > off_s), z))
        bank.publish(nav, False, False)
        rows.append(
            (
                *(np.array(o.pos) - true[i]),
                *(np.array(g.rel_pos_t) - true[i]),
                *(np.array(nav.rel_pos_t) - true[i]),
                *o.pl,
                *o.sigma,
                *o.ratio,
                bool(bank.over),
                bool(handed & UPD_GNSS),
            )
        )
        texts += [(float(t[i]), x.text) for x in bank.texts[len(texts) :]]
    a = np.array(rows)
    errors, bounds = (a[:, :3], a[:, 3:6], a[:, 6:9]), (a[:, 9:12], a[:, 12:15], a[:, 15:19])
    return Seen(t, *errors, *bounds, a[:, 19] > 0, a[:, 20] > 0, texts, bank)


def frames(
    seed: int, true: Arr, phase: int, fault: Fault | None, tanker_acc: Arr, told: bool
) -> Iterator[tuple[SensorFrame, PeerState]]:
    """What the receiver reads at every step of the true way [n,3] m, and the tanker's transmitted state; it is accelerated by
    tanker_acc [n,3] m/s^2."""
    rng, n, xi = np.random.default_rng(seed), len(true), PLACES[phase]
    v = np.gradient(true, DT, axis=0)
    force = np.gradient(v, DT, axis=0) + tanker_acc - np.array([0.0, 0.0, G0]) + 0.02 * rng.standard_normal(3)
    felt = 0.03 * rng.standard_normal(
        3
    )  # [m/s^2] lasting error of the tanker's accelerometers, in level flight without one
    tanker, own = load_aircraft("kc135r"), load_aircraft("learjet24")
    assert tanker.boom is not None and own.receptacle is not None
    arm, retracted = np.array(own.receptacle.position_m) - np.array(tanker.boom.pivot_m), tanker.boom.length_retracted_m
    rel = slow(rng, n, 60.0, 0.2) + 0.1 * rng.standard_normal(3)
    rel += np.cross(0.0026 * rng.standard_normal(3), xi) + 0.005 * rng.standard_normal() * xi
    rel_v = slow(rng, n, 60.0, 0.02) + 0.01 * rng.standard_normal(3)
    own_sigma, blocked = np.array([0.2, 0.2, 0.3]), 1.0 + max(0.0, 1.0 - float(np.linalg.norm(xi)) / 50.0)
    gnss = slow(rng, n, 60.0, own_sigma * blocked) - slow(rng, n, 60.0, own_sigma)
    gnss_v = slow(rng, n, 60.0, 0.005 * math.sqrt(2.0)) + 0.002 * math.sqrt(2.0) * rng.standard_normal(3)
    turn = slow(rng, n, 100.0, 0.00175) + 0.00175 * rng.standard_normal(3)
    boom = np.array([0.0035, 0.0035, 0.05]) * rng.standard_normal(3)
    noise = rng.standard_normal((n, 7, 3))
    now, late, one_late = np.arange(n), np.maximum(np.arange(n) - REL_LATE, 0), np.maximum(np.arange(n) - 1, 0)
    wrong, wrong_v = (
        {k: np.zeros((n, 3)) for k in ("rel", "gnss", "boom")},
        {k: np.zeros((n, 3)) for k in ("rel", "gnss")},
    )
    if fault and fault.source in wrong:
        errors = [fault.error(j * DT) for j in late.tolist()]
        wrong[fault.source][:] = [e[0] for e in errors]
        wrong_v |= {fault.source: np.array([e[1] for e in errors])}
    silent = fault.source if fault and fault.off else ""
    place, at = V_T * (late[:, None] * DT) + np.array([0.0, 0.0, -7010.0]), true[late]
    d = true[one_late] + arm + wrong["boom"]
    acc, heard = tanker_acc, np.zeros((n, 3))
    heard[1:] = acc[:-1]
    heard[2:] += acc[:-2]
    rows = zip(
        *(a.tolist() for a in (
            force,
            at + rel[late] + 0.1 * noise[:, 0] + wrong["rel"], v[late] + rel_v[late] + 0.05 * noise[:, 1] + wrong_v["rel"],
            place + at + gnss[late] + 0.1 * noise[:, 2] + wrong["gnss"],
            V_T + v[late] + gnss_v[late] + 0.01 * noise[:, 3] + wrong_v["gnss"],
            place + 0.1 * noise[:, 4], V_T + 0.01 * noise[:, 5], DT * (2.0 * felt + heard),
            np.arctan2(-d[:, 2], np.hypot(d[:, 0], d[:, 1])) + boom[0] + 0.00175 * noise[:, 6, 0],
            np.arctan2(d[:, 1], -d[:, 0]) + boom[1] + 0.00175 * noise[:, 6, 1],
            np.linalg.norm(d, axis=1) - retracted + boom[2] + 0.02 * noise[:, 6, 2],
            0.5 * turn, V_T * (now[:, None] * DT),
        )),
        strict=True,
    )  # fmt: skip
    for i, (f_b, rel_p, rel_w, own_p, own_v, his_p, his_v, felt_v, up, aside, out_m, q, way) in enumerate(rows):
        t_us, j = T0 + round(i * DT * 1e6), max(i - REL_LATE, 0)
        late_us, off = T0 + round(j * DT * 1e6), silent if fault and i * DT >= fault.at_s else ""
        f = SensorFrame(
            t_us=t_us,
            gyro_count=5, att_t_us=t_us,
            acc_mean_b=tuple(f_b),
            updated=UPD_IMU | (0 if off == "rel" else UPD_REL) | ((UPD_GNSS | UPD_FIX) if i % 2 == 0 and off != "gnss" else 0),
            rel_t_us=late_us, rel_valid=off != "rel", rel_pos_t=tuple(rel_p), rel_vel_t=tuple(rel_w),
            gnss_t_us=late_us, gnss_pos_n=tuple(own_p), gnss_vel_n=tuple(own_v),
            fix=PeerFix(
                t_us=late_us, pos_n=tuple(his_p), vel_n=tuple(his_v),
                gain=Gain(t_us - 50_000, 2.0 * DT, tuple(felt_v)) if told else NO_GAIN,
            ),
            boom_t_us=T0 + round(max(i - 1, 0) * DT * 1e6), boom_contact=phase == CONTACT and off != "boom",
            boom_elevation=up, boom_azimuth=aside, boom_extension_m=out_m,
        )  # fmt: skip
        yield f, PeerState(t_us=t_us - 50_000, pos_n=tuple(way), vel_n=tuple(V_T), q_nb=(1.0, *q))
