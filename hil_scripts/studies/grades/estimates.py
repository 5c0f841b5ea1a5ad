"""Published estimates of both aircraft beside the truth of their time, phase by phase, and what the sensors would allow."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from ground.link.packets import IDS, Fields, decode, packet_id, split
from hil_scripts.studies.grades.posterior import PositionBound, terms_of
from hil_scripts.studies.grades.twin import attach
from hil_scripts.studies.grades.winds import Winds
from hil_scripts.studies.integrity.flight import LOOK_HZ, RECEIVER, TANKER
from hil_scripts.studies.integrity.snapshot import Flying, phase_in
from hil_scripts.studies.rows import Rows
from sim_plant.truth import Truth, truth_of

Arr = NDArray[np.float64]
NAV, RELATIVE, INTEGRITY, STATUS = (
    IDS[k] for k in ("NAV_STATE", "RELATIVE_STATE", "INTEGRITY_STATUS", "MISSION_STATUS")
)
READ = (NAV, RELATIVE, INTEGRITY, STATUS)
PRECONTACT = "precontact"
NONE = (math.nan,) * 3
LIMIT_M = 2.0  # [m] latched
WORDS = ("tanker", "receiver")
ANGLES = ("psi", "theta", "phi")


def packets(datagrams: list[bytes], kinds: tuple[int, ...]) -> Iterator[tuple[int, Fields]]:
    """The packets of these kinds."""
    for datagram in datagrams:
        for packet, fault in split(datagram):
            if not fault and packet_id(packet) in kinds:
                yield packet_id(packet), decode(packet)


class Phase:
    """Errors of one phase: rows of error, published sigma and, where it is known, least sigma possible [9]."""

    def __init__(self) -> None:
        self.relative = Rows(9)  # [m] tanker axes
        self.wind = (Rows(9), Rows(9))  # [m/s] NED, tanker and receiver
        self.attitude = (Rows(6), Rows(6))  # [deg] ANGLES
        self.bound = Rows(6)  # [m] error of the bounded position [3], its protection level [3]; 1e9: none
        self.unpaired = 0  # estimates without a truth of their time, or invalid


class Estimates:
    """Of a flight from its start on: `look` LOOK_HZ times a second, `read` every tick."""

    def __init__(self, flight: Flying, grade: str = "") -> None:
        """grade: of the sensors of both, whose bounds are wanted."""
        self.flight, self.members = flight, flight.server.world.members
        self.precontact, self.contact = Phase(), Phase()
        self.phase = ""
        self.winds = (Winds(WORDS[TANKER]), Winds(WORDS[RECEIVER]))
        self._true: deque[tuple[int, Truth, Truth, tuple[float, ...]]] = deque(maxlen=LOOK_HZ)
        self._best = self._twins = None
        if grade:
            giver, taker = (m.ac for m in (self.members[TANKER], self.members[RECEIVER]))
            assert isinstance(giver, Aircraft) and isinstance(taker, Aircraft) and giver.boom and taker.receptacle
            self._best = PositionBound(terms_of(grade), giver.boom, taker.receptacle.position_m)
            self._twins = tuple(attach(node, grade) for node in flight.nodes)

    def look(self) -> tuple[Truth, Truth]:
        """The truth of the current tick, sensed: the tanker's and the receiver's."""
        t_us = self.flight.server.world.t_us
        t, r = (truth_of(self.members[i], t_us) for i in (TANKER, RECEIVER))
        best = NONE if self._best is None else tuple(self._best.step(t, r, r.contact).tolist())
        self._true.append((t_us, t, r, best))
        return t, r

    def read(self, telemetry: list[list[bytes]], contact: bool) -> None:
        """Take in the telemetry of a tick, of both; contact: the receiver has reported it, and not left it since."""
        for kind, m in packets(telemetry[RECEIVER], READ):
            if kind == STATUS:
                self.phase = phase_in(m)
                continue
            if (phase := self._of(contact)) is not None:
                self._pair(phase, kind, m)
        if (phase := self._of(contact)) is None:
            return
        for _, m in packets(telemetry[TANKER], (NAV,)):
            if m["valid"] and (now := self._at(m["time_usec"])) is not None:
                self._nav(phase, TANKER, m, now[1])

    def _of(self, contact: bool) -> Phase | None:
        return self.contact if contact else self.precontact if self.phase == PRECONTACT else None

    def _at(self, t_us: int) -> tuple[int, Truth, Truth, tuple[float, ...]] | None:
        return next((x for x in self._true if x[0] == t_us), None)

    def _pair(self, phase: Phase, kind: int, m: Fields) -> None:
        now = self._at(m["time_usec"])
        if kind == INTEGRITY and now is not None:
            phase.bound.append((*np.subtract(m["pos"], now[2].xi), *m["pl"]))
        elif kind == INTEGRITY or now is None or not m["valid"]:
            phase.unpaired += 1
        elif kind == NAV:
            self._nav(phase, RECEIVER, m, now[2])
        else:
            phase.relative.append((*np.subtract(m["pos"], now[2].xi), *m["sigma"], *now[3]))

    def _nav(self, phase: Phase, who: int, m: Fields, true: Truth) -> None:
        twin = None if self._twins is None else self._twins[who]
        best = NONE if twin is None else twin.sigma(m["time_usec"])
        phase.wind[who].append((*np.subtract(m["wind"], true.wind_n), *m["wind_sigma"], *best))
        off = (math.remainder(m[k] - e, math.tau) for k, e in zip(ANGLES, true.euler, strict=True))
        phase.attitude[who].append(tuple(math.degrees(x) for x in (*off, *m["att_sigma"])))
        if phase is self.contact:
            self.winds[who].note(m["wind"], true)


def errors(name: str, rows: Rows, axes: tuple[str, ...], unit: str) -> dict[str, float]:
    """RMS and 95 % of the errors per axis, mean sigma, share inside 3 sigma and mean of (error over sigma)^2 of all axes
    together; RMS error over that of the least sigma possible, where rows [N, 9] say it."""
    a = np.array(rows)
    e, sigma, least = a[:, :3], a[:, 3:6], a[:, 6:]
    rms = np.sqrt(np.mean(e**2, axis=0))
    out = {f"{name}.rms_{unit}.{x}": float(rms[i]) for i, x in enumerate(axes)}
    out |= {f"{name}.p95_{unit}.{x}": float(np.percentile(np.abs(e[:, i]), 95)) for i, x in enumerate(axes)}
    out |= {f"{name}.sigma_{unit}.{x}": float(np.mean(sigma[:, i])) for i, x in enumerate(axes)}
    out[f"{name}.inside_3sigma_pct"] = 100.0 * float(np.mean(np.abs(e) <= 3.0 * sigma))
    out[f"{name}.nees_per_axis"] = float(np.mean((e / sigma) ** 2))
    if least.shape[1] and np.isfinite(least).all():
        bound = np.sqrt(np.mean(least**2, axis=0))
        out |= {f"{name}.rms_bound_{unit}.{x}": float(bound[i]) for i, x in enumerate(axes)}
        out |= {f"{name}.rms_over_bound.{x}": float(rms[i] / bound[i]) for i, x in enumerate(axes)}
    return out


def in_contact(e: Estimates) -> dict[str, float]:
    """Errors of the estimates in contact."""
    p, out = e.contact, dict[str, float]()
    named: tuple[tuple[str, Rows, tuple[str, ...], str], ...] = (
        ("relative", p.relative, ("x", "y", "z"), "m"),
        ("wind", p.wind[RECEIVER], ("n", "e", "d"), "mps"),
        ("wind.tanker", p.wind[TANKER], ("n", "e", "d"), "mps"),
        ("attitude.receiver", p.attitude[RECEIVER], ANGLES, "deg"),
        ("attitude.tanker", p.attitude[TANKER], ANGLES, "deg"),
    )
    for name, rows, axes, unit in named:
        if rows:
            out |= errors(name, rows, axes, unit)
    for winds in e.winds:
        out |= winds.figures()
    if p.bound:
        a = np.array(p.bound)
        error, pl = np.abs(a[:, :3]), a[:, 3:]
        out["bound.held_pct"] = 100.0 * float(np.mean((error <= pl).all(axis=1)))
        out["bound.within_limit_pct"] = 100.0 * float(np.mean((pl <= LIMIT_M).all(axis=1)))
        out |= {f"bound.p50_m.{x}": float(np.median(pl[:, i])) for i, x in enumerate("xyz")}
    return out


def in_precontact(e: Estimates) -> dict[str, float]:
    """Distance of the relative position from the truth at pre-contact, RMS and 95 %, and its consistency; nothing of what was not
    flown."""
    if not e.precontact.relative:
        return {}
    a = np.array(e.precontact.relative)
    off = np.linalg.norm(a[:, :3], axis=1)
    out = {"precontact.s": len(off) / 10.0, "precontact.off_rms_m": float(np.sqrt(np.mean(off**2)))}
    out["precontact.off_p95_m"] = float(np.percentile(off, 95))
    if np.isfinite(a[:, 6:]).all():
        out["precontact.off_rms_bound_m"] = float(np.sqrt(np.mean((a[:, 6:] ** 2).sum(axis=1))))
    kept = errors("precontact", e.precontact.relative, ("x", "y", "z"), "m")
    return out | {k: v for k, v in kept.items() if "rms" in k or "inside" in k or "nees" in k}
