"""One closed-loop flight behind the tanker with three air-data probes, in process, judged by truth: by every byte of the real
link where logs are kept, else by packets with the same values.

The scenario `airdata`, begun at the pre-contact position instead of the observation position where a case is short. What is
recorded here is compared with the plant's truth afterwards; nothing of it goes back to the onboard software.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.app import FlightApp
from flightsw.missions.receiver.mission import ReceiverMission
from flightsw.types import Text
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.runfolder import RunPlan, make_folder, resolve
from hil_scripts.studies.integrity.snapshot import Flying

Arr = NDArray[np.float64]
SCENARIO = "airdata"
PRECONTACT_M = (-47.0, 0.0, 6.2)  # [m] as in receiver_airdata.toml; the short flights begin there
CONTACT_M = (-35.6, 0.0, 6.9)
EVERY = 5  # ticks between rows: 20 Hz
PRECONTACT_S, CLOSE_S = 10.0, 16.0  # [s] of the commands in a short flight
VARIABLES = ("V", "beta", "alpha")
OBSERVATION, TO_PRECONTACT, PRECONTACT, TO_CONTACT, CONTACT, BREAKAWAY = 1, 2, 3, 4, 5, 8


@dataclass(frozen=True)
class Setting:
    """One flight: extra events of the scenario and overrides as of `sil run --set`."""

    duration_s: float = 125.0
    events: tuple[dict[str, Any], ...] = ()
    sets: tuple[str, ...] = ()
    short: bool = True  # begins at pre-contact; else the scenario's own start and commands
    start_m: tuple[float, float, float] = PRECONTACT_M  # [m] pre-contact position of a short flight


@dataclass
class Track:
    """A flight at 20 Hz; N rows. Positions [m] in tanker body axes, F: its air-path axes."""

    t: Arr  # [N] s
    phase: NDArray[np.int64]  # [N] receiver guidance
    xi: Arr  # [N,3] true position
    nav: Arr  # [N,3] relative estimator
    ref: Arr  # [N,3] reference of the guidance
    wake: Arr  # [N,3] wake position
    sigma: Arr  # [N,2] its 1-sigma y, z
    cov_yz: Arr  # [N] m^2, its covariance of y and z
    valid: NDArray[np.bool_]  # [N] wake position valid
    held: NDArray[np.bool_]  # [N] station held without relative sensor or data link
    rel_valid: NDArray[np.bool_]  # [N]
    excluded: NDArray[np.int64]  # [N] 9-bit masks
    alarm: NDArray[np.int64]  # [N] 3-bit masks
    nis: Arr  # [N]
    bank: Arr  # [N] rad, of the tanker
    learnt: Arr  # [N,3] circulation factors of wing and tail, height of the wing's vortices [m]
    texts: list[tuple[float, str]] = field(default_factory=list)  # of the receiver

    def mask(self, *phases: int, t0: float = 0.0, t1: float = math.inf) -> NDArray[np.bool_]:
        """Rows in one of the phases and in [t0, t1)."""
        return np.isin(self.phase, phases) & (self.t >= t0) & (self.t < t1)


def plan_of(s: Setting, seed: int) -> RunPlan:
    """What is flown. Raises ConfigError for a bad setting."""
    sets = [
        *(f"{who}.nav.gate.false_alarm=0" for who in ("tanker", "receiver")),
        "receiver.integrity.on=false",
        *s.sets,
    ]  # the work refuses no reading and bounds no position
    if s.short:
        sets += [
            f"plant.aircraft.receiver.start.xi_m={list(s.start_m)}",
            f"receiver.guid.observation_m={list(s.start_m)}",
            f"receiver.guid.precontact_m={list(s.start_m)}",
        ]
    plan = resolve(SCENARIO, seed % 2**31, sets, s.duration_s)
    events = list(s.events)
    if s.short:
        events += [command(PRECONTACT_S, "precontact"), command(CLOSE_S, "contact")]
    else:
        events += plan.scenario["event"]
    return replace(plan, scenario={**plan.scenario, "event": events})


def fly(s: Setting, seed: int, keep: Path | None = None) -> Track:
    """Fly it; `keep`: folder for the run's logs, else there are none. Raises ConfigError for a bad setting."""
    with in_process(plan_of(s, seed), keep) as flight:
        return Watched(flight).fly_to(s.duration_s)


@contextmanager
def in_process(plan: RunPlan, keep: Path | None = None) -> Iterator[InProcess | Flying]:
    """The flight of a plan, to be ticked; its logs go to `keep`. Without there are no bytes, and no telemetry nobody reads."""
    flight: InProcess | Flying = Flying.of(plan) if keep is None else InProcess(plan, make_folder(plan, keep))
    if isinstance(flight, Flying):
        flight.hear_only(frozenset())
    on = gc.isenabled()
    gc.disable()
    try:
        yield flight
    finally:
        if isinstance(flight, InProcess):
            flight.finish() if flight.server.done else flight.close()
        if on:
            gc.enable()


def command(t_s: float, action: str) -> dict[str, Any]:
    """Event: a command to the receiver."""
    return {"t_s": t_s, "kind": "command", "target": "receiver", "action": action}


class Watched:
    """A flight under way and what was seen of it until now; a deep copy of both goes on as they do."""

    def __init__(self, flight: InProcess | Flying) -> None:
        self.flight = flight
        app = flight.nodes[1].app
        assert isinstance(app, FlightApp)
        m = app.mission
        assert isinstance(m, ReceiverMission) and m.air is not None
        self._app, self._mission, self._air = app, m, m.air
        self._rows: list[list[float]] = []
        self._texts: list[tuple[float, str]] = []
        self._t_s = 0.0
        self._said = m.texts
        m.texts = self._heard  # type: ignore[method-assign]

    def _heard(self) -> list[Text]:
        new = self._said()
        self._texts.extend((self._t_s, x.text) for x in new)
        return new

    def fly_to(self, t_s: float) -> Track:
        """On to a time [s], or the end of what was planned; the whole track until then."""
        server, world, m = self.flight.server, self.flight.server.world, self._mission
        end = round(t_s * world.rate_hz)
        while not server.done and server.tick < end:
            self._t_s = server.t_us * 1e-6
            row = server.tick % EVERY == 0
            if row:
                truth, lead = world.truth(1), world.truth(0)
            self.flight.tick()
            if not row:
                continue
            air = self._air
            o, g, st, learnt = self._app.nav, self._app.guid, air.fdi.out, air.learn.fix
            fix = air.fix or air.wake.fix
            at = m.nav.R_ft.reshape(3, 3) @ np.array(fix.pos_f)
            self._rows.append([
                self._t_s, *truth.xi, *o.rel_pos_t, *g.rel_pos_t, *at, math.sqrt(max(fix.cov_yy, 0.0)),
                math.sqrt(max(fix.cov_zz, 0.0)), fix.nis, lead.euler[2], *learnt.scale, learnt.height_m,
                fix.cov_yz, g.phase, st.excluded, st.alarm, fix.valid, o.rel_held, o.rel_valid,
            ])  # fmt: skip
        a = np.array(self._rows)
        i = a[:, 21:].astype(np.int64)
        return Track(
            t=a[:, 0], xi=a[:, 1:4], nav=a[:, 4:7], ref=a[:, 7:10], wake=a[:, 10:13], sigma=a[:, 13:15], nis=a[:, 15],
            bank=a[:, 16], learnt=a[:, 17:20], cov_yz=a[:, 20], phase=i[:, 0], excluded=i[:, 1], alarm=i[:, 2],
            valid=i[:, 3] > 0, held=i[:, 4] > 0, rel_valid=i[:, 5] > 0, texts=list(self._texts),
        )  # fmt: skip
