"""`sil`: fly, replay and measure the whole system on one machine."""

from __future__ import annotations

import gc
import json
import os
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from flightsw.cli import SigningKey, Unsigned, Version, make
from hil_scripts.campaign.cli import campaign
from hil_scripts.launch import screen
from hil_scripts.shell import Json, RunDir, fail, kernels, scenario_names
from hil_scripts.tools_cli import air, allan, bench, case, estimate, hash_, identify, keys, pictures

app = make("Software in the loop: plant, onboard software and ground on this machine.", no_args_is_help=True)


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
    kernels()
    from hil_scripts.launch import listing

    try:
        if json_:
            print(json.dumps(listing.as_dict(kinds or []), indent=1))
        else:
            listing.show(screen.console(), kinds or [])
    except ValueError as e:
        raise fail(str(e)) from None


@app.command()
def run(
    scenario: Annotated[
        str,
        typer.Argument(help="Name (`sil list scenarios`), or path of a scenario TOML.", autocompletion=scenario_names),
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
    external: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[=LINE]",
            help="An aircraft whose flightsw runs elsewhere, repeatable. LINE: udp:HOST[:PORT] or tcp:HOST[:PORT], where it "
            "listens, or serial:DEVICE:BAUD here; without: UDP on this machine. What to take there is printed.",
        ),
    ] = None,
    speed: Annotated[
        float,
        typer.Option(help="Lockstep at so many times real time (default: as fast as it goes).", min=0.0, max=1000.0),
    ] = 0.0,
    here: Annotated[
        str, typer.Option(help="Address of this machine to which external aircraft send telemetry (default: found).")
    ] = "",
    unsigned: Unsigned = False,
    signing_key: SigningKey = None,
    json_: Json = False,
) -> None:
    """Fly a scenario. Exit 0: completed within its bounds; 1: failed, or an aircraft lost; 2: bad input; 3: an external aircraft
    not heard; 4: bound violated; 130: Ctrl-C."""
    from hil_scripts.launch import forked
    from hil_scripts.launch.procs import SINGLE_THREAD, StopFlag

    forked.prepare()
    os.environ.update(SINGLE_THREAD)  # before numpy is imported
    kernels()
    gc.disable()  # what is imported and built now stays: looking for what does not took a twentieth of the start
    try:
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
                    (external or [], here, unsigned, speed),
                )
            except (ValueError, OSError) as e:
                raise fail(str(e)) from None
    finally:
        gc.enable()
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
    far: tuple[list[str], str, bool, float],
) -> int:
    from flightsw.icd.signing import security as read_security
    from flightsw.strict import ConfigError
    from hil_scripts.launch import budget, external, finish, mission, ports, preflight, runfolder, warmup

    if realtime and in_process:
        raise ConfigError("--realtime and --in-process exclude each other: in one process there is no wall clock")
    if in_process and signing_key is not None:
        raise ConfigError("--signing-key and --in-process exclude each other: in one process there are no links")
    names, here, unsigned, speed = far
    if in_process and names:
        raise ConfigError("--external and --in-process exclude each other: in one process nobody else flies")
    if speed and (realtime or in_process):
        raise ConfigError(
            "--speed: allowed in lockstep with separate processes: not with --realtime, not with --in-process"
        )
    links = read_security(signing_key, unsigned, time.time)
    plan = runfolder.resolve(scenario, seed, sets, duration, realtime)
    others = external.of_options(names, here, plan, port_offset)
    links.admit(others.here)
    plan = external.handed(plan, others, port_offset)
    if plan.realtime and in_process:
        raise ConfigError(
            "plant.clock.mode = 'realtime' and --in-process exclude each other: in one process there is no wall clock"
        )
    if not in_process:
        ports.check_free(ports.needed(plan.names, port_offset, watched is not None, others.lines))
    console = screen.console(stderr=json_)
    for text in plan.warnings:
        console.print(f"warning: {text}", style="yellow")
    if not warmup.warm(console, stop):
        return 128 + stop.signum if stop else finish.EXIT_FAILED
    for b in budget.budgets(plan, others.lines, signing_key is not None):
        console.print(b.text(), soft_wrap=True, highlight=False)
        if why := b.warning():
            console.print(f"warning: {why}", style="yellow", soft_wrap=True)
    built = preflight.build(plan)
    run_dir = runfolder.make_folder(plan, out)
    external.hand_over(run_dir, others)
    runfolder.write_meta(run_dir, plan, mode="in-process" if in_process else scenario_mode(plan.realtime))
    gc.freeze()
    gc.enable()
    if in_process:
        from hil_scripts.launch import inproc

        outcome = inproc.fly(plan, run_dir, console, stop, built, watched)
    else:
        outcome = mission.fly(plan, run_dir, port_offset, console, stop, signing_key, watched, others, unsigned, speed)
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
    kernels()
    from flightsw.icd.damage import say_damage
    from hil_scripts.launch import replay_cmd

    say_damage("sil")
    try:
        reports = replay_cmd.replay_run(run)
    except (ValueError, OSError) as e:
        raise fail(str(e)) from None
    same = replay_cmd.show(screen.console(stderr=json_), reports)
    if json_:
        print(json.dumps(replay_cmd.as_dict(reports), indent=1))
    raise typer.Exit(0 if same else 1)


for name, each in (
    ("pictures", pictures),
    ("allan", allan),
    ("air", air),
    ("hash", hash_),
    ("keys", keys),
    ("case", case),
    ("bench", bench),
):
    app.command(name)(each)
app.command()(campaign)
app.command()(estimate)
app.command()(identify)


def main() -> None:
    """Entry point of the `sil` command."""
    app()


if __name__ == "__main__":
    main()
