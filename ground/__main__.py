"""CLI `ground`: record, convert, metrics, live, send, diff, screenshot. Heavy imports happen inside the commands, so
that recording and the monitor start at once.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from flightsw.cli import SigningKey, Unsigned, Version, make
from ground.data_cli import export, fail, signals
from ground.report.cli import app as report_app
from ground.runs_cli import compare, convert, diff, index, metrics, screenshot

app = make("Ground segment: record, convert, watch, command.", no_args_is_help=True)
app.add_typer(report_app, name="report")
app.command()(signals)
app.command()(export)
for each in (metrics, convert, screenshot, diff, compare, index):
    app.command()(each)
Run = Annotated[Path, typer.Argument(help="run folder")]
PortOffset = Annotated[int, typer.Option("--port-offset", help="added to every port (parallel runs)")]


@app.callback()
def common(version: Version = False) -> None:
    """What all commands have."""
    from flightsw.icd.damage import say_damage

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
        fail(exc, 1)
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
        fail("dialect: one of --out FILE and --install", 2)
    path = stock_folder() / f"{NAME}.py" if out is None else out
    try:
        write_whole(path, complete(path.suffix))
    except DialectError as exc:
        fail(f"dialect: {exc}", 2)
    except OSError as exc:
        fail(exc, 1)
    print(path)


@app.command()
def key(out: Annotated[Path, typer.Option("--out", help="file to write; must not exist")]) -> None:
    """Make a key for signed links (--signing-key of all programs), in a file only its owner may read."""
    from flightsw.icd.signing import write_key

    try:
        write_key(out)
    except OSError as exc:
        fail(f"{out}: cannot be written: {exc.strerror}", 1)
    print(out)


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
        fail("live: one of --rerun and --web", 2)
    if run is not None and not drawn:
        fail("live: --run belongs to --rerun and --web", 2)
    if run is not None and not run.is_dir():
        fail(f"{str(run)!r} is not a run folder: it is no folder", 2)
    listens = port is not None or run is None
    if not listens and (signing_key is not None or unsigned):
        fail("live: --signing-key and --unsigned belong to a --port: a log has no signatures", 2)
    try:
        links = security(signing_key, unsigned, time.time)
        sock = open_socket(host, (port or OPERATOR_PORT) + port_offset, links) if listens else None
    except (RecordError, SigningError) as exc:
        fail(exc, 1)
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
        fail(exc, 1)
    finally:
        if sock is not None:
            sock.close()
    raise typer.Exit(code)


@app.command(context_settings={"ignore_unknown_options": True})  # so that a value may be negative
def send(
    action: Annotated[
        str, typer.Argument(help="a word of the mission flown (`list` shows all), inject; pause, resume, step, pace")
    ],
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
            "--type",
            help="inject: off stuck garbage wrong|bias slow|drift delayed intermittent blocked iced, ok|clear ends it",
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
    from ground.link.pace import WORDS, pace

    try:
        if action == "list":
            print("\n".join(listing()))
            return
        if action == "inject":
            what = inject(value, kind or "", unit, probe, channel, for_s, to)
        elif action in WORDS and kind is None:
            what = pace(action, value, to)
        elif kind is not None:
            raise CommandError(f"--type belongs to inject, not to {action!r}")
        else:
            what = order(action, value, to)
        answer = transmit(what, port_offset, host, security=security(signing_key, False, time.time))
    except (CommandError, OSError, SigningError) as exc:
        fail(exc, 2)
    print(answer.text, file=sys.stderr if answer.exit_code else sys.stdout)
    raise typer.Exit(answer.exit_code)


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
