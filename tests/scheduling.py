"""How tests are dealt out to parallel workers: what shares a flight goes to one worker, what takes long goes first.

Marks of the distribution plugin group nothing under the test framework of the lock file (it gave names to tests another way),
so a file whose fixtures live for a module is one unit here, and every other test is one by itself.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from xdist.scheduler import LoadScopeScheduling

ROOT = Path(__file__).resolve().parent.parent
SHARED = 'scope="module"'
# units that take more than a few seconds, longest first: none of them may come last
HEAVY: tuple[str, ...] = ()


@cache
def shares(path: str) -> bool:
    """Whether the tests of a file share fixtures."""
    try:
        return SHARED in (ROOT / path).read_text(encoding="utf-8")
    except OSError:
        return False


def unit(nodeid: str) -> str:
    """Name of the unit a test belongs to: its file, or itself."""
    path = nodeid.partition("::")[0]
    return path if shares(path) else nodeid


def rank(name: str) -> int:
    """Place of a unit in HEAVY; behind all of them if it is none."""
    return next((i for i, head in enumerate(HEAVY) if name.startswith(head)), len(HEAVY))


class Units(LoadScopeScheduling):
    """Work units by `unit`, in the order of collection."""

    def _split_scope(self, nodeid: str) -> str:
        return unit(nodeid)
