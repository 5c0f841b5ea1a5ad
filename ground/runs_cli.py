"""`ground metrics`, `convert`, `screenshot`, `diff`, `compare`, `index`: what is made of run folders."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from ground.data_cli import draw_log, fail

Run = Annotated[Path, typer.Argument(help="run folder")]


def metrics(
    run: Annotated[Path, typer.Argument(help="run folder, or one .tlog: what is in it")],
    write: Annotated[bool, typer.Option(help="also write RUN/summary.json")] = False,
) -> None:
    """Figures of a run as flat JSON on stdout."""
    from flightsw.files import write_whole
    from ground.columns import LogError, load
    from ground.folder import contents
    from ground.metrics import compute

    try:
        one = run.is_file() and not write
        failed: list[str] = []
        text = json.dumps(contents(load(run)) if one else compute(run, failed), indent=1)
        if write:
            write_whole(run / "summary.json", text + "\n")
    except (LogError, ValueError) as exc:
        fail(exc, 2)
    except OSError as exc:
        fail(exc, 1)
    print(text)
    if failed:
        fail("; ".join(dict.fromkeys(failed)), 1)


def convert(
    run: Annotated[Path, typer.Argument(help="run folder, or a log: .tlog, ULog, DataFlash .bin, CSV")],
) -> None:
    """Write RUN/run.rrd, or LOG.rrd, for the Rerun viewer."""
    from ground.columns import LogError
    from ground.frames import unasked

    try:
        unasked()
        from ground.rrd import convert as to_rrd

        failed: list[str] = []
        path = draw_log(run) if run.is_file() else to_rrd(run, failed=failed)
    except (LogError, ImportError) as exc:
        fail(exc, 2)
    except OSError as exc:
        fail(exc, 1)
    print(path)
    if failed:
        fail("; ".join(dict.fromkeys(failed)), 1)


def screenshot(
    run: Run,
    out: Annotated[Path, typer.Option("--out", help="picture to write (.png)")],
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT in pixels")] = "1600x900",
    at: Annotated[float | None, typer.Option(help="time [s]; default: half-way through what is measured")] = None,
    wide: Annotated[bool, typer.Option(help="the eye far back, as in run.rrd")] = False,
    tab: Annotated[
        str, typer.Option(help="tab of plots: wind, flight, controls, ... (an unknown one lists them)")
    ] = "",
    light: Annotated[bool, typer.Option("--light", help="the light theme (needs Chromium)")] = False,
) -> None:
    """Picture of a run without a display, as `ground convert` lays it out, the eye close up."""
    from tempfile import TemporaryDirectory

    from ground.columns import LogError
    from ground.run import load

    try:
        from ground.folder import require
        from ground.rrd import convert, picture_tab, picture_time
        from ground.rrd.blueprint import NoTabError
        from ground.rrd.shot import ScreenshotError, in_page
        from ground.rrd.shot import screenshot as shoot

        require(run)
        failed: list[str] = []
        flown = load(run)
        time_s = picture_time(flown, failed) if at is None else at
        tab = tab or picture_tab(flown)
        with TemporaryDirectory() as folder:
            until = time_s if light else None
            rrd = convert(run, Path(folder) / "run.rrd", near=not wide, tab=tab, failed=failed, until_s=until)
            print(in_page(rrd, out, size) if light else shoot(rrd, out, size, time_s))
    except LogError as exc:
        fail(exc, 2)
    except (NoTabError, OSError, ScreenshotError) as exc:
        fail(exc, 1)
    if failed:
        fail("; ".join(dict.fromkeys(failed)), 1)


def diff(
    run_a: Run,
    run_b: Annotated[Path, typer.Argument(help="the other run folder")],
    json_: Annotated[bool, typer.Option("--json", help="JSON on stdout")] = False,
) -> None:
    """Compare two runs: logs byte for byte (first difference decoded) and figures; exit 0 if equal, 1 if not."""
    from flightsw.icd.tlog import TlogError
    from ground.columns import LogError
    from ground.compare import as_json, compare, report

    try:
        result = compare(run_a, run_b)
    except (LogError, TlogError, ValueError, OSError) as exc:
        fail(exc, 2)
    print(as_json(result) if json_ else "\n".join(report(result)))
    raise typer.Exit(0 if result.same else 1)


def compare(
    run_a: Run,
    run_b: Annotated[Path, typer.Argument(help="the other run folder")],
    out: Annotated[
        Path | None, typer.Option("--out", help="recording to write (default: RUN_A/compare-<name of RUN_B>.rrd)")
    ] = None,
) -> None:
    """Two runs over each other in one recording for the Rerun viewer, with what they were flown with that differs."""
    from ground.columns import LogError

    try:
        from ground.rrd.pair import overlay

        path = run_a / f"compare-{run_b.resolve().name}.rrd" if out is None else out
        failed: list[str] = []
        print("\n".join(overlay(run_a, run_b, path, failed)))
    except (LogError, ValueError) as exc:
        fail(exc, 2)
    except OSError as exc:
        fail(exc, 1)
    print(path)
    if failed:
        fail("; ".join(dict.fromkeys(failed)), 1)


def index(
    folder: Annotated[Path, typer.Argument(help="folder of runs and campaigns")] = Path("runs"),
    out: Annotated[
        Path | None, typer.Option("--out", help="page to write, beside the runs (default: FOLDER/index.html)")
    ] = None,
) -> None:
    """One page of all runs and campaigns in a folder: figures to sort by, pictures, links. It needs no other file."""
    from flightsw.files import write_whole
    from ground.columns import LogError
    from ground.gallery import page

    try:
        text, runs, campaigns = page(folder)
        path = folder / "index.html" if out is None else out
        write_whole(path, text)
    except LogError as exc:
        fail(exc, 2)
    except OSError as exc:
        fail(exc, 1)
    print(f"{path}: {runs} runs, {campaigns} campaigns")
