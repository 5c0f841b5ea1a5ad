"""CLI `ground`: record, convert, metrics, live, send, diff, screenshot. Heavy imports happen inside the commands, so
that recording and the monitor start at once.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from flightsw.cli import SigningKey, Unsigned, Version, make
from ground.data_cli import draw_log, export, signals
from ground.report.cli import app as report_app

app = make("Ground segment: record, convert, watch, command.", no_args_is_help=True)
app.add_typer(report_app, name="report")
app.command()(signals)
app.command()(export)
Run = Annotated[Path, typer.Argument(help="run folder")]
PortOffset = Annotated[int, typer.Option("--port-offset", help="added to every port (parallel runs)")]


def _fail(message: object, code: int = 1) -> NoReturn:
    """One line on stderr, non-zero exit."""
    print(f"ground: {message}", file=sys.stderr)
    raise typer.Exit(code)


@app.callback()
def common(version: Version = False) -> None:
    """What all commands have."""
    from flightsw.icd.tlog import say_damage

    say_damage("ground")


@app.command()
def record(
    out: Annotated[Path, typer.Option("--out", help="folder for tlm.tlog")],
    port: Annotated[int, typer.Option(help="UDP port")] = 14550,
    port_offset: PortOffset = 0,
    host: Annotated[str, typer.Option(help="address to listen on")] = "127.0.0.1",
    forward: Annotated[list[str] | None, typer.Option(help="also send every datagram to host:port")] = None,
    signing_key: SigningKey = None,
    unsigned: Unsigned = False,
) -> None:
    """Record telemetry of all aircraft into OUT/tlm.tlog until SIGTERM or Ctrl-C; status as JSON lines on stdout."""
    from flightsw.icd.signing import SigningError, security
    from ground.link.record import RecordError, run

    try:
        recorder = run(out, port + port_offset, host, forward, security=security(signing_key, unsigned, time.time))
    except (RecordError, SigningError) as exc:
        _fail(exc)
    lost = sum(recorder.gaps.dropped.values())
    print(f"ground: {recorder.packets} packets to {out / 'tlm.tlog'}, {lost} lost", file=sys.stderr)


@app.command()
def dialect(
    out: Annotated[Path | None, typer.Option("--out", help="wakefield.py, .xml, or .lua for Wireshark")] = None,
    install: Annotated[
        bool, typer.Option("--install", help="into this environment's pymavlink, as `wakefield`")
    ] = False,
) -> None:
    """Write the complete dialect (common and ours) for mavutil, mavlogdump, MAVProxy and other people's tools."""
    from flightsw.files import write_whole
    from ground.dialect import NAME, DialectError, complete, stock_folder

    if (out is None) is not install:
        _fail("dialect: one of --out FILE and --install", 2)
    path = stock_folder() / f"{NAME}.py" if out is None else out
    try:
        write_whole(path, complete(path.suffix))
    except DialectError as exc:
        _fail(f"dialect: {exc}", 2)
    except OSError as exc:
        _fail(exc)
    print(path)


@app.command()
def key(out: Annotated[Path, typer.Option("--out", help="file to write; must not exist")]) -> None:
    """Make a key for signed links (--signing-key of all programs), in a file only its owner may read."""
    from flightsw.icd.signing import write_key

    try:
        write_key(out)
    except OSError as exc:
        _fail(f"{out}: cannot be written: {exc.strerror}")
    print(out)


@app.command()
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
        _fail(exc, 2)
    except OSError as exc:
        _fail(exc)
    print(text)
    if failed:
        _fail("; ".join(dict.fromkeys(failed)))


@app.command()
def convert(
    run: Annotated[Path, typer.Argument(help="run folder, or a log: .tlog, ULog, DataFlash .bin, CSV")],
) -> None:
    """Write RUN/run.rrd, or LOG.rrd, for the Rerun viewer."""
    from ground.columns import LogError

    try:
        from ground.rrd import convert as to_rrd

        failed: list[str] = []
        path = draw_log(run) if run.is_file() else to_rrd(run, failed=failed)
    except (LogError, ImportError) as exc:
        _fail(exc, 2)
    except OSError as exc:
        _fail(exc)
    print(path)
    if failed:
        _fail("; ".join(dict.fromkeys(failed)))


@app.command()
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
        _fail(exc, 2)
    except (NoTabError, OSError, ScreenshotError) as exc:
        _fail(exc)
    if failed:
        _fail("; ".join(dict.fromkeys(failed)))


@app.command()
def live(
    port: Annotated[
        int | None, typer.Option(help="UDP port (default: 14551; with --run only if it is given)", show_default=False)
    ] = None,
    port_offset: PortOffset = 0,
    host: Annotated[str, typer.Option(help="address to listen on")] = "127.0.0.1",
    for_s: Annotated[float | None, typer.Option("--for", help="stop after this many seconds")] = None,
    rerun: Annotated[
        bool, typer.Option("--rerun", help="in Rerun's native viewer, one that is open or a new one")
    ] = False,
    web: Annotated[
        bool, typer.Option("--web", help="in a browser, at an address on this machine that is printed")
    ] = False,
    run: Annotated[
        Path | None,
        typer.Option("--run", help="run folder in the making: truth, sensors, failures; without --port telemetry too"),
    ] = None,
    web_port: Annotated[int, typer.Option(help="of the page; if taken, a free one")] = 9090,
    viewer_port: Annotated[int, typer.Option(help="of the native viewer, or of the page's data")] = 9876,
    rate: Annotated[
        float, typer.Option(help="pictures a second; less for a browser that draws in software", min=0.2, max=20.0)
    ] = 10.0,
    memory: Annotated[str, typer.Option(help="what the viewer, or the page's server, keeps at most")] = "512MB",
    signing_key: SigningKey = None,
    unsigned: Unsigned = False,
) -> None:
    """Watch all aircraft in the terminal (one line a second if the output is not a terminal), or drawn as they fly."""
    from flightsw.icd.link import OPERATOR_PORT
    from flightsw.icd.signing import STATION, SigningError, security
    from ground.link.live import watch
    from ground.link.record import RecordError, open_socket

    drawn = rerun or web
    if rerun and web:
        _fail("live: one of --rerun and --web", 2)
    if run is not None and not drawn:
        _fail("live: --run belongs to --rerun and --web", 2)
    if run is not None and not run.is_dir():
        _fail(f"{str(run)!r} is not a run folder: it is no folder", 2)
    listens = port is not None or run is None
    if not listens and (signing_key is not None or unsigned):
        _fail("live: --signing-key and --unsigned belong to a --port: a log has no signatures", 2)
    try:
        links = security(signing_key, unsigned, time.time)
        sock = open_socket(host, (port or OPERATOR_PORT) + port_offset, links) if listens else None
    except (RecordError, SigningError) as exc:
        _fail(exc)
    if not drawn:
        assert sock is not None
        with sock:
            raise typer.Exit(watch(sock, for_s, links.link(STATION)))
    from ground.rrd import viewer as v
    from ground.rrd import watch as drawing
    from ground.rrd.shot import ScreenshotError

    try:
        shown = v.in_browser(web_port, viewer_port, memory) if web else v.native(viewer_port, memory)
        if shown.page:
            shown.begin()  # the address is said when there is something to see at it
            words = f"watch at {shown.page}" if sys.stdout.isatty() else json.dumps({"page": shown.page})
            print(words, flush=True)
        code = drawing.watch(shown, run, sock, rate, for_s, links.link(STATION))
    except (v.ViewerError, ScreenshotError) as exc:
        _fail(exc)
    finally:
        if sock is not None:
            sock.close()
    raise typer.Exit(code)


@app.command(context_settings={"ignore_unknown_options": True})  # so that a value may be negative
def send(
    action: Annotated[str, typer.Argument(help="a word of the mission flown (`list` shows all), or inject")],
    value: Annotated[
        float | None,
        typer.Argument(help="the number it takes: a speed [m/s], the number of a law; inject: see --type, SI"),
    ] = None,
    to: Annotated[
        int | None, typer.Option("--to", help="sysid; default: the mission's usual one", min=1, max=250)
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--type", help="inject: off stuck garbage wrong|bias slow|drift delayed intermittent, ok|clear ends it"
        ),
    ] = None,
    unit: Annotated[str, typer.Option(help="inject: what fails")] = "airspeed",
    probe: Annotated[
        str, typer.Option("--probe", "--instance", help="inject: nose left right all, or 1 2 3 0")
    ] = "all",
    channel: Annotated[str, typer.Option(help="inject: V alpha beta all")] = "all",
    for_s: Annotated[float, typer.Option("--for", help="inject: seconds; 0 = until cleared")] = 0.0,
    port_offset: PortOffset = 0,
    host: Annotated[str, typer.Option(help="where the aircraft runs")] = "127.0.0.1",
    signing_key: SigningKey = None,
) -> None:
    """Command an aircraft, or make one of its air-data probes fail (inject, to the plant; values in m/s, rad, s: message
    ICD, FAILURE_TYPE); exit 0 accepted, 1 refused, 2 unanswered (also for a wrong argument)."""
    from flightsw.icd.signing import SigningError, security
    from ground.link.command import CommandError, listing, order
    from ground.link.command import send as transmit
    from ground.link.inject import inject

    try:
        if action == "list":
            print("\n".join(listing()))
            return
        if action == "inject":
            what = inject(value, kind or "", unit, probe, channel, for_s, to)
        elif kind is not None:
            raise CommandError(f"--type belongs to inject, not to {action!r}")
        else:
            what = order(action, value, to)
        answer = transmit(what, port_offset, host, security=security(signing_key, False, time.time))
    except (CommandError, OSError, SigningError) as exc:
        _fail(exc, 2)
    print(answer.text, file=sys.stderr if answer.exit_code else sys.stdout)
    raise typer.Exit(answer.exit_code)


@app.command()
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
        _fail(exc, 2)
    print(as_json(result) if json_ else "\n".join(report(result)))
    raise typer.Exit(0 if result.same else 1)


@app.command()
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
        _fail(exc, 2)
    except OSError as exc:
        _fail(exc)
    print(path)
    if failed:
        _fail("; ".join(dict.fromkeys(failed)))


@app.command()
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
        _fail(exc, 2)
    except OSError as exc:
        _fail(exc)
    print(f"{path}: {runs} runs, {campaigns} campaigns")


def main() -> None:
    """Entry point of the `ground` command."""
    from flightsw.strict import ConfigError

    try:
        app()
    except ConfigError as exc:  # of somebody's view or report
        print(f"ground: {exc}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
