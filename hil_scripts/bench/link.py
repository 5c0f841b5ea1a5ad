"""Bare-socket lockstep: what the operating system alone charges for the datagrams of a run.

Three processes, one master and two peers, exchange per tick the same number of datagrams of the same sizes as a flight,
blocking, without any content or mathematics.
`python -m hil_scripts.bench.link PORT REPLY_BYTES SINK_PORT SINK_BYTES EVERY` is one peer.
"""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from flightsw.icd.tlog import GROUND_OUT, LINK_IN, LINK_OUT, read

HOST = "127.0.0.1"
BASE = 14900  # ports of the ping-pong


@dataclass(frozen=True)
class Sizes:
    """Mean datagram sizes [bytes] of one aircraft's link, and every how many ticks it sends telemetry."""

    down: int  # plant to flightsw
    up: int  # reply
    telemetry: int
    every: int


def measure_sizes(link_log: Path) -> Sizes:
    """Mean sizes over a link_<name>.tlog. Raises TlogError or ValueError if it is unreadable or empty."""
    total: Counter[int] = Counter()
    stamps: dict[int, set[int]] = {}
    for t_us, link, packet in read(link_log):
        total[link] += len(packet)
        stamps.setdefault(link, set()).add(t_us)
    count = {k: len(v) for k, v in stamps.items()}
    if not count.get(LINK_IN) or not count.get(LINK_OUT):
        raise ValueError(f"{link_log}: holds no lockstep traffic")
    n = count[LINK_IN]
    tlm = count.get(GROUND_OUT, 0)
    return Sizes(
        down=round(total[LINK_IN] / n),
        up=round(total[LINK_OUT] / count[LINK_OUT]),
        telemetry=round(total[GROUND_OUT] / tlm) if tlm else 0,
        every=round(n / tlm) if tlm else 0,
    )


def ping_pong(sizes: list[Sizes], ticks: int) -> float:
    """Ticks per wall second of the bare exchange with one peer process per entry of `sizes`."""
    sink = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sink.bind((HOST, 0))  # telemetry lands here unread, as in a recorder that sleeps
    master = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    master.bind((HOST, 0))
    master.settimeout(20.0)
    peers, addr = [], []
    try:
        for i, s in enumerate(sizes):
            args = [BASE + i, s.up, sink.getsockname()[1], s.telemetry, s.every]
            cmd = [sys.executable, "-m", "hil_scripts.bench.link", *(str(a) for a in args)]
            peers.append(subprocess.Popen(cmd, stdout=subprocess.PIPE))
            addr.append((HOST, BASE + i))
        for p in peers:
            assert p.stdout is not None
            p.stdout.readline()  # bound
        down = [bytes(s.down) for s in sizes]
        t0 = time.perf_counter()
        for _ in range(ticks):
            for d, a in zip(down, addr, strict=True):
                master.sendto(d, a)
            for _ in addr:
                master.recvfrom(65535)
        wall = time.perf_counter() - t0
        for a in addr:
            master.sendto(b"", a)
        return ticks / wall
    finally:
        for p in peers:
            try:
                p.wait(timeout=2.0)
            except subprocess.TimeoutExpired:
                p.kill()
                p.wait()
            if p.stdout is not None:
                p.stdout.close()
        master.close()
        sink.close()


def _peer(port: int, reply_bytes: int, sink_port: int, sink_bytes: int, every: int) -> None:
    s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    s.bind((HOST, port))
    s.settimeout(20.0)
    print("bound", flush=True)
    reply, telemetry, n = bytes(reply_bytes), bytes(sink_bytes), 0
    while True:
        data, frm = s.recvfrom(65535)
        if not data:
            return
        s.sendto(reply, frm)
        n += 1
        if every and n % every == 0:
            s.sendto(telemetry, (HOST, sink_port))


if __name__ == "__main__":
    _peer(*(int(a) for a in sys.argv[1:6]))
