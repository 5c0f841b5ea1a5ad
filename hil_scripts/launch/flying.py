"""Fly from Python, in this process and without sockets.

    from hil_scripts import Flight, fly
    run = fly("gust", seed=3, set={"plant.wind.dryden.sigma_mps": 1.0})

    with Flight("gust", seed=3) as flight:
        while not flight.done:
            seen = flight.step({"uav": {"flap": 0.02}})
    run = flight.run

Both leave the run folder that `sil run` of the same seed leaves, its logs the same to the byte where nobody interfered.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from flightsw.aircraft import load_airframe
from flightsw.icd.scaling import COMP_AUTOPILOT, GROUND_SYSID, ControlScale
from flightsw.icd.wire import BY_NAME, Sender
from flightsw.strict import ConfigError, near
from ground.link.command import CommandError, fit, order
from ground.link.packets import IDS, NAMES, Fields, decode, packet_id, split
from hil_scripts.launch import finish, kernel_cache, preflight, runfolder, screen, tomlout, warmup
from hil_scripts.launch.mission import Outcome
from hil_scripts.launch.procs import StopFlag
from hil_scripts.launch.runfolder import RunPlan
from sim_plant.world import AircraftLostError

if TYPE_CHECKING:
    from ground.data import Run
    from hil_scripts.launch.inproc import InProcess

ACTUATORS = IDS["HIL_ACTUATOR_CONTROLS"]
CHANNELS = {"aileron": 0, "elevator": 1, "rudder": 2, "throttle": 3, "flap": 4, "latch": 8}  # of its controls
STATION = 191  # component id of who commands here: not that of `ground send`
Values = Mapping[str, float]
Settings = Mapping[str, Any]


class FlightError(RuntimeError):
    """A flight could not be begun or ended other than by its end. The text says why."""


def fly(
    scenario: str,
    *,
    seed: int | None = None,
    set: Settings | None = None,  # noqa: A002 -- the option's name
    duration: float | None = None,
    out: Path | str | None = None,
    rrd: bool = False,
) -> Run:
    """Fly a scenario (name or path) as `sil run --in-process` does and open its run folder.

    set: keys as in `--set`; duration [s]; out: run folder (default runs/<scenario>-<seed>-<time>); rrd: draw run.rrd too. How it
    ended and its figures: `run.summary`. Raises ConfigError for bad input, FlightError for a flight that failed,
    KeyboardInterrupt after Ctrl-C, when the logs are closed.
    """
    from ground.data import Run
    from hil_scripts.launch import inproc

    console = screen.console(quiet=True)
    with StopFlag() as stop:
        plan, built = _ready(scenario, seed, set, duration, stop)
        folder = _folder(plan, None if out is None else Path(out))
        outcome = inproc.fly(plan, folder, console, stop, built)
        finish.finish(plan, folder, outcome, rrd, console, stop, in_process=True)
    if outcome.outcome == "aborted":
        raise KeyboardInterrupt
    if outcome.outcome == "failed":
        raise FlightError(f"{plan.scenario_name}: failed at t = {outcome.sim_s:.1f} s: {outcome.reason}")
    return Run(folder)


def _ready(
    scenario: str, seed: int | None, settings: Settings | None, duration: float | None, stop: StopFlag
) -> tuple[RunPlan, preflight.Built]:
    """Everything checked and built, kernels compiled."""
    cache = kernel_cache.use()
    if "numba" in sys.modules:  # imported before the folder was named
        sys.modules["numba"].config.CACHE_DIR = str(cache)
    sets = [f"{key}={tomlout.value(value, key)}" for key, value in (settings or {}).items()]
    plan = runfolder.resolve(scenario, seed, sets, duration)
    for text in plan.warnings:
        warnings.warn(text, stacklevel=3)
    if plan.realtime:
        raise ConfigError("plant.clock.mode = 'realtime': in one process there is no wall clock; allowed: 'lockstep'")
    if not warmup.warm(screen.console(quiet=True), stop):
        raise FlightError("the numerical kernels could not be compiled: `sil warmup` says why")
    return plan, preflight.build(plan)


def _folder(plan: RunPlan, out: Path | None, mode: str = "in-process") -> Path:
    folder = runfolder.make_folder(plan, out)
    runfolder.write_meta(folder, plan, mode=mode)
    return folder


@dataclass(frozen=True)
class Observation:
    """What was last on the wire of each aircraft: `seen[aircraft][message]` has its fields. t_s: time of the last tick [s]."""

    t_s: float
    wire: Mapping[str, Mapping[str, Fields]]

    def __getitem__(self, aircraft: str) -> Mapping[str, Fields]:
        return self.wire[aircraft]


class Flight:
    """A flight that somebody else's loop steps. It stands before its first tick; `reset` begins anew.

    step_s [s]: what one `step` flies, in whole ticks. out: run folder, of one flight only; None: a temporary one for each, gone
    with its `run`. Use as a context manager, or `close`. Raises ConfigError for bad input, FlightError.
    """

    def __init__(
        self,
        scenario: str,
        *,
        seed: int | None = None,
        set: Settings | None = None,  # noqa: A002 -- the option's name
        duration: float | None = None,
        out: Path | str | None = None,
        step_s: float = 0.1,
    ) -> None:
        self._what = (scenario, set, duration)
        self._out = None if out is None else Path(out)
        self._step_s = step_s
        self._flight: InProcess | None = None
        self.run: Run | None = None  # of the flight that was closed last
        self.reset(seed)

    def __enter__(self) -> Flight:
        return self

    def __exit__(self, tp: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        self.close()

    # --- one flight after the other -----------------------------------------------------------------------------------
    def reset(self, seed: int | None = None) -> Observation:
        """Close the flight there is and begin one with `seed` (None: the scenario's)."""
        from hil_scripts.launch.inproc import InProcess

        if self._flight is not None or self.run is not None:
            if self._out is not None:
                raise ConfigError(f"out = {str(self._out)!r}: holds one flight; leave it out to fly several")
            self.close()
        scenario, settings, duration = self._what
        with _stoppable() as stop:
            self.plan, built = _ready(scenario, seed, settings, duration, stop)
        rate = float(self.plan.scenario["clock"]["base_rate_hz"])
        self._ticks = max(1, round(self._step_s * rate))
        self._kept = None if self._out is not None else tempfile.TemporaryDirectory(prefix="wakefield-")
        self._folder = _folder(self.plan, self._out or Path(str(self._kept and self._kept.name)) / "run", "stepped")
        self._flight = InProcess(self.plan, self._folder, built)
        self._lost = ""
        self._names = [f.name for f in self.plan.flights]
        self._scale = {f.name: ControlScale(load_airframe(f.config["app"]["aircraft"])) for f in self.plan.flights}
        self._send = {f.sysid: Sender(GROUND_SYSID, STATION) for f in self.plan.flights}
        self._orders: dict[str, list[bytes]] = {name: [] for name in self._names}
        self._wire: dict[str, dict[int, bytes]] = {name: {} for name in self._names}
        return self.observe()

    @property
    def t_s(self) -> float:
        """Time [s] flown up to."""
        return self._open().server.t_us / 1e6

    @property
    def done(self) -> bool:
        """Whether the flight is over: its duration, or an aircraft is lost (`lost` says which)."""
        return bool(self._lost) or self._open().server.done

    @property
    def lost(self) -> str:
        """Which aircraft was lost, when and by what; "" while none is."""
        return self._lost

    def _open(self) -> InProcess:
        if self._flight is None:
            raise FlightError("the flight is closed; `reset` begins another")
        return self._flight

    # --- stepping -----------------------------------------------------------------------------------------------------
    def send(self, aircraft: str, word: str, value: float | None = None) -> None:
        """Command an aircraft at its next tick with a word of `ground send`. Raises ConfigError."""
        plan = next((f for f in self.plan.flights if f.name == aircraft), None)
        if plan is None:
            raise ConfigError(f"aircraft {aircraft!r}: allowed: {', '.join(self._names)}{near(aircraft, self._names)}")
        try:
            what, why = fit(order(word, value, plan.sysid), plan.config["app"]["mission"])
        except CommandError as e:
            raise ConfigError(str(e)) from None
        if why:
            raise ConfigError(why)
        params = {f"param{i + 1}": p for i, p in enumerate(what.params)}
        packet = self._send[plan.sysid].named(
            "COMMAND_LONG", target_system=plan.sysid, target_component=COMP_AUTOPILOT, command=what.command, **params
        )
        self._orders[aircraft].append(packet)

    def step(self, action: Mapping[str, Values] | None = None) -> Observation:
        """Fly one step and say what was on the wire.

        action: by aircraft, actuator commands that the plant gets in the place of those the onboard software sent (aileron,
        elevator, rudder, flap [rad], throttle 0..1, latch 0 or 1); others are its own. Does nothing once the flight is over.
        Raises ConfigError for an unknown aircraft or actuator.
        """
        flight, changes = self._open(), self._changes(action or {})

        def change(i: int, reply: bytes) -> bytes:
            return overridden(reply, changes[i]) if i in changes else reply

        for _ in range(self._ticks):
            if self.done:
                break
            ground = [self._orders[name] for name in self._names]
            self._orders = {name: [] for name in self._names}
            try:
                heard = flight.tick(ground, change if changes else None)
            except AircraftLostError as e:
                self._lost = str(e)
                break
            for name, datagrams in zip(self._names, heard, strict=True):
                for datagram in datagrams:
                    for packet, fault in split(datagram):
                        if not fault:
                            self._wire[name][packet_id(packet)] = packet
        flight.ground.write_ready()
        return self.observe()

    def observe(self) -> Observation:
        """What was last on the wire, without flying on."""
        wire = {name: {NAMES[i]: decode(p) for i, p in seen.items()} for name, seen in self._wire.items()}
        return Observation(self.t_s, wire)

    def _changes(self, action: Mapping[str, Values]) -> dict[int, dict[int, float]]:
        """By the place of the aircraft: channel -> value on the wire."""
        out: dict[int, dict[int, float]] = {}
        for name, values in action.items():
            if name not in self._names:
                raise ConfigError(f"action for {name!r}: allowed: {', '.join(self._names)}{near(name, self._names)}")
            for key, value in values.items():
                if key not in CHANNELS:
                    raise ConfigError(
                        f"action for {name}: {key!r}: allowed: {', '.join(CHANNELS)}{near(key, list(CHANNELS))}"
                    )
                travel = {k: getattr(self._scale[name], k) for k in ControlScale.__slots__}.get(key, 1.0)
                out.setdefault(self._names.index(name), {})[CHANNELS[key]] = float(value) / travel
        return out

    # --- the end ------------------------------------------------------------------------------------------------------
    def close(self) -> Run:
        """End the flight where it stands, write its figures and open its folder. Closed already: that run again."""
        from ground.data import Run

        if self._flight is None:
            assert self.run is not None
            return self.run
        flight, self._flight = self._flight, None
        t_s, over = flight.server.t_us / 1e6, flight.server.done
        flight.finish()
        how = "lost" if self._lost else "completed" if over else "aborted"
        outcome = Outcome(
            how, self._lost or ("" if over else f"closed at t = {t_s:.1f} s"), t_s, 0.0, accounts=flight.accounts()
        )
        with _stoppable() as stop:
            finish.finish(self.plan, self._folder, outcome, False, screen.console(quiet=True), stop, in_process=True)
        self.run = Run(self._folder)
        self.run.keep(self._kept)
        return self.run


@contextmanager
def _stoppable() -> Iterator[StopFlag]:
    """A stop flag nobody sets: Ctrl-C is for the loop outside."""
    yield StopFlag()


def overridden(reply: bytes, channels: Mapping[int, float]) -> bytes:
    """A reply of the onboard software with some channels of its HIL_ACTUATOR_CONTROLS changed; the rest as it is."""
    out = b""
    for packet, _ in split(reply):
        if packet_id(packet) == ACTUATORS:
            fields = decode(packet)
            for channel, value in channels.items():
                fields["controls"][channel] = value
            spec = BY_NAME["HIL_ACTUATOR_CONTROLS"]
            sender = Sender(packet[5], packet[6])
            sender.seq = packet[4]
            packet = sender.pack(spec, *spec.from_dict(fields))
        out += packet
    return out
