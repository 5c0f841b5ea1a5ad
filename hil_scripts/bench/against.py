"""The plant's step today against that of another commit: `python -m hil_scripts.bench.against COMMIT`; whole flights of a
scenario in one process, all logs written: `... COMMIT --flight SCENARIO`; as campaigns fly them, in memory and without logs:
`--flight SCENARIO --unlogged`.

Both trees step their refuelling world in trim, or fly, in a process of their own, in batches by turns, so that other load on the
machine falls on both alike; processor time counts. What is compiled is loaded by both: a process that has compiled for itself
is slower by some per cent, and the tree of a commit has nothing compiled yet.

Today's plant is measured as the scenario has it and with every model on.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[2]
WARM, BATCH, BATCHES = 200, 150, 40  # [ticks], [ticks], number of them
THEN, NOW, EVERYTHING = "commit", "today", "today, every model on"
# argument: the tree, "all" for every model on. A number of ticks asked for on standard input is answered by microseconds of
# processor time per aircraft and tick
SERVE = """
import os, sys, time
root, kind = sys.argv[1:3]
sys.path.insert(0, root)
os.chdir(root)
from hil_scripts.launch import kernel_cache
kernel_cache.use()
import sim_plant
from sim_plant.scenario import load_scenario
from sim_plant.world import World
assert sim_plant.__file__.startswith(root), sim_plant.__file__
sets = {}
if kind == "all":
    from hil_scripts.bench import plant
    sets = plant.EVERY_AIR | plant.GRADED
world = World(load_scenario("refueling", sets), 1)
cmds = [world.trim_cmd(i) for i in range(len(world.members))]
for line in sys.stdin:
    n, t0 = int(line), time.process_time()
    for _ in range(n):
        world.sense()
        world.step(cmds)
    print((time.process_time() - t0) / n / len(cmds) * 1e6, flush=True)
"""


# argument: the tree, the scenario; answered by microseconds a tick of the flight
FLY = """
import os, sys, tempfile, time
from pathlib import Path
root, scenario = sys.argv[1:3]
sys.path.insert(0, root)
os.chdir(root)
from hil_scripts.launch import kernel_cache
kernel_cache.use()
import flightsw
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.runfolder import make_folder, resolve
assert flightsw.__file__.startswith(root), flightsw.__file__
with tempfile.TemporaryDirectory(prefix="wakefield-flown-") as tmp:
    plan = resolve(scenario, 1, [], 1e4)
    flight = InProcess(plan, make_folder(plan, Path(tmp) / "run"))
    for line in sys.stdin:
        n, t0 = int(line), time.process_time()
        for _ in range(n):
            flight.tick()
        print((time.process_time() - t0) / n * 1e6, flush=True)
"""
# as FLY; of a flight in memory. A tree whose flights can leave out what nobody reads does
FLY_UNLOGGED = """
import os, sys, time
root, scenario = sys.argv[1:3]
sys.path.insert(0, root)
os.chdir(root)
from hil_scripts.launch import kernel_cache
kernel_cache.use()
import flightsw
from hil_scripts.studies.integrity import snapshot
assert flightsw.__file__.startswith(root), flightsw.__file__
flight = snapshot.Flying(scenario, 1)
if hasattr(flight, "hear_only"):
    flight.hear_only(snapshot.HEARD)
for line in sys.stdin:
    n, t0 = int(line), time.process_time()
    for _ in range(n):
        flight.tick()
    print((time.process_time() - t0) / n * 1e6, flush=True)
"""
# [ticks], [ticks], number of them: navigation is valid, nothing is compiled or loaded any more
FLIGHT_WARM, FLIGHT_BATCH, FLIGHT_BATCHES = 1000, 100, 25


class Served:
    """A tree's plant or flight in a process of its own."""

    def __init__(self, root: Path, kind: str, code: str = "") -> None:
        """kind: "all" or "own", a scenario with `code` FLY. Raises OSError."""
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", code or SERVE, str(root), kind],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip

    def ask(self, ticks: int) -> float:
        """Microseconds over so many ticks, as `code` has them. Raises RuntimeError with what it said at its end."""
        p = self.process
        assert p.stdin is not None and p.stdout is not None and p.stderr is not None
        try:
            p.stdin.write(f"{ticks}\n")
            p.stdin.flush()
        except BrokenPipeError:
            pass
        if not (line := p.stdout.readline()):
            raise RuntimeError(p.stderr.read()[-2000:])
        return float(line)

    def close(self) -> None:
        """End it."""
        self.process.kill()
        self.process.communicate()


@contextmanager
def tree_of(commit: str) -> Iterator[Path]:
    """A commit's files in a folder of their own. Raises CalledProcessError for none such."""
    with tempfile.TemporaryDirectory(prefix="wakefield-then-") as tmp:
        tar = subprocess.run(["git", "-C", ROOT, "archive", commit], check=True, capture_output=True).stdout
        subprocess.run(["tar", "-x", "-C", tmp], input=tar, check=True)
        yield Path(tmp).resolve()


def compare(then: Path, now: Path, batches: int = BATCHES, ticks: int = BATCH) -> dict[str, list[float]]:
    """[us] of each batch: THEN, NOW and EVERYTHING, in turns. Raises RuntimeError, OSError."""
    kinds = {THEN: (then, "own", ""), NOW: (now, "own", ""), EVERYTHING: (now, "all", "")}
    return _by_turns(kinds, WARM, batches, ticks)


def flights(
    then: Path, now: Path, scenario: str, batches: int = FLIGHT_BATCHES, logged: bool = True
) -> dict[str, list[float]]:
    """[us] a tick of each batch of a scenario's flight: THEN and NOW, in turns. Raises RuntimeError, OSError."""
    code = FLY if logged else FLY_UNLOGGED
    kinds = {THEN: (then, scenario, code), NOW: (now, scenario, code)}
    return _by_turns(kinds, FLIGHT_WARM, batches, FLIGHT_BATCH)


def _by_turns(kinds: dict[str, tuple[Path, str, str]], warm: int, batches: int, ticks: int) -> dict[str, list[float]]:
    for kind in kinds.values():
        first = Served(*kind)
        try:
            first.ask(warm)  # compiles, and keeps it beside the tree
        finally:
            first.close()
    served = {k: Served(*kind) for k, kind in kinds.items()}
    try:
        for s in served.values():
            s.ask(warm)
        taken: dict[str, list[float]] = {k: [] for k in served}
        for _ in range(batches):
            for k, s in served.items():
                taken[k].append(s.ask(ticks))
    finally:
        for s in served.values():
            s.close()
    return taken


def ratios(taken: dict[str, list[float]], name: str) -> tuple[float, float]:
    """Of the least batches, and the median of those flown next to each other: `name` over THEN."""
    pairs = [a / b for a, b in zip(taken[name], taken[THEN], strict=True)]
    return min(taken[name]) / min(taken[THEN]), median(pairs)


def main() -> int:
    """Print the table. Exit 2: no such commit."""
    p = argparse.ArgumentParser(prog="hil_scripts.bench.against", description=__doc__)
    p.add_argument("commit")
    p.add_argument("--flight", metavar="SCENARIO")
    p.add_argument("--unlogged", action="store_true")
    p.add_argument("--batches", type=int)
    a = p.parse_args()
    if a.unlogged and a.flight is None:
        p.error("--unlogged: of which flight? Allowed: with --flight SCENARIO")
    try:
        with tree_of(a.commit) as then:
            if a.flight is None:
                taken = compare(then, ROOT, a.batches or BATCHES)
            else:
                taken = flights(then, ROOT, a.flight, a.batches or FLIGHT_BATCHES, not a.unlogged)
    except subprocess.CalledProcessError as e:
        print(f"git archive {a.commit}: {e.stderr.decode().strip()}", file=sys.stderr)
        return 2
    what = "plant's step, aircraft and tick" if a.flight is None else f"flight of {a.flight}, tick"
    print(f"| {what} | least [us] | over the commit's: least | median of pairs |")
    print("|---|---|---|---|")
    for name, t in taken.items():
        least, pairs = ratios(taken, name)
        print(f"| {name} | {min(t):.1f} | {least:.2f} | {pairs:.2f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
