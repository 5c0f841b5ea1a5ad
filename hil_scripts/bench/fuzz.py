"""Rubbish and ill-meant packets at every port of every program while a flight goes on: is it still the same flight?

python -m hil_scripts.bench.fuzz --packets 1000000

Flies a scenario in lockstep, once in peace and once under fire, and says: exit code, whether truth is the same to the byte,
how many datagrams were sent to each port and how many the programs account for, and how their memory grew. What is sent: random
bytes, packets with bits turned over, cut packets, and sound packets of every message with random contents from a system nobody
knows; of those last ones some are heard, and what they say changes nothing.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from flightsw.icd.link import GROUND_PORT, OPERATOR_PORT, plant_command_port, plant_port, telemetry_port
from flightsw.icd.wire import SPECS, Sender
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.runfolder import make_folder, resolve

HOST = "127.0.0.1"
STRANGER = 77  # system id of no ground station and no aircraft
POOL = 4096  # different datagrams
BURST = 64  # sent to one port before the next has its turn
LONGEST = 300  # [byte] of random ones
LATE_S = 600.0  # [s] wall time a run may take
COUNTS = (
    "overrun_datagrams", "unread_packets", "refused_packets", "refused_ground_packets", "refused_orders", "stray_datagrams",
    "refused_order_packets", "unread_orders", "junk_packets",
)  # fmt: skip


def pool(seed: int, size: int = POOL) -> list[bytes]:
    """Datagrams of every kind, in equal shares."""
    rng, send, out = random.Random(seed), Sender(STRANGER, 190), []
    specs = list(SPECS.values())
    for k in range(size):
        spec = specs[k // 4 % len(specs)]
        sound = send.pack(spec, *spec.unpack(rng.randbytes(spec.size)))
        kind = k % 4
        if kind == 0:
            out.append(rng.randbytes(rng.randint(1, LONGEST)))
        elif kind == 1:
            turned = bytearray(sound)
            for _ in range(rng.randint(1, 8)):
                turned[rng.randrange(len(turned))] ^= 1 << rng.randrange(8)
            out.append(bytes(turned))
        elif kind == 2:
            out.append(sound[: rng.randint(1, len(sound) - 1)])
        else:
            out.append(sound)
    return out


@dataclass
class Outcome:
    """What came of a flight under fire. `sent`: datagrams by port; `counted`: what the programs say of them; `grown`: resident
    memory [MB] at the end less that when the fire began, by program."""

    code: int
    same_truth: bool
    sent: dict[str, int] = field(default_factory=dict)
    counted: dict[str, int] = field(default_factory=dict)
    grown: dict[str, float] = field(default_factory=dict)
    text: str = ""
    in_flight: bool = False  # all was sent before the flight was over
    completed: bool = (
        False  # the flight; a bound on lost packets may be violated all the same: the recorder hears strangers too
    )


def _sil(*args: object) -> list[str]:
    return [sys.executable, "-m", "hil_scripts.sil", *map(str, args)]


def _programs(run: Path) -> dict[str, int]:
    """Programs of a run by name -> pid."""
    out = {}
    for p in Path("/proc").iterdir():
        try:
            line = (p / "cmdline").read_bytes().decode(errors="replace") if p.name.isdigit() else ""
        except OSError:
            continue
        args = line.replace("\0", " ").split()  # a forked program has its title in one piece
        if (str(run) in args and "hil_scripts.sil" not in args) or any(
            str(run) in a and a.endswith(".toml") for a in args
        ):
            module = args[args.index("-m") + 1] if "-m" in args else ""
            name = module + ("." + args[args.index("--sysid") + 1] if "--sysid" in args else "")
            out[name] = int(p.name)
    return out


def _udp_ports(pid: int) -> set[int]:
    """UDP ports a process has open."""
    inodes = set()
    for fd in Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(OSError):
            target = str(fd.readlink())
            if target.startswith("socket:["):
                inodes.add(target[8:-1])
    rows = (line.split() for line in Path("/proc/net/udp").read_text().splitlines()[1:])
    return {int(r[1].rpartition(":")[2], 16) for r in rows if r[9] in inodes}


def rss_mb(pid: int) -> float:
    """Resident memory of a process [MB]; 0 if it is gone."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, IndexError):
        return 0.0


def _fire(
    ports: dict[str, int], packets: int, datagrams: list[bytes], alive: subprocess.Popen[str]
) -> Iterator[dict[str, int]]:
    """Send `packets` datagrams to every port, in turn; yields what has been sent so far now and then."""
    sent = dict.fromkeys(ports, 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        k = 0
        while any(n < packets for n in sent.values()) and alive.poll() is None:
            for name, port in ports.items():
                for _ in range(min(BURST, packets - sent[name])):
                    with contextlib.suppress(OSError):  # nobody there (any more), or no room
                        s.sendto(datagrams[k % len(datagrams)], (HOST, port))
                        sent[name] += 1
                    k += 1
            yield sent
    yield sent


def fly(folder: Path, scenario: str, duration: float, packets: int, offset: int, seed: int = 3) -> Outcome:
    """The two flights in `folder`. Raises RuntimeError if one of them does not begin."""
    args = ("run", scenario, "--no-rrd", "--seed", seed, "--duration", duration, "--port-offset", offset)
    plan = resolve(scenario, seed, [], duration)
    peace = InProcess(plan, make_folder(plan, folder / "peace"))
    while not peace.server.done:
        peace.tick()
    peace.finish()
    run, datagrams = folder / "fire", pool(seed)
    watch = [sys.executable, "-m", "ground", "live", "--port-offset", str(offset)]
    live = subprocess.Popen(watch, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    flight = subprocess.Popen(_sil(*args, "--out", run), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    out = Outcome(-1, False)
    try:
        while flight.poll() is None and not ((run / "truth.tlog").exists() and (run / "truth.tlog").stat().st_size):
            time.sleep(0.05)
        if flight.poll() is not None:
            raise RuntimeError(flight.communicate()[0])
        pids = _programs(run) | {"live": live.pid}
        before = {name: rss_mb(pid) for name, pid in pids.items()}
        sysids = json.loads((run / "meta.json").read_text())["aircraft"]
        ports = {"record": GROUND_PORT + offset, "live": OPERATOR_PORT + offset, "orders": plant_command_port(offset)}
        for name, sysid in sysids.items():
            ports |= {f"{name}.plant": plant_port(sysid, offset), f"{name}.telemetry": telemetry_port(sysid, offset)}
        own = _udp_ports(pids["sim_plant"]) - set(ports.values())
        ports |= {f"plant{k or ''}": port for k, port in enumerate(sorted(own))}
        for out.sent in _fire(ports, packets, datagrams, flight):
            now = {name: rss_mb(pid) for name, pid in pids.items()}
            out.grown = {n: round(max(now[n] - before[n], out.grown.get(n, 0.0)), 1) for n in now}
        out.in_flight = flight.poll() is None
        out.text, _ = flight.communicate(timeout=LATE_S)
        out.code = flight.returncode
    finally:
        for p in (flight, live):
            p.kill() if p.poll() is None and p is flight else p.terminate()
            p.wait()
    out.same_truth = (run / "truth.tlog").read_bytes() == (folder / "peace" / "truth.tlog").read_bytes()
    if live.stderr is not None:
        out.text += live.stderr.read()
    summary = json.loads((run / "summary.json").read_text())
    out.completed = summary["run.outcome"] == "completed"
    out.counted = {k: int(v) for k, v in summary.items() if k.endswith(COUNTS) and v}
    return out


def main(argv: list[str] | None = None) -> int:
    """The command. Exit 1 if the flight was not the same."""
    ap = argparse.ArgumentParser(prog="hil_scripts.bench.fuzz", description=__doc__)
    ap.add_argument("--packets", type=int, default=1_000_000, help="to each port")
    ap.add_argument("--scenario", default="refueling")
    ap.add_argument("--duration", type=float, default=600.0, help="simulated seconds")
    ap.add_argument("--port-offset", type=int, default=2000)
    a = ap.parse_args(argv)
    with tempfile.TemporaryDirectory(prefix="wakefield-fuzz-") as tmp:
        began = time.monotonic()
        out = fly(Path(tmp), a.scenario, a.duration, a.packets, a.port_offset)
        print(f"exit {out.code}, truth {'the same' if out.same_truth else 'DIFFERS'}, {time.monotonic() - began:.0f} s")
        print("all sent in flight" if out.in_flight else "the flight ended before all was sent")
        for title, table in (("sent", out.sent), ("counted", out.counted), ("grown [MB]", out.grown)):
            print(title, json.dumps(table, indent=1))
        print(f"sent {sum(out.sent.values())}, counted {sum(out.counted.values())}")
        if not out.completed or "Traceback" in out.text:
            print(out.text)
    return 0 if out.completed and out.same_truth and "Traceback" not in out.text else 1


if __name__ == "__main__":
    sys.exit(main())
