"""`ground record`: telemetry of all aircraft on one UDP socket into a deterministic `tlm.tlog`.

The loop sleeps, drains the socket, sleeps again: one wake-up for many datagrams, so that recording takes next to
nothing from the simulation on the same cores. The kernel's buffer bridges the sleep. Only header and time of a packet
are read; the phase is peeked from MISSION_STATUS for the status lines.
"""

from __future__ import annotations

import json
import signal
import socket
import sys
import time
from collections.abc import Callable, Sequence
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import TextIO

from flightsw.icd.overrun import overrun
from flightsw.icd.signing import OPEN, REASONS, STATION, Security, Signing
from flightsw.icd.tlog import TlogError, TlogWriter
from ground.link.merge import Merger, SequenceGaps
from ground.link.packets import MISSION_STATUS, packet_time_us, phase_name, phase_of, split

POLL_S = 0.02  # [s] wall time between drains
STATUS_S = 0.5  # [s] wall time between status lines
QUIET_S = 0.25  # [s] silence that ends draining after a stop request
DRAIN_S = 3.0  # [s] longest drain
RCVBUF = 16 << 20  # [bytes] asked for; the kernel may give less
SO_RCVBUFFORCE = 33  # Linux, needs CAP_NET_ADMIN; ignores rmem_max
_SYSID = itemgetter(5)  # of a packet
_STATUS = MISSION_STATUS.to_bytes(3, "little")  # as packets have it


class RecordError(Exception):
    """Recording cannot start or go on; the message names the thing."""


def open_socket(host: str, port: int, security: Security = OPEN) -> socket.socket:
    """Non-blocking UDP socket bound to host:port with the largest receive buffer allowed. Raises RecordError, and SigningError
    for an address that needs a key."""
    security.admit(host)
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for option in (SO_RCVBUFFORCE, socket.SO_RCVBUF):
        try:
            sock.setsockopt(socket.SOL_SOCKET, option, RCVBUF)
            break
        except OSError:
            continue
    try:
        sock.bind((host, port))
    except OSError as exc:
        sock.close()
        raise RecordError(f"cannot listen on UDP {host}:{port}: {exc.strerror} (another ground station open?)") from exc
    sock.setblocking(False)
    return sock


def parse_target(text: str) -> tuple[str, int]:
    """("host", port) from "host:port". Raises RecordError naming the text."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65536:
        raise RecordError(f"forward target {text!r} is not host:port with port 1..65535")
    return host, int(port)


def _words(path: Path, exc: OSError) -> str:
    """What went wrong with the log, naming the file once."""
    return str(exc) if isinstance(exc, TlogError) else f"{path}: cannot be written: {exc.strerror or exc}"


class Recorder:
    """Datagrams in, `tlm.tlog` out. Pure apart from the writer: sockets and signals are in `run`."""

    def __init__(self, writer: TlogWriter, signing: Signing | None = None) -> None:
        self.writer, self.signing = writer, signing
        self.merger = Merger()
        self.gaps = SequenceGaps()
        self.packets = 0
        self.junk: dict[str, int] = {}
        self.phase: dict[int, str] = {}
        self._stamp: dict[int, int] = {}  # sysid -> last time seen, for datagrams that carry none

    def take(self, datagram: bytes) -> None:
        """Account for one datagram. The stamp of all its packets is the time in the first one that has a time. With a key, what
        is not signed by it is refused, and what is goes into the log without its signature."""
        if self.signing is not None:
            datagram = self.signing.check(datagram)
        sound: list[bytes] = []
        for packet, fault in split(datagram):
            if fault:
                self.junk[fault] = self.junk.get(fault, 0) + 1
            else:
                sound.append(packet)
        self.take_sound(sound)

    def take_sound(self, sound: Sequence[bytes]) -> None:
        """`take` of a datagram of packets that are known to be sound, and need no key: of a sender in this process."""
        t_us = None
        for packet in sound:
            t_us = packet_time_us(packet)
            if t_us is not None:
                break
        for sysid, run in groupby(sound, _SYSID):
            packets = tuple(run)
            stamp = self._stamp.get(sysid, 0) if t_us is None else t_us
            if not self.merger.push(stamp, sysid, *packets):
                self.junk["time"] = self.junk.get("time", 0) + len(packets)
                continue
            self._stamp[sysid] = stamp
            self.packets += len(packets)
            see = self.gaps.see
            for packet in packets:
                see(sysid, packet[6], packet[4])
                if packet[7:10] == _STATUS:
                    self.phase[sysid] = phase_name(phase_of(packet))

    def write_ready(self) -> None:
        """Write what has its final place. OSError of a full disk comes out of the writer."""
        for t_us, packet in self.merger.ready():
            self.writer.write(t_us, packet)

    def finish(self) -> None:
        """Write everything held back and close the log."""
        for t_us, packet in self.merger.flush():
            self.writer.write(t_us, packet)
        self.writer.close()

    def accounts(self, overrun: int = 0) -> dict[str, int]:
        """For the summary of a run: packets recorded, lost by their sequence numbers, refused as junk, come too late for their
        place in the log; datagrams dropped at the socket."""
        return {
            "packets": self.packets,
            "lost_packets": sum(self.gaps.dropped.values()),
            "junk_packets": sum(self.junk.values()),
            "late_packets": self.merger.late,
            "overrun_datagrams": overrun,
            "refused_by_signing": 0 if self.signing is None else self.signing.refused.total,
        }

    def status(self) -> dict[str, object]:
        """Counters for a status line; sysids as text because JSON keys are."""
        return {
            "t": max(self.merger.newest_us, 0) * 1e-6,
            "phase": {str(s): p for s, p in sorted(self.phase.items())},
            "packets": self.packets,
            "dropped": {str(s): n for s, n in sorted(self.gaps.dropped.items())},
            "junk": sum(self.junk.values()),
            "late": self.merger.late,
        } | (
            {} if self.signing is None else {"refused": dict(zip(REASONS, self.signing.refused.counts(), strict=True))}
        )


class StopFlag:
    """Set by SIGTERM and SIGINT; the loop looks at it between drains."""

    def __init__(self) -> None:
        self.signum = 0

    def install(self) -> StopFlag:
        """Catch the two signals."""
        for s in (signal.SIGTERM, signal.SIGINT):
            signal.signal(s, self._on)
        return self

    def _on(self, signum: int, _frame: object) -> None:
        self.signum = signum


def _drain(sock: socket.socket, recorder: Recorder, targets: list[tuple[str, int]], out: socket.socket) -> int:
    """Take all waiting datagrams; number taken."""
    count = 0
    while True:
        try:
            datagram = sock.recv(65536)
        except BlockingIOError:
            return count
        except OSError:  # an ICMP error of a peer that went away is not ours
            continue
        recorder.take(datagram)
        for target in targets:
            try:
                out.sendto(datagram, target)
            except OSError:
                continue  # nobody listens there: forwarding is a courtesy
        count += 1


def run(
    out_dir: Path,
    port: int = 14550,
    host: str = "127.0.0.1",
    forward: list[str] | None = None,
    stop: Callable[[], bool] | None = None,
    status_to: TextIO | None = None,
    security: Security = OPEN,
) -> Recorder:
    """Record until `stop()` says so (default: SIGTERM or SIGINT), drain, flush, return the recorder. What it says goes to
    `status_to` (default: standard output as it is now).

    Raises RecordError for a busy port, an unwritable folder, a bad target or a full disk.
    """
    status_to = status_to or sys.stdout
    targets = [parse_target(f) for f in forward or []]
    path = out_dir / "tlm.tlog"
    sock = open_socket(host, port, security)
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.setblocking(False)
    try:
        try:
            out_dir.mkdir(parents=True, exist_ok=True)
            recorder = Recorder(TlogWriter(path), security.link(STATION))
        except OSError as exc:
            raise RecordError(_words(path, exc)) from exc
        flag = None if stop else StopFlag().install()
        stopped = stop or (lambda: bool(flag and flag.signum))
        _say(status_to, {"listening": port, **recorder.status()})
        try:
            _loop(sock, out, recorder, targets, stopped, status_to)
            recorder.finish()
        except OSError as exc:
            raise RecordError(_words(path, exc)) from exc
        accounts = recorder.accounts(overrun(sock))
        _say(status_to, {"done": True, **recorder.status(), "junk_kinds": recorder.junk, "accounts": accounts})
        return recorder
    finally:
        sock.close()
        out.close()


def _loop(
    sock: socket.socket,
    out: socket.socket,
    recorder: Recorder,
    targets: list[tuple[str, int]],
    stopped: Callable[[], bool],
    status_to: TextIO,
) -> None:
    """Sleep, drain, write; status lines; after a stop request, drain until the socket is quiet."""
    next_status = time.monotonic() + STATUS_S
    while not stopped():
        _drain(sock, recorder, targets, out)
        recorder.write_ready()
        if time.monotonic() >= next_status:
            next_status += STATUS_S
            recorder.writer.flush()
            _say(status_to, recorder.status())
        time.sleep(POLL_S)
    end = time.monotonic() + DRAIN_S
    quiet_from = time.monotonic()
    while time.monotonic() < end and time.monotonic() - quiet_from < QUIET_S:
        if _drain(sock, recorder, targets, out):
            quiet_from = time.monotonic()
            recorder.write_ready()
        time.sleep(POLL_S)


def _say(stream: TextIO, record: dict[str, object]) -> None:
    """One JSON line; a reader that went away must not end the recording."""
    try:
        print(json.dumps(record), file=stream, flush=True)
    except (BrokenPipeError, ValueError):
        return
