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
    for i in range(n):
        noise = rng.standard_normal((7, 3))
        t_us, j, b = T0 + round(i * DT * 1e6), max(i - REL_LATE, 0), max(i - 1, 0)
        late, boom_us = T0 + round(j * DT * 1e6), T0 + round(b * DT * 1e6)
        wrong = {
            k: fault.error(j * DT) if fault and fault.source == k else (np.zeros(3), np.zeros(3))
            for k in ("rel", "gnss", "boom")
        }
        off = fault.source if fault and fault.off and i * DT >= fault.at_s else ""
        place = V_T * j * DT + np.array([0.0, 0.0, -7010.0])
        d = true[b] + arm + wrong["boom"][0]
        f = SensorFrame(
            t_us=t_us,
            gyro_count=5, att_t_us=t_us,
            acc_mean_b=tuple(force[i]),
            updated=UPD_IMU | (0 if off == "rel" else UPD_REL) | ((UPD_GNSS | UPD_FIX) if i % 2 == 0 and off != "gnss" else 0),
            rel_t_us=late, rel_valid=off != "rel",
            rel_pos_t=tuple(true[j] + rel[j] + 0.1 * noise[0] + wrong["rel"][0]),
            rel_vel_t=tuple(v[j] + rel_v[j] + 0.05 * noise[1] + wrong["rel"][1]),
            gnss_t_us=late,
            gnss_pos_n=tuple(place + true[j] + gnss[j] + 0.1 * noise[2] + wrong["gnss"][0]),
            gnss_vel_n=tuple(V_T + v[j] + gnss_v[j] + 0.01 * noise[3] + wrong["gnss"][1]),
            fix=PeerFix(
                t_us=late, pos_n=tuple(place + 0.1 * noise[4]), vel_n=tuple(V_T + 0.01 * noise[5]),
                gain=Gain(t_us - 50_000, 2.0 * DT, tuple(DT * (2.0 * felt + tanker_acc[max(i - 2, 0) : i].sum(axis=0))))
                if told else NO_GAIN,
            ),
            boom_t_us=boom_us, boom_contact=phase == CONTACT and off != "boom",
            boom_elevation=float(math.atan2(-d[2], math.hypot(d[0], d[1])) + boom[0] + 0.00175 * noise[6, 0]),
            boom_azimuth=float(math.atan2(d[1], -d[0]) + boom[1] + 0.00175 * noise[6, 1]),
            boom_extension_m=float(np.linalg.norm(d) - retracted + boom[2] + 0.02 * noise[6, 2]),
        )  # fmt: skip
        q = (1.0, *(0.5 * turn[i]))
        yield f, PeerState(t_us=t_us - 50_000, pos_n=tuple(V_T * i * DT), vel_n=tuple(V_T), q_nb=q)
