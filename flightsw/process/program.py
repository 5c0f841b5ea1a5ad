"""One onboard process from its configuration to its exit code: sockets, log and node, and the loop.

Exit codes: 0 run ended by the plant, 1 unexpected error, 2 configuration, port or folder, 3 plant silent, 4 log cannot
be written, 130 / 143 ended by SIGINT / SIGTERM.
"""

from __future__ import annotations

import traceback
from pathlib import Path

from flightsw.cli import report, tell
from flightsw.icd.link import LinkError, UdpLink, telemetry_port
from flightsw.icd.overrun import overrun
from flightsw.icd.signing import OPEN, TELEMETRY, Security, security
from flightsw.icd.stream_link import StreamLink
from flightsw.icd.tlog import TlogError
from flightsw.preload import preload
from flightsw.priority import realtime_priority, take_turns
from flightsw.process.accounts import accounts
from flightsw.process.clock import RealtimeClock, monotonic_us, unix_s
from flightsw.process.config import FlightConfig, load_flight
from flightsw.process.executive import no_time
from flightsw.process.loop import Process, Stop
from flightsw.process.node import Node
from flightsw.process.plantlink import link_overrides, open_plant
from flightsw.process.recorder import LinkRecorder
from flightsw.strict import ConfigError

EXIT_UNEXPECTED, EXIT_CONFIG, EXIT_LOG = 1, 2, 4


def parse_sets(items: list[str]) -> dict[str, str]:
    """Overrides "key=value" as a dict. Raises ConfigError."""
    out = {}
    for item in items:
        key, sep, value = item.partition("=")
        if not sep or not key.strip():
            raise ConfigError(f"--set {item!r}: expected key=value")
        out[key.strip()] = value.strip()
    return out


def open_process(
    cfg: FlightConfig, run_dir: Path, realtime: bool, port_offset: int, stop: Stop, security: Security = OPEN
) -> Process:
    """Ports, log and node of a configuration, warmed up. Raises LinkError, TlogError, ConfigError, ValueError."""
    name, sysid = cfg.app.name, cfg.app.sysid

    def say(text: str) -> None:
        tell(f"flightsw {name} (sysid {sysid}): {text}")

    plant = open_plant(cfg, realtime, port_offset, security)
    try:
        telemetry = UdpLink(
            cfg.link.telemetry_port or telemetry_port(sysid, port_offset),
            f"telemetry of {name}, sysid {sysid}",
            cfg.link.host,
            security=security,
            ident=TELEMETRY,
        )
    except LinkError:
        plant.close()
        raise
    try:
        log = LinkRecorder(run_dir / f"link_{name}.tlog", sysid)
        node = Node(cfg, realtime=realtime, now_us=monotonic_us if realtime else no_time)
        warmup = getattr(node.app, "warmup", None)
        if warmup is not None:
            warmup()
    except BaseException:
        plant.close()
        telemetry.close()
        raise
    return Process(cfg, node, plant, telemetry, log, stop, say, port_offset)


def fly(
    config: Path,
    run_dir: Path,
    sysid: int | None,
    sets: list[str],
    realtime: bool,
    port_offset: int,
    signing_key: Path | None = None,
    unsigned: bool = False,
    link: str = "",
) -> int:
    """Run one flight process to its end. Returns the exit code; every expected failure is one line on stderr."""
    stop = Stop()
    try:
        overrides: dict[str, object] = (link_overrides(link) if link else {}) | dict(parse_sets(sets))
        if sysid is not None:
            overrides["app.sysid"] = sysid
        cfg = load_flight(config, overrides)
        process = open_process(cfg, run_dir, realtime, port_offset, stop, security(signing_key, unsigned, unix_s))
    except (
        ConfigError,
        LinkError,
        TlogError,
        ValueError,
        ArithmeticError,
        RuntimeError,
    ) as e:  # no trim, no control law
        tell(f"flightsw: {e}")
        return EXIT_CONFIG
    if stop.signum:
        process.close()
        process.say("stopped by signal during start-up")
        return stop.exit_code
    code = EXIT_UNEXPECTED
    try:
        code = _loop(process, realtime)
    except TlogError as e:
        process.say(str(e))
        code = EXIT_LOG
    except Exception as e:
        traceback.print_exc()
        process.say(f"stopped at t = {process.node.t_us / 1e6:.2f} s by {type(e).__name__}: {e}")
    finally:
        lost = overrun(process.plant) + overrun(process.ground.link.sock)
        try:
            process.close()
        except TlogError as e:
            if code != EXIT_LOG:
                process.say(str(e))
                code = EXIT_LOG
    if stop.signum and code == stop.exit_code:
        process.say(f"stopped by signal {stop.signum} at t = {max(process.node.t_us, 0) / 1e6:.2f} s; log closed")
    if isinstance(process.plant, StreamLink):
        process.say(
            f"{process.plant.noise} bytes of noise, {process.plant.torn} torn datagrams on {process.plant.where}"
        )
    report({"done": True, "accounts": accounts(process.node, lost)})
    return code


def _loop(process: Process, realtime: bool) -> int:
    loaded = preload("flightsw") if realtime else 0
    process.freeze()
    if process.cfg.link.line:
        process.say(f"ready; waits for the plant on {process.plant.where}")
    if not realtime:
        take_turns()
        return process.lockstep()
    process.say(
        f"real time at {process.cfg.app.base_rate_hz} Hz: {realtime_priority()}, {loaded} kernels loaded beforehand"
    )
    code = process.realtime(RealtimeClock(process.cfg.period_us))
    ex = process.node.exec
    process.say(
        f"{ex.ticks} ticks, {ex.slips} slips, late p50 {ex.late.quantile(0.5):.0f} p99 {ex.late.quantile(0.99):.0f} "
        f"p99.9 {ex.late_p999_us:.0f} max {ex.late.max:.0f} us, exec mean {ex.cost.mean:.0f} max {ex.cost.max:.0f} us"
    )
    return code
