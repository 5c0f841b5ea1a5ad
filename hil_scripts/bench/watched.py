"""What a browser that watches a flight costs it: the same flight alone and watched, one after the other.

python -m hil_scripts.bench.watched --realtime --duration 1000 --pictures build/watched

The page is a headless Chromium that draws in software. Printed: slips, lateness, ticks the plant flew on the command before,
simulated seconds a second, whether the truth is the same (lockstep), memory of the watching programs.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ground.rrd.chromium import Chromium, missing
from hil_scripts.bench.fuzz import rss_mb

SIZE = (1100, 620)  # of the page [pixel]
ADDRESS = re.compile(r"http://[^\s\"']+")
ADDRESS_S = 30.0  # [s] in which it is told
EVERY_S = 40.0  # [s] between pictures, and looks at the memory
FIGURES = (".slips", ".late_p99_us", ".late_max_us", "sim_s_per_wall_s")
MISSED = "plant.missed_ticks."


@dataclass
class Flight:
    """A flight: its summary, digest of its truth, memory [MB] of who watched by seconds since the start."""

    summary: dict[str, object]
    truth: bytes
    memory: list[tuple[float, dict[str, float]]] = field(default_factory=list)


def watching(run: Path) -> dict[str, int]:
    """Name -> pid of `ground live` on this run, and of the page's server it started."""
    found: dict[str, int] = {}
    parents: dict[int, int] = {}
    for p in Path("/proc").glob("[0-9]*"):
        try:
            words = (p / "cmdline").read_bytes().split(b"\0")
            parents[int(p.name)] = int((p / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        if b"live" in words and str(run).encode() in words:
            found["ground live"] = int(p.name)
    for pid, parent in parents.items():
        if parent == found.get("ground live"):
            found["page's server"] = pid
    return found


def fly(run: Path, args: Sequence[str], page: bool, pictures: Path | None = None) -> Flight:
    """One flight into a new run folder. Raises RuntimeError with the launcher's words if it fails or is not seen."""
    words = run.with_suffix(".txt")
    with words.open("w") as said:
        sil = subprocess.Popen(
            [sys.executable, "-m", "hil_scripts.sil", "run", "refueling", "--no-rrd", "--out", str(run), *args],
            stdout=said, stderr=subprocess.STDOUT,
        )  # fmt: skip
        memory = _watch(run, sil, pictures) if page else []
        sil.wait()
    if sil.returncode not in (0, 4):
        raise RuntimeError(words.read_text())
    return Flight(json.loads((run / "summary.json").read_text()), (run / "truth.tlog").read_bytes(), memory)


def _watch(run: Path, sil: subprocess.Popen[bytes], pictures: Path | None) -> list[tuple[float, dict[str, float]]]:
    began, out = time.monotonic(), []
    while not (run / "truth.tlog").exists():
        if sil.poll() is not None:
            raise RuntimeError(f"no flight: exit {sil.returncode}")
        time.sleep(0.1)
    words = run.with_suffix(".live.txt")  # a file: a pipe nobody empties would stop it
    command = [sys.executable, "-m", "ground", "live", "--web", "--run", str(run), "--rate", "1"]
    with words.open("w") as said:
        live = subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT)
    try:
        with Chromium(SIZE) as browser:
            browser.open(_address(words, live))
            due = EVERY_S
            while True:
                over = sil.poll() is not None
                t = time.monotonic() - began
                if over or t >= due:
                    due += EVERY_S
                    out.append((t, {name: rss_mb(pid) for name, pid in watching(run).items()}))
                    if pictures is not None:
                        browser.picture(pictures / f"{t:05.0f}.png")
                if over:
                    return out
                time.sleep(1.0)
    finally:
        live.terminate()
        live.wait()


def _address(words: Path, live: subprocess.Popen[bytes]) -> str:
    end = time.monotonic() + ADDRESS_S
    while time.monotonic() < end and live.poll() is None:
        if found := ADDRESS.search(words.read_text()):
            return found[0]
        time.sleep(0.2)
    raise RuntimeError(f"ground live told no address: {words.read_text()}")


def report(alone: Flight, seen: Flight, realtime: bool) -> str:
    """Both side by side, and the memory."""
    rows = []
    for key in sorted(alone.summary):
        if key.endswith(FIGURES) or key.startswith(MISSED):
            rows.append(f"{key:40} {alone.summary[key]!s:>12} {seen.summary.get(key)!s:>12}")
    if not realtime:
        rows.append(f"truth.tlog {'the same' if alone.truth == seen.truth else 'DIFFERS'}")
    rows += [f"{t:6.0f} s  {', '.join(f'{n} {mb:.0f} MB' for n, mb in m.items())}" for t, m in seen.memory]
    return "\n".join([f"{'':40} {'alone':>12} {'watched':>12}", *rows])


def main(argv: list[str] | None = None) -> int:
    """The command. Exit 1 if the truth of two lockstep flights differs, 2 without a browser."""
    ap = argparse.ArgumentParser(prog="hil_scripts.bench.watched", description=__doc__)
    ap.add_argument("--realtime", action="store_true")
    ap.add_argument("--duration", type=float, default=1000.0, help="simulated seconds")
    ap.add_argument("--pictures", type=Path, help="folder for pictures of the page")
    a = ap.parse_args(argv)
    if lacks := missing():
        print(lacks, file=sys.stderr)
        return 2
    if a.pictures is not None:
        a.pictures.mkdir(parents=True, exist_ok=True)
    args = ["--duration", str(a.duration), *(["--realtime"] if a.realtime else [])]
    with tempfile.TemporaryDirectory(prefix="wakefield-watched-") as tmp:
        alone = fly(Path(tmp) / "alone", args, page=False)
        seen = fly(Path(tmp) / "seen", args, page=True, pictures=a.pictures)
    print(report(alone, seen, a.realtime))
    return 0 if a.realtime or alone.truth == seen.truth else 1


if __name__ == "__main__":
    sys.exit(main())
