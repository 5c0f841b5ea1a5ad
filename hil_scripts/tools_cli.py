"""`sil pictures`, `allan`, `air`, `hash`, `keys`, `case`, `bench`, `estimate`, `identify`: measured and shown beside flying."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from hil_scripts.launch import screen
from hil_scripts.shell import Json, fail, kernels, scenario_names


def pictures(
    scenarios: Annotated[list[str] | None, typer.Argument(help="Default: all.", autocompletion=scenario_names)] = None,
    out: Annotated[Path, typer.Option(help="Folder for <scenario>.png and <scenario>-light.png.")] = Path("docs/img"),
    dark: Annotated[bool, typer.Option("--dark", help="The dark theme alone: needs no browser.")] = False,
    duration: Annotated[float | None, typer.Option(help="End each after this many simulated seconds.", min=1.0)] = None,
) -> None:
    """Fly scenarios and picture each at the moment that matters, in the viewer's dark and light theme (light: needs Chromium)."""
    kernels()
    from hil_scripts.launch import pictures as p
    from hil_scripts.launch import runfolder
    from hil_scripts.launch import warmup as w
    from hil_scripts.launch.procs import StopFlag

    console = screen.console()
    with StopFlag() as stop:
        try:
            if w.warm(console, stop):
                for path in p.make(
                    scenarios or runfolder.scenario_names(), out, [""] if dark else list(p.THEMES), duration, stop
                ):
                    console.print(str(path), soft_wrap=True)
        except (ValueError, OSError, RuntimeError) as e:
            raise fail(str(e)) from None
        if stop:
            raise typer.Exit(128 + stop.signum)


def allan(
    out: Annotated[Path, typer.Option(help="Folder for allan.png and allan-light.png.")] = Path("docs/img"),
    hours: Annotated[float, typer.Option(help="Length of the record of each sensor.", min=0.1, max=24.0)] = 4.0,
) -> None:
    """Allan deviation of every grade's gyro and accelerometer beside its closed form, as a picture in both themes."""
    kernels()
    from hil_scripts.launch.allan import draw

    for path in draw(out, hours):
        print(path)


def air(
    out: Annotated[Path, typer.Option(help="Folder for air-*.png and air-*-light.png.")] = Path("docs/img"),
) -> None:
    """The plant's turbulence, wakes and density beside their closed forms, as pictures in both themes."""
    kernels()
    from hil_scripts.air.pictures import draw

    for path in draw(out):
        print(path)


def hash_(
    scenarios: Annotated[list[str] | None, typer.Argument(help="Default: all.", autocompletion=scenario_names)] = None,
    full: Annotated[bool, typer.Option("--full", help="The whole flights instead of their first seconds.")] = False,
    seed: Annotated[int, typer.Option(help="Seed of every random draw.", min=0)] = 3,
    out: Annotated[Path | None, typer.Option(help="Keep the table, JSON.")] = None,
    against: Annotated[Path | None, typer.Option(help="A table kept before; exit 1 if a log differs.")] = None,
    json_: Json = False,
) -> None:
    """Digest every log of every scenario, to show what a change of the sources changed in what is flown."""
    kernels()
    from hil_scripts.launch import hashes as h
    from hil_scripts.launch import warmup as w
    from hil_scripts.launch.procs import StopFlag

    console, err = screen.console(stderr=json_), screen.console(stderr=True)
    with StopFlag() as stop:
        try:
            names, before = h.chosen(scenarios or []), None if against is None else h.read(against)
            ready = w.warm(err, stop)
            if ready:
                table = h.table(names, None if full else h.SHORT_S, seed, stop, lambda n: err.print(f"flying: {n} ..."))
            if stop:
                raise typer.Exit(128 + stop.signum)
            if not ready:
                raise typer.Exit(1)  # why has been said
            if out is not None:
                h.write(out, table)
            differ = [] if before is None else h.differences(before, table)
        except (ValueError, OSError, RuntimeError) as e:
            raise fail(str(e)) from None
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


def keys(
    scenario: Annotated[str, typer.Argument(help="Name or path of a scenario.", autocompletion=scenario_names)],
    pattern: Annotated[str, typer.Argument(help="Of names, as a shell has it.")] = "*",
    json_: Json = False,
) -> None:
    """Every key that `--set` takes in a scenario, with its value."""
    kernels()
    from hil_scripts.launch import listing

    try:
        found = listing.keys(scenario, pattern)
    except (ValueError, OSError) as e:
        raise fail(str(e)) from None
    if json_:
        print(json.dumps(found, indent=1))
    else:
        for name, value in found.items():
            print(f"{name} = {json.dumps(value)}")


def case(
    file: Annotated[Path, typer.Argument(help="Case file (TOML), or the name of one of ours.", metavar="CASE")],
    out: Annotated[Path | None, typer.Option(help="Table to write, CSV (default: on the screen).")] = None,
    columns: Annotated[str, typer.Option(help="si, or nesc: names and units of NASA/TM-2015-218675.")] = "si",
) -> None:
    """Drop a body over an earth by the plant's equations of motion: a check case, against tables others have published."""
    kernels()
    from hil_scripts.launch import case as c

    try:
        c.run(file, out, columns)
    except (ValueError, OSError) as e:
        raise fail(str(e)) from None


def bench(
    duration: Annotated[float, typer.Option(help="Simulated length of the lockstep runs in seconds.", min=5.0)] = 120.0,
    no_realtime: Annotated[bool, typer.Option("--no-realtime", help="Leave out the minutes of real time.")] = False,
    json_: Annotated[bool, typer.Option("--json", help="JSON on stdout instead of tables.")] = False,
) -> None:
    """Measure the speed of everything on this machine and print one table."""
    import os
    import tempfile

    from hil_scripts.launch.procs import SINGLE_THREAD

    os.environ.update(SINGLE_THREAD)  # before numpy is imported
    kernels()
    from hil_scripts.bench import table as b
    from hil_scripts.launch import warmup as w
    from hil_scripts.launch.procs import StopFlag

    err = screen.console(stderr=True)
    with StopFlag() as stop:
        if not w.warm(err, stop):
            raise typer.Exit(128 + stop.signum if stop else 1)
    with tempfile.TemporaryDirectory(prefix="wakefield-bench-") as tmp:
        try:
            rows, paced = b.measure(
                Path(tmp),
                duration,
                0.0 if no_realtime else b.REALTIME_S,
                lambda text: err.print(f"measuring: {text} ..."),
            )
        except (ValueError, OSError, RuntimeError) as e:
            raise fail(str(e)) from None
    if json_:
        print(b.as_json(rows, paced))
    else:
        b.show(screen.console(), rows, paced)


def estimate(
    file: Annotated[
        Path, typer.Argument(help="Flight log: CSV, .tlog, ULog or DataFlash .bin; columns as in docs/real-data.md.")
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for summary.json and wind.png.")] = None,
    twins: Annotated[int, typer.Option(help="Synthetic flights of each kind on the log's path; 0: none.", min=0)] = 20,
) -> None:
    """Estimate the wind along a recorded flight, offline, and compare it with the logged one. Exit 2: bad input."""
    kernels()
    from hil_scripts.estimate import command

    try:
        command.estimate(file, out or Path("runs") / f"estimate-{file.stem}", twins, screen.console())
    except (ValueError, OSError) as e:
        raise fail(str(e)) from None


def identify(
    source: Annotated[
        str,
        typer.Argument(
            help="A JSBSim aircraft: jsbsim:737, or the path of a model (.xml); or a flight with test inputs: run:FOLDER, "
            "run:FOLDER/AIRCRAFT, or a log with the columns of docs/identify.md (.csv)."
        ),
    ],
    like: Annotated[
        str,
        typer.Option(
            help="Aircraft file whose servos, structure, boom, probes and wake it gets; of a run all but [aero]."
        ),
    ] = "kc135r",
    altitude: Annotated[
        float | None, typer.Option(help="Geopotential height [m] (default: 7010).", min=0.0, max=12000.0)
    ] = None,
    speed: Annotated[
        float | None, typer.Option(help="True airspeed [m/s] (default: 195).", min=20.0, max=300.0)
    ] = None,
    fuel: Annotated[float | None, typer.Option(help="Fuel [kg] (default: as the model is shipped).", min=0.0)] = None,
    begin: Annotated[
        float | None,
        typer.Option("--from", help="Of a flight: from this second (default: that of the test inputs).", min=0.0),
    ] = None,
    end: Annotated[float | None, typer.Option("--to", help="Of a flight: to this second.", min=0.0)] = None,
    out: Annotated[Path | None, typer.Option(help="Folder (default: identified/<name>).")] = None,
) -> None:
    """Fit an aircraft file to a JSBSim aircraft, trimmed at a condition, or to a flight with test inputs. Exit 2: it does not fly
    there, or the flight does not tell."""
    kernels()
    from hil_scripts.identify import command
    from hil_scripts.identify.flight import command as of_flight
    from hil_scripts.identify.flight.logs import is_log

    try:
        if source.startswith(of_flight.PREFIX) or is_log(source):
            for name, value in (("altitude", altitude), ("speed", speed), ("fuel", fuel)):
                if value is not None:
                    raise ValueError(f"--{name} {value:g}: the flight has its own; allowed with jsbsim:NAME")
            if (begin is None) != (end is None):
                raise ValueError("--from and --to: allowed together")
            span = None if begin is None or end is None else (begin, end)
            of_flight.identify(of_flight.AskedOfFlight(source, like, span, out), screen.console())
        else:
            if begin is not None or end is not None:
                raise ValueError("--from, --to: allowed with a flight, run:FOLDER")
            asked = command.Asked(
                source, like, 7010.0 if altitude is None else altitude, 195.0 if speed is None else speed,
                -1.0 if fuel is None else fuel, out,
            )  # fmt: skip
            command.identify(asked, screen.console())
    except (ValueError, OSError) as e:
        raise fail(str(e)) from None
