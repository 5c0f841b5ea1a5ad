"""`sil`: fly, replay and measure the whole system on one machine."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from flightsw.cli import SigningKey, Version, make
from hil_scripts.campaign.cli import campaign
from hil_scripts.launch import kernel_cache, screen

app = make("Software in the loop: plant, onboard software and ground on this machine.", no_args_is_help=True)

EXIT_CONFIG = 2

Json = Annotated[bool, typer.Option("--json", help="JSON on stdout; words for people go to stderr.")]
RunDir = Annotated[Path, typer.Argument(help="A run folder as left by `sil run`.", metavar="RUN")]


def _fail(text: str) -> typer.Exit:
    screen.fail(text)
    return typer.Exit(EXIT_CONFIG)


def _kernels() -> None:
    """Use this machine's compiled kernels; a folder of them that cannot be trusted is named."""
    try:
        kernel_cache.use()
    except OSError as e:
        raise _fail(str(e)) from None


def _scenarios(incomplete: str) -> list[str]:
    """Scenario names for the shell's completion."""
    from hil_scripts.launch.runfolder import scenario_names

    return [n for n in scenario_names() if n.startswith(incomplete)]


@app.callback()
def common(version: Version = False) -> None:
    """What all commands have."""


@app.command("list")
def list_(
    kinds: Annotated[
        list[str] | None,
        typer.Argument(help="scenarios, missions, aircraft, campaigns (default: all).", metavar="KIND"),
    ] = None,
    json_: Json = False,
) -> None:
    """Scenarios, missions, aircraft and campaigns, with a line about each."""
    _kernels()
    from hil_scripts.launch import listing

    try:
        if json_:
            print(json.dumps(listing.as_dict(kinds or []), indent=1))
        else:
            listing.show(screen.console(), kinds or [])
    except ValueError as e:
        raise _fail(str(e)) from None


@app.command()
def run(
    scenario: Annotated[
        str,
        typer.Argument(help="Name (`sil list scenarios`), or path of a scenario TOML.", autocompletion=_scenarios),
    ],
    seed: Annotated[
        int | None, typer.Option(help="Seed of every random draw (default: the scenario's).", min=0)
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="OWNER.KEY=VALUE",
            help="Override one key, repeatable. OWNER `plant`: a key of the scenario, for example "
            "plant.wind.dryden.sigma_mps=1.0. OWNER an aircraft's name: a key of its onboard parameters, "
            "for example receiver.nav.q_wind=0.4. VALUE is a TOML value; a bare word is a text.",
        ),
    ] = None,
    realtime: Annotated[bool, typer.Option("--realtime", help="Paced by the wall clock instead of lockstep.")] = False,
    in_process: Annotated[
        bool, typer.Option("--in-process", help="All in one process without sockets: same files, same bytes.")
    ] = False,
    out: Annotated[Path | None, typer.Option(help="Run folder (default: runs/<scenario>-<seed>-<timestamp>).")] = None,
    port_offset: Annotated[int, typer.Option(help="Added to every UDP port, for runs side by side.", min=0)] = 0,
    no_rrd: Annotated[bool, typer.Option("--no-rrd", help="Do not write run.rrd.")] = False,
    watch: Annotated[
        bool, typer.Option("--watch", help="Draw it as it flies, in Rerun's viewer; without a display as --watch-web.")
    ] = False,
    watch_web: Annotated[
        bool, typer.Option("--watch-web", help="Draw it as it flies, in a browser at an address that is printed.")
    ] = False,
    duration: Annotated[float | None, typer.Option(help="End after this many simulated seconds.", min=0.1)] = None,
    signing_key: SigningKey = None,
    json_: Json = False,
) -> None:
    """Fly a scenario. Exit 0: completed within its bounds; 1: failed, or an aircraft lost; 2: bad input; 4: bound violated; 130:
    Ctrl-C."""
    from hil_scripts.launch import forked
    from hil_scripts.launch.procs import SINGLE_THREAD, StopFlag

    forked.prepare()
    os.environ.update(SINGLE_THREAD)  # before numpy is imported
    _kernels()
    with StopFlag() as stop:
        try:
            code = _fly(
                scenario,
                seed,
                set_ or [],
                realtime,
                in_process,
                out,
                port_offset,
                not no_rrd,
                duration,
                signing_key,
                _where(watch, watch_web),
                stop,
                json_,
            )
        except (ValueError, OSError) as e:
            raise _fail(str(e)) from None
    raise typer.Exit(code)


def _fly(
    scenario: str,
    seed: int | None,
    sets: list[str],
    realtime: bool,
    in_process: bool,
    out: Path | None,
    port_offset: int,
    rrd: bool,
    duration: float | None,
    signing_key: Path | None,
    watched: Any,
    stop: Any,
    json_: bool,
) -> int:
    from flightsw.icd.signing import security as read_security
    from flightsw.strict import ConfigError
    from hil_scripts.launch import finish, mission, ports, preflight, runfolder, warmup

    if realtime and in_process:
        raise ConfigError("--realtime and --in-process exclude each other: in one process there is no wall clock")
    if in_process and signing_key is not None:
        raise ConfigError("--signing-key and --in-process exclude each other: in one process there are no links")
    read_security(signing_key, False, time.time)
    plan = runfolder.resolve(scenario, seed, sets, duration, realtime)
    if plan.realtime and in_process:
        raise ConfigError(
            "plant.clock.mode = 'realtime' and --in-process exclude each other: in one process there is no wall clock"
        )
    if not in_process:
        ports.check_free(ports.needed(plan.names, port_offset, watched is not None))
    console = screen.console(stderr=json_)
    for text in plan.warnings:
        console.print(f"warning: {text}", style="yellow")
    if not warmup.warm(console, stop):
        return 128 + stop.signum if stop else finish.EXIT_FAILED
    built = preflight.build(plan)
    run_dir = runfolder.make_folder(plan, out)
    runfolder.write_meta(run_dir, plan, mode="in-process" if in_process else scenario_mode(plan.realtime))
    if in_process:
        from hil_scripts.launch import inproc

        outcome = inproc.fly(plan, run_dir, console, stop, built, watched)
    else:
        outcome = mission.fly(plan, run_dir, port_offset, console, stop, signing_key, watched)
    code = finish.finish(plan, run_dir, outcome, rrd, console, stop, in_process)
    if json_:
        print(json.dumps({"run.folder": str(run_dir)} | finish.read_summary(run_dir, console), indent=1))
    return code


def _where(viewer: bool, browser: bool) -> Any:
    """Where a run is drawn as it flies, None: nowhere."""
    from hil_scripts.launch.watching import Where

    if not (viewer or browser):
        return None
    display = sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return Where.VIEWER if viewer and not browser and display else Where.BROWSER


def scenario_mode(realtime: bool) -> str:
    """Name of the clock mode for meta.json."""
    return "realtime" if realtime else "lockstep"


@app.command()
def warmup(force: Annotated[bool, typer.Option("--force", help="Also when nothing has changed.")] = False) -> None:
    """Compile all numerical kernels now instead of at the next run."""
    from hil_scripts.launch import warmup as w
    from hil_scripts.launch.procs import StopFlag

    with StopFlag() as stop:
        if not w.warm(screen.console(), stop, force):
            raise typer.Exit(128 + stop.signum if stop else 1)


@app.command()
def replay(run: RunDir, json_: Json = False) -> None:
    """Re-run the onboard software from its recorded inputs; exit 1 if any output differs."""
    _kernels()
    from flightsw.icd.tlog import say_damage
    from hil_scripts.launch import replay_cmd

    say_damage("sil")
    try:
        reports = replay_cmd.replay_run(run)
    except (ValueError, OSError) as e:
        raise _fail(str(e)) from None
    same = replay_cmd.show(screen.console(stderr=json_), reports)
    if json_:
        print(json.dumps(replay_cmd.as_dict(reports), indent=1))
    raise typer.Exit(0 if same else 1)


@app.command()
def pictures(
    scenarios: Annotated[list[str] | None, typer.Argument(help="Default: all.", autocompletion=_scenarios)] = None,
    out: Annotated[Path, typer.Option(help="Folder for <scenario>.png and <scenario>-light.png.")] = Path("docs/img"),
    dark: Annotated[bool, typer.Option("--dark", help="The dark theme alone: needs no browser.")] = False,
    duration: Annotated[float | None, typer.Option(help="End each after this many simulated seconds.", min=1.0)] = None,
) -> None:
    """Fly scenarios and picture each at the moment that matters, in the viewer's dark and light theme (light: needs Chromium)."""
    kernel_cache.use()
    from hil_scripts.launch import pictures as p
    from hil_scripts.launch import warmup as w
    from hil_scripts.launch.procs import StopFlag
    from hil_scripts.launch.runfolder import scenario_names

    console = screen.console()
    with StopFlag() as stop:
        try:
            if w.warm(console, stop):
                for path in p.make(
                    scenarios or scenario_names(), out, [""] if dark else list(p.THEMES), duration, stop
                ):
                    console.print(str(path), soft_wrap=True)
        except (ValueError, OSError, RuntimeError) as e:
            raise _fail(str(e)) from None
        if stop:
            raise typer.Exit(128 + stop.signum)


@app.command("hash")
def hash_(
    scenarios: Annotated[list[str] | None, typer.Argument(help="Default: all.", autocompletion=_scenarios)] = None,
    full: Annotated[bool, typer.Option("--full", help="The whole flights instead of their first seconds.")] = False,
    seed: Annotated[int, typer.Option(help="Seed of every random draw.", min=0)] = 3,
    out: Annotated[Path | None, typer.Option(help="Keep the table, JSON.")] = None,
    against: Annotated[Path | None, typer.Option(help="A table kept before; exit 1 if a log differs.")] = None,
    json_: Json = False,
) -> None:
    """Digest every log of every scenario, to show what a change of the sources changed in what is flown."""
    _kernels()
    from hil_scripts.launch import hashes as h
    from hil_scripts.launch import warmup as w
    from hil_scripts.launch.procs import StopFlag

    console, err = screen.console(stderr=json_), screen.console(stderr=True)
    with StopFlag() as stop:
        try:
            names, before = h.chosen(scenarios or []), None if against is None else h.read(against)
            if w.warm(err, stop):
                table = h.table(names, None if full else h.SHORT_S, seed, stop, lambda n: err.print(f"flying: {n} ..."))
            if stop:
                raise typer.Exit(128 + stop.signum)
            if out is not None:
                h.write(out, table)
            differ = [] if before is None else h.differences(before, table)
        except (ValueError, OSError, RuntimeError) as e:
            raise _fail(str(e)) from None
    for log, digest in table["logs"].items():
        console.print(f"{digest[:16]}  {log}{'  differs' if log in differ else ''}", soft_wrap=True)
    if before is not None:
        if before.get("machine") != table["machine"]:
            console.print(
                f"note: the table was made on {before.get('machine')}, this is {table['machine']}", soft_wrap=True
            )
        console.print(screen.verdict(not differ, f"all {len(table['logs'])} logs equal", f"{len(differ)} logs differ"))
    if json_:
        print(json.dumps(table | {"differ": differ}, indent=1))
    raise typer.Exit(1 if differ else 0)


@app.command()
def keys(
    scenario: Annotated[str, typer.Argument(help="Name or path of a scenario.", autocompletion=_scenarios)],
    pattern: Annotated[str, typer.Argument(help="Of names, as a shell has it.")] = "*",
    json_: Json = False,
) -> None:
    """Every key that `--set` takes in a scenario, with its value."""
    kernel_cache.use()
    from hil_scripts.launch import listing

    try:
        found = listing.keys(scenario, pattern)
    except (ValueError, OSError) as e:
        raise _fail(str(e)) from None
    if json_:
        print(json.dumps(found, indent=1))
    else:
        for name, value in found.items():
            print(f"{name} = {json.dumps(value)}")


@app.command()
def case(
    file: Annotated[Path, typer.Argument(help="Case file (TOML), or the name of one of ours.", metavar="CASE")],
    out: Annotated[Path | None, typer.Option(help="Table to write, CSV (default: on the screen).")] = None,
    columns: Annotated[str, typer.Option(help="si, or nesc: names and units of NASA/TM-2015-218675.")] = "si",
) -> None:
    """Drop a body over an earth by the plant's equations of motion: a check case, against tables others have published."""
    kernel_cache.use()
    from hil_scripts.launch import case as c

    try:
        c.run(file, out, columns)
    except (ValueError, OSError) as e:
        raise _fail(str(e)) from None


@app.command()
def bench(
    duration: Annotated[float, typer.Option(help="Simulated length of the lockstep runs in seconds.", min=5.0)] = 120.0,
    no_realtime: Annotated[bool, typer.Option("--no-realtime", help="Leave out the minute of real time.")] = False,
    json_: Annotated[bool, typer.Option("--json", help="JSON on stdout instead of tables.")] = False,
) -> None:
    """Measure the speed of everything on this machine and print one table."""
    import os
    import tempfile

    from hil_scripts.launch.procs import SINGLE_THREAD

    os.environ.update(SINGLE_THREAD)  # before numpy is imported
    _kernels()
    from hil_scripts.bench import table as b
    from hil_scripts.launch import warmup as w
    from hil_scripts.launch.procs import StopFlag

    err = screen.console(stderr=True)
    with StopFlag() as stop:
        if not w.warm(err, stop):
            raise typer.Exit(128 + stop.signum if stop else 1)
    with tempfile.TemporaryDirectory(prefix="wakefield-bench-") as tmp:
        try:
            rows, timing = b.measure(
                Path(tmp),
                duration,
                0.0 if no_realtime else b.REALTIME_S,
                lambda text: err.print(f"measuring: {text} ..."),
            )
        except (ValueError, OSError, RuntimeError) as e:
            raise _fail(str(e)) from None
    if json_:
        print(b.as_json(rows, timing))
    else:
        b.show(screen.console(), rows, timing)


app.command()(campaign)


@app.command()
def estimate(
    file: Annotated[
        Path, typer.Argument(help="Flight log: CSV, .tlog, ULog or DataFlash .bin; columns as in docs/real-data.md.")
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for summary.json and wind.png.")] = None,
    twins: Annotated[int, typer.Option(help="Synthetic flights of each kind on the log's path; 0: none.", min=0)] = 20,
) -> None:
    """Estimate the wind along a recorded flight, offline, and compare it with the logged one. Exit 2: bad input."""
    _kernels()
    from hil_scripts.estimate import command

    try:
        command.estimate(file, out or Path("runs") / f"estimate-{file.stem}", twins, screen.console())
    except (ValueError, OSError) as e:
        raise _fail(str(e)) from None


def main() -> None:
    """Entry point of the `sil` command."""
    app()


if __name__ == "__main__":
    main()
