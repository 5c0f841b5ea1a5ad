"""The same run in one process without sockets: same objects, same bytes in every log."""

from __future__ import annotations

import contextlib
import gc
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from flightsw.app import FlightApp
from flightsw.icd.tlog import TlogWriter
from flightsw.icd.wire import frames
from flightsw.process.accounts import accounts as flight_accounts
from flightsw.process.application import make_app
from flightsw.process.config import load_flight
from flightsw.process.node import Node
from flightsw.process.recorder import LinkRecorder
from ground.link.record import Recorder
from hil_scripts.launch import screen, watching
from hil_scripts.launch.mission import Outcome, deleted
from hil_scripts.launch.preflight import Built
from hil_scripts.launch.procs import StopFlag, Supervisor
from hil_scripts.launch.progress import Board
from hil_scripts.launch.runfolder import RunPlan, make_folder, resolve
from sim_plant.accounts import accounts as plant_accounts
from sim_plant.scenario import load_scenario
from sim_plant.server import PlantServer
from sim_plant.world import AircraftLostError

Change = Callable[[int, bytes], bytes]
LOOK_EVERY = 64  # ticks between looks at the stop flag and the screen


class InProcess:
    """Plant, onboard nodes and ground recorder of a run folder, stepped together; `built`: from the plan, not from the folder.

    Raises ConfigError or OSError naming what cannot be read or written.
    """

    def __init__(self, plan: RunPlan, run: Path, built: Built | None = None) -> None:
        world = built.world if built is not None else None
        self.server = PlantServer(load_scenario(str(run / "scenario.toml")), plan.seed, run, world)
        if built is not None:
            self.nodes = built.nodes
        else:
            self.nodes = [Node(load_flight(run / f"flight_{f.name}.toml")) for f in plan.flights]
        self.links = [LinkRecorder(run / f"link_{f.name}.tlog", f.sysid) for f in plan.flights]
        self.ground = Recorder(TlogWriter(run / "tlm.tlog"))

    def tick(self, ground: Sequence[Sequence[bytes]] = (), change: Change | None = None) -> list[list[bytes]]:
        """One tick of everything; what went over each aircraft's links, in the plant's order. ground: datagrams of a ground
        station to each; change: makes what the plant gets of an aircraft's reply, by its place (the log has what was said)."""
        nodes = self.nodes
        sent = self.server.begin_tick()
        asked = ground or [()] * len(nodes)
        replies = [node.step((d,), ground=g) for node, d, g in zip(nodes, sent, asked, strict=True)]
        self.server.end_tick(replies if change is None else [change(i, r) for i, r in enumerate(replies)])
        wire = []
        for node, link, d, reply in zip(nodes, self.links, sent, replies, strict=True):
            telemetry = node.after()
            link.inbound(node.t_us, node.take_heard())
            link.outbound(node.t_us, reply, telemetry)
            if node.settled:
                link.settled(node.take_settled())
            for t in telemetry:
                self.ground.take_sound(frames(t))
            wire.append([d, reply, *telemetry])
        return wire

    def finish(self) -> None:
        """The end of the run as the plant announces it; then close every log."""
        for node, link, d in zip(self.nodes, self.links, self.server.shutdown(), strict=True):
            node.step((d,))
            link.inbound(node.t_us, node.take_heard())
        self.close()

    def accounts(self) -> dict[str, int | float]:
        """What each program lost, under the keys separate processes have."""
        parts: dict[str, dict[str, Any]] = {"plant": plant_accounts(self.server), "ground": self.ground.accounts()}
        parts |= {f"flightsw.{n.cfg.app.name}": flight_accounts(n) for n in self.nodes}
        return {f"{who}.{k}": v for who, part in parts.items() for k, v in part.items()}

    def close(self) -> None:
        """Close every log, whatever state the run is in. Raises the first OSError after all have been tried."""
        errors = []
        for close in (*(link.close for link in self.links), self.server.close, self.ground.finish):
            try:
                close()
            except OSError as e:
                errors.append(e)
        if errors:
            raise errors[0]


def fly(
    plan: RunPlan,
    run: Path,
    console: Console,
    stop: StopFlag,
    built: Built | None = None,
    watched: watching.Where | None = None,
) -> Outcome:
    """Run the plan in this process, with what is built of it already, `watched` somewhere or not. A log that
    cannot be written is a failed outcome; other errors come out as they are."""
    with Supervisor() as sup, Board(console, plan.duration_s, plan.names) as board:
        flight = InProcess(plan, run, built)
        watching.start(sup, watched, run, console)
        collects = gc.isenabled()
        gc.disable()  # as the separate processes do
        lost = ""
        try:
            try:
                _loop(flight, board, stop, sup)
            except AircraftLostError as e:
                lost = str(e)
                board.advance(flight.server.t_us / 1e6, flight.server.tick)
            flight.finish()
        except OSError as e:
            with contextlib.suppress(OSError):
                flight.close()
            reason = deleted(run) or str(e)
            console.print(f"run failed at t = {board.sim_s:.1f} s: {reason}", style="red", soft_wrap=True)
            return Outcome("failed", reason, board.sim_s, board.speed, accounts=flight.accounts())
        finally:
            if collects:
                gc.enable()
    speed, accounts = board.speed, flight.accounts()
    if stop:
        return Outcome("aborted", stop.text(board.sim_s), board.sim_s, speed, stop.signum, accounts)
    return Outcome("lost" if lost else "completed", lost, board.sim_s, speed, accounts=accounts)


def _loop(flight: InProcess, board: Board, stop: StopFlag, sup: Supervisor) -> None:
    server = flight.server
    while not server.done and not stop:
        flight.tick()
        if server.tick % LOOK_EVERY == 0:
            flight.ground.write_ready()
            board.advance(server.t_us / 1e6, server.tick)
            board.on_ground(flight.ground.status())
            board.draw()
            if sup.children:
                sup.pump(0.0)
    board.advance(server.t_us / 1e6, server.tick)


def fly_a_little(scenario: str, duration_s: float) -> None:
    """Warm up the onboard software of a scenario and fly its first seconds in a folder that is thrown away: every kernel gets
    compiled."""
    with tempfile.TemporaryDirectory(prefix="wakefield-") as tmp, StopFlag() as stop:
        plan = resolve(scenario, None, [], duration_s)
        run = make_folder(plan, Path(tmp) / "run")
        for f in plan.flights:
            app = make_app(load_flight(run / f"flight_{f.name}.toml"))
            assert isinstance(app, FlightApp)
            app.warmup()
        fly(plan, run, screen.console(quiet=True), stop)
