"""One run with its separate processes: ground recorder, one flightsw per aircraft, the plant."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from flightsw.icd.signing import security
from hil_scripts.launch import external, ports, watching
from hil_scripts.launch.pacekeys import HELP, PaceKeys
from hil_scripts.launch.procs import Child, StopFlag, Supervisor, describe_exit
from hil_scripts.launch.progress import Board
from hil_scripts.launch.runfolder import RunPlan

DRAIN_S = 10.0  # [s] for onboard processes to end after the plant has, and for the recorder to write its last packet
COLLATERAL_S = 0.3  # [s] wait for further deaths, to name the cause and not a consequence
AIRCRAFT_LOST = 4  # exit code of sim-plant
OnMessage = Callable[[dict[str, Any]], None]
EVERYWHERE = "0.0.0.0"  # noqa: S104 (telemetry of external aircraft; it took a key or --unsigned to come here)
PEER_LOST = "peer_lost"  # of the accounts while it flies: the plant gave somebody up
PEER_SILENT = 3  # exit code of a program whose peer fell silent: a consequence, not a cause


@dataclass(frozen=True)
class Outcome:
    """How a run ended. `outcome` is completed, lost (an aircraft; the logs are whole up to there), truncated (its logs stop
    before its end), aborted (asked to stop) or failed."""

    outcome: str
    reason: str
    sim_s: float  # [s] simulated
    speed: float  # simulated s per wall s
    signum: int = 0
    accounts: dict[str, int | float] = field(default_factory=dict)  # what each process lost or was late with
    silent: bool = False  # failed because an aircraft that another computer flies was not heard


def fly(
    plan: RunPlan,
    run: Path,
    port_offset: int,
    console: Console,
    stop: StopFlag,
    signing_key: Path | None = None,
    watched: watching.Where | None = None,
    far: external.External = external.NONE,
    unsigned: bool = False,
    speed: float = 0.0,
) -> Outcome:
    """Run the plan to its end, its links signed by the key of a file if there is one, `watched` somewhere or not.

    `far`: aircraft that others fly, over links that `unsigned` leaves open; `speed`: times real time, 0 flat out. Everything
    started here has ended when this returns, also by an exception.
    """
    accounts: dict[str, int | float] = {}
    links = ["--signing-key", str(signing_key)] if signing_key is not None else ["--unsigned"] if unsigned else []
    both = [*_offset(port_offset), *links]
    for line in external.words(run, plan, far, port_offset, links):
        console.print(line, soft_wrap=True, highlight=False)
    keys = PaceKeys(plan.flights[0].sysid, port_offset, speed, security=security(signing_key, False, time.time))
    ended = _fly(plan, run, port_offset, both, console, stop, accounts, watched, far, keys)
    silent = bool(far.lines) and ended.outcome == "failed" and bool(accounts.pop(PEER_LOST, 0))
    return replace(ended, accounts=accounts, silent=silent)


def _fly(
    plan: RunPlan,
    run: Path,
    port_offset: int,
    both: list[str],
    console: Console,
    stop: StopFlag,
    accounts: dict[str, int | float],
    watched: watching.Where | None,
    far: external.External,
    keys: PaceKeys,
) -> Outcome:
    def account(who: str, then: OnMessage) -> OnMessage:
        def on(msg: dict[str, Any]) -> None:
            then(msg)
            if msg.get("outcome") == "peer lost" and far.lines:
                accounts[PEER_LOST] = 1
            accounts.update({f"{who}.{k}": v for k, v in msg.get("accounts", {}).items()})

        return on

    ports.check_free(ports.needed(plan.names, port_offset, watched is not None, far.lines))
    wait_s = float(plan.scenario["clock"]["startup_timeout_s"])
    with keys, Supervisor(run) as sup, Board(console, plan.duration_s, plan.names) as board:
        heard = ["--out", run, *both, *watching.forwarding(watched, port_offset)]
        heard += ["--host", EVERYWHERE] if far.open else []
        ground = sup.start("ground", _argv("ground", "record", *heard), account("ground", board.on_ground))
        flights = []
        for f in (f for f in plan.flights if f.name not in far.lines):
            args = ["--config", run / f"flight_{f.name}.toml", "--sysid", f.sysid, "--run-dir", run]
            args += ["--realtime"] if plan.realtime else []
            argv = _argv("flightsw", *args, *both)
            flights.append(sup.start(f"flightsw-{f.name}", argv, account(f"flightsw.{f.name}", _nothing)))
        if not _await_ground(sup, ground, run, stop, wait_s):
            return _end(sup, run, board, ground, stop, console)
        watcher = watching.start(sup, watched, run, console, both)
        args = ["--scenario", run / "scenario.toml", "--seed", plan.seed, "--run-dir", run]
        args += ["--realtime"] if plan.realtime else []
        argv = _argv("sim_plant", *args, *both, *far.plant_args, *keys.plant_args)
        plant = sup.start("sim-plant", argv, account("plant", board.on_plant))
        console.print("  ".join(f"{c.name} (pid {c.pid})" for c in sup.children), style="dim")
        if keys.on and not plan.realtime:
            console.print(HELP, style="dim")
        while not stop:
            sup.pump(0.05)
            keys.poll()
            board.draw()
            ended = sup.newly_ended()
            if plant in ended and plant.popen.returncode in (0, AIRCRAFT_LOST):
                return _finish(
                    sup, run, board, ground, flights, [c for c in ended if c not in (plant, watcher)], stop, console
                )
            if watcher is not None and watcher in ended:
                why = f"{describe_exit(watcher.popen.returncode)}{_last_words(watcher)}"
                console.print(f"not watched any more: {why}", style="yellow")
            bad = [c for c in ended if c is not watcher and (c.popen.returncode != 0 or c is ground)]
            early = [c for c in ended if c in flights and c.popen.returncode == 0]
            if early and not sup.wait([plant], 3.0, stop):  # normal at the end, when the plant is still closing its log
                bad += early
            if bad or deleted(run):
                return _end(sup, run, board, ground, stop, console, bad)
        return _end(sup, run, board, ground, stop, console)


def _argv(module: str, *args: object) -> list[str]:
    return [sys.executable, "-m", module, *(str(a) for a in args)]


def _offset(n: int) -> list[str]:
    return ["--port-offset", str(n)] if n else []


def _nothing(_msg: dict[str, Any]) -> None:
    return None


def _await_ground(sup: Supervisor, ground: Child, run: Path, stop: StopFlag, wait_s: float) -> bool:
    """Wait until the recorder has its log open; telemetry sent before would be lost. False if it died or stop came."""
    end = time.monotonic() + wait_s
    while not stop and ground.popen.poll() is None and time.monotonic() < end:
        if (run / "tlm.tlog").exists():
            return True
        sup.pump(0.02)
    return False


def _finish(
    sup: Supervisor,
    run: Path,
    board: Board,
    ground: Child,
    flights: list[Child],
    already: list[Child],
    stop: StopFlag,
    console: Console,
) -> Outcome:
    """The plant has come to the end or lost an aircraft: let the others write their last bytes."""
    sup.wait(flights, DRAIN_S, stop)
    ended = already + sup.newly_ended()
    bad = [c for c in ended if c.popen.returncode != 0 or c is ground]
    bad += [c for c in flights if c.popen.poll() is None]
    if bad:
        return _end(sup, run, board, ground, stop, console, bad)
    sup.signal([ground], signal.SIGTERM)
    if not sup.wait([ground], DRAIN_S, stop):
        return _end(sup, run, board, ground, stop, console, [ground])
    return Outcome("lost" if board.lost else "completed", board.lost, board.sim_s, board.speed)


def _end(
    sup: Supervisor,
    run: Path,
    board: Board,
    ground: Child,
    stop: StopFlag,
    console: Console,
    bad: list[Child] | None = None,
) -> Outcome:
    """Stop what runs and say why."""
    if stop and not bad:
        sup.stop(last=[ground], stop=stop)
        return Outcome("aborted", stop.text(board.sim_s), board.sim_s, board.speed, stop.signum)
    sup.settle(COLLATERAL_S)
    dead = [*(bad or []), *sup.newly_ended()]
    alive = [c for c in dead if c.popen.poll() is None]
    gone = [c for c in dead if c.popen.poll() is not None]
    # a signal first (somebody killed it), then an error of its own, then those who only missed a peer
    gone.sort(key=lambda c: (c.popen.returncode >= 0, c.popen.returncode == PEER_SILENT))
    sup.stop(last=[ground], stop=stop)
    if deleted(run):
        return _fail(board, console, deleted(run))
    lines = [f"{c.name} (pid {c.pid}) ended: {describe_exit(c.popen.returncode)}{_last_words(c)}" for c in gone]
    lines += [f"{c.name} (pid {c.pid}) did not end when the run was over" for c in alive]
    if not lines:
        lines = [f"{ground.name} (pid {ground.pid}) did not open its log in time"]
    tail = [f"  {c.name}: {line}" for c in dead if len(c.tail) > 1 for line in c.tail]
    return _fail(board, console, "; ".join(lines), [*lines, *tail])


def _fail(board: Board, console: Console, reason: str, lines: list[str] | None = None) -> Outcome:
    text = f"run failed at t = {board.sim_s:.1f} s"
    console.print("\n".join([text, *lines]) if lines else f"{text}: {reason}", style="red", soft_wrap=True)
    return Outcome("failed", reason, board.sim_s, board.speed)


def deleted(run: Path) -> str:
    """What to say of a run whose folder has been deleted under it; "" if it is there."""
    return "" if run.is_dir() else f"run folder {run} has been deleted"


def _last_words(c: Child) -> str:
    """What it said last, where that is why it ended."""
    return f": {c.tail[-1]}" if c.tail and c.popen.returncode > 0 else ""
