"""One graded refuelling: plant and onboard processes whole, the orders of the scenario, judged by the truth from contact on."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.link.packets import IDS, Fields, decode, packet_id, split
from hil_scripts.campaign.study import Case, RunResult
from hil_scripts.studies.grades.winds import Winds
from hil_scripts.studies.integrity.flight import LOOK_HZ, RECEIVER, TANKER, Watch
from hil_scripts.studies.integrity.judge import Outcome, judge
from hil_scripts.studies.integrity.snapshot import STATUS, Flying, phase_in, said
from hil_scripts.studies.integrity.table import Moment
from sim_plant.lost import AircraftLostError
from sim_plant.truth import truth_of

STATION_M = (-35.5, 0.0, 8.5)  # [m] contact, tanker axes
START_M = [-47.0, 0.0, 12.5]  # [m] pre-contact: observation is flown there, and nothing is asked of the way to it
LIMIT_M = 2.0  # [m] latched
NAV, RELATIVE, INTEGRITY = IDS["NAV_STATE"], IDS["RELATIVE_STATE"], IDS["INTEGRITY_STATUS"]
GUARDED = (
    "plant.aircraft.receiver.mission=receiver_tactical", "tanker.wind_calibration.on=true", "receiver.wind_calibration.on=true",
)  # fmt: skip
BARE = ("receiver.integrity.on=false",)  # what the flight file believes is one grade's
NOT_REACHED = "not_reached"  # contact was never flown
OUTCOMES = (*(o.name.lower() for o in Outcome), NOT_REACHED)
LEAST_S = 5.0  # [s] of contact below which there are no figures of it
Arr = NDArray[np.float64]


@dataclass(frozen=True)
class Timetable:
    """[s] Orders to close in to pre-contact and contact, the tanker's turn, latest arrival at contact, time watched from it."""

    precontact_s: float = 20.0
    contact_s: float = 40.0
    turn_s: float = 150.0
    arrive_s: float = 130.0
    watch_s: float = 150.0


def settings(grade: str, sigma_mps: float, times: Timetable, guarded: bool = False) -> tuple[str, ...]:
    """What the scenario `refueling` is changed by; both aircraft carry sensors of the grade; guarded: integrity of the relative
    position and calibrated wind on board."""
    return (
        *(GUARDED if guarded else BARE),
        f"plant.sensors.tanker.grade={grade}", f"plant.sensors.receiver.grade={grade}",
        f"plant.wind.dryden.sigma_mps={sigma_mps}", f"plant.event.0.t_s={times.precontact_s}",
        f"plant.event.1.t_s={times.contact_s}", f"tanker.guid.first_leg_s={times.turn_s}",
        f"plant.aircraft.receiver.start.xi_m={START_M}", f"receiver.guid.observation_m={START_M}",
    )  # fmt: skip


class Graded(Watch):
    """What Watch sees, and the receiver's published estimates beside the truth of their time."""

    def __init__(self, flight: Flying) -> None:
        super().__init__(flight, Moment("refueling", flight.t_s, LIMIT_M, "contact", STATION_M))
        self._true: deque[tuple[int, Any]] = deque(maxlen=LOOK_HZ)
        self.contact: list[tuple[float, ...]] = []  # [m] true xi less the station, per look in contact
        self.relative: list[tuple[float, ...]] = []  # [m] error, sigma
        self.wind: list[tuple[float, ...]] = []  # [m/s] error, sigma
        self.bound: list[tuple[float, ...]] = []  # [m] error of the bounded position, its protection level; 1e9: none
        self.winds = (Winds("tanker"), Winds("receiver"))
        self._tanker: deque[tuple[int, Any]] = deque(maxlen=LOOK_HZ)
        self.alerts = 0  # sources newly left out or in dispute, of a flight without a fault
        self._doubted = 0
        self.unpaired = 0  # estimates without a truth of their time, or invalid

    def look(self) -> None:
        """The truth of the current tick."""
        super().look()
        t_us = self.flight.server.world.t_us
        r = truth_of(self.members[RECEIVER], t_us)
        self._true.append((t_us, r))
        t = truth_of(self.members[TANKER], t_us)
        self._tanker.append((t_us, t))
        self.winds[TANKER].look(t)
        self.winds[RECEIVER].look(r)
        if math.isinf(self.left_s):
            self.contact.append(tuple(a - b for a, b in zip(r.xi, STATION_M, strict=True)))

    def read(self, telemetry: list[list[bytes]]) -> None:
        """Take in the telemetry of a tick, of both."""
        if math.isfinite(self.left_s):
            return
        for kind, m in _of(telemetry[RECEIVER], (NAV, RELATIVE, INTEGRITY)):
            self._pair(kind, m)
        for _, m in _of(telemetry[TANKER], (NAV,)):
            if m["valid"] and (r := next((r for t, r in self._tanker if t == m["time_usec"]), None)) is not None:
                self.winds[TANKER].note(m["wind"], r)

    def _pair(self, kind: int, m: Fields) -> None:
        r = next((r for t, r in self._true if t == m["time_usec"]), None)
        if kind == INTEGRITY:
            doubted = m["excluded"] | m["undecided"]
            self.alerts += (doubted & ~self._doubted).bit_count()
            self._doubted = doubted
        if kind == INTEGRITY and r is not None:
            self.bound.append((*np.subtract(m["pos"], r.xi), *m["pl"]))
        elif kind == INTEGRITY or r is None or not m["valid"]:
            self.unpaired += 1
        elif kind == NAV:
            self.wind.append((*np.subtract(m["wind"], r.wind_n), *m["wind_sigma"]))
            self.winds[RECEIVER].note(m["wind"], r)
        else:
            self.relative.append((*np.subtract(m["pos"], r.xi), *m["sigma"]))


def _of(datagrams: list[bytes], kinds: tuple[int, ...]) -> Iterator[tuple[int, Fields]]:
    """The packets of these kinds."""
    for datagram in datagrams:
        for packet, fault in split(datagram):
            if not fault and packet_id(packet) in kinds:
                yield packet_id(packet), decode(packet)


def arrive(flight: Flying, latest_s: float) -> bool:
    """Fly until the receiver reports contact, or to latest_s [s]; whether it did. Raises AircraftLostError."""
    while flight.t_s < latest_s:
        _, telemetry = flight.tick()
        if any(kind == STATUS and phase_in(f) == "contact" for kind, f in said(telemetry[RECEIVER])):
            return True
    return False


def follow(watch: Graded, watch_s: float) -> bool:
    """Fly on for watch_s [s] or until an aircraft is lost; whether one was."""
    flight, world = watch.flight, watch.flight.server.world
    every = world.rate_hz // LOOK_HZ
    try:
        for _ in range(round(watch_s * world.rate_hz)):
            if world.tick % every == 0:
                world.sense()
                watch.look()
            _, telemetry = flight.tick()
            watch.hear(telemetry)
            watch.read(telemetry)
    except AircraftLostError:
        return True
    return False


def _errors(name: str, rows: list[tuple[float, ...]], axes: str, unit: str) -> dict[str, float]:
    """RMS and 95 % of the errors [N, 3] per axis, mean sigma, share inside 3 sigma and mean of (error over sigma)^2 of all
    axes together."""
    a = np.array(rows)
    e, sigma = a[:, :3], a[:, 3:]
    out = {f"{name}.rms_{unit}.{x}": float(np.sqrt(np.mean(e[:, i] ** 2))) for i, x in enumerate(axes)}
    out |= {f"{name}.p95_{unit}.{x}": float(np.percentile(np.abs(e[:, i]), 95)) for i, x in enumerate(axes)}
    out |= {f"{name}.sigma_{unit}.{x}": float(np.mean(sigma[:, i])) for i, x in enumerate(axes)}
    out[f"{name}.inside_3sigma_pct"] = 100.0 * float(np.mean(np.abs(e) <= 3.0 * sigma))
    out[f"{name}.nees_per_axis"] = float(np.mean((e / sigma) ** 2))
    return out


def figures(watch: Graded) -> dict[str, float]:
    """Station keeping and errors of the estimates while the receiver was in contact; nothing below LEAST_S of it."""
    if len(watch.contact) < LEAST_S * LOOK_HZ:
        return {}
    e = np.array(watch.contact)
    out = {f"contact.rms_m.{x}": float(np.sqrt(np.mean(e[:, i] ** 2))) for i, x in enumerate("xyz")}
    out |= {f"contact.p95_m.{x}": float(np.percentile(np.abs(e[:, i]), 95)) for i, x in enumerate("xyz")}
    out["contact.s"] = len(e) / LOOK_HZ
    for name, rows, axes, unit in (("relative", watch.relative, "xyz", "m"), ("wind", watch.wind, "ned", "mps")):
        if rows:
            out |= _errors(name, rows, axes, unit)
    for winds in watch.winds:
        out |= winds.figures()
    if watch.bound:
        a = np.array(watch.bound)
        error, pl = np.abs(a[:, :3]), a[:, 3:]
        out["bound.held_pct"] = 100.0 * float(np.mean((error <= pl).all(axis=1)))
        out["bound.within_limit_pct"] = 100.0 * float(np.mean((pl <= LIMIT_M).all(axis=1)))
        out |= {f"bound.p50_m.{x}": float(np.median(pl[:, i])) for i, x in enumerate("xyz")}
    return out


def run_case(case: Case, seed: int) -> RunResult:
    """One flight of one seed under a grade and a level. Raises ConfigError for what cannot be flown."""
    p = case.params
    times = Timetable(**p.get("times", {}))
    flight = Flying("refueling", seed % 2**31, settings(p["grade"], p["sigma_mps"], times, p.get("guarded", False)))
    outcome, values = NOT_REACHED, {}
    try:
        reached = arrive(flight, times.arrive_s)
    except AircraftLostError:
        reached, outcome = False, Outcome.LOST.name.lower()
    if reached:
        watch = Graded(flight)
        track = watch.track(follow(watch, times.watch_s))
        outcome = judge(track, LIMIT_M).name.lower()
        values = figures(watch) | {"off_max_m": float(track.off.max()), "gap_min_m": float(track.gap.min())}
        values |= {"unpaired": float(watch.unpaired), "alerts": float(watch.alerts), "watched_s": flight.t_s - watch.t0}
    values["reached_s"] = flight.t_s if not reached else watch.t0
    return RunResult({f"is.{o}": float(o == outcome) for o in OUTCOMES} | values)
