"""`ground diff`: two run folders against each other: logs byte for byte, figures side by side."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flightsw.icd.tlog import read
from ground.folder import require
from ground.link.packets import NAMES, decode, packet_id
from ground.settings import Difference, differences


@dataclass
class LogDiff:
    """Verdict on one log: `same`, else what is different first."""

    name: str
    same: bool
    sha: tuple[str, str]
    first: str = ""


@dataclass
class Diff:
    """Everything compared."""

    logs: list[LogDiff] = field(default_factory=list)
    figures: list[tuple[str, Any, Any]] = field(default_factory=list)  # (key, a, b) that differ
    settings: list[Difference] = field(default_factory=list)  # flown with; says why, decides nothing

    @property
    def same(self) -> bool:
        """True if every log is byte-identical and every figure equal."""
        return all(log.same for log in self.logs) and not self.figures


def _sha(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as f:
        while block := f.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def _describe(record: tuple[int, int, bytes] | None) -> str:
    """A log record in words."""
    if record is None:
        return "(log ends)"
    t_us, link, packet = record
    name = NAMES.get(packet_id(packet), f"message {packet_id(packet)}")
    return f"t={t_us * 1e-6:.3f} s link {link} sysid {packet[5]} seq {packet[4]} {name}"


def _fields(a: bytes, b: bytes) -> str:
    """Fields that differ between two packets of one message."""
    if packet_id(a) != packet_id(b) or packet_id(a) not in NAMES:
        return ""
    x, y = decode(a), decode(b)
    return "; ".join(f"{k}: {x[k]} | {y[k]}" for k in x if x[k] != y[k])


def first_difference(a: Path, b: Path) -> str:
    """The first record in which two logs differ, decoded; "" if all sound records are equal (the damage differs)."""
    left, right = read(a), read(b)
    number = 0
    while True:
        x, y = next(left, None), next(right, None)
        if x is None and y is None:
            return ""
        if x != y:
            text = f"record {number}: {_describe(x)} | {_describe(y)}"
            return text + (f"; {_fields(x[2], y[2])}" if x and y else "")
        number += 1


def _figures(run: Path) -> dict[str, Any]:
    """summary.json of a run, or the figures computed from its logs."""
    path = run / "summary.json"
    if path.exists():
        return dict(json.loads(path.read_text()))
    from ground.metrics import compute

    return compute(run)


def compare(a: Path, b: Path) -> Diff:
    """Compare two run folders. Raises LogError if one is no run folder, TlogError if a log is none."""
    out = Diff()
    for run in (a, b):
        require(run, ())
    names = sorted({p.name for run in (a, b) for p in run.glob("*.tlog")})
    for name in names:
        x, y = a / name, b / name
        if not (x.exists() and y.exists()):
            missing = a if not x.exists() else b
            out.logs.append(LogDiff(name, False, ("", ""), f"missing in {missing}"))
            continue
        sha = (_sha(x), _sha(y))
        same = sha[0] == sha[1]
        out.logs.append(
            LogDiff(
                name, same, sha, "" if same else first_difference(x, y) or "only bytes that belong to no sound packet"
            )
        )
    out.settings = differences(a, b)
    left, right = _figures(a), _figures(b)
    for key in sorted(left.keys() | right.keys()):
        if key.startswith("run.sim_s_per_wall_s"):
            continue  # wall time: never equal
        if not _equal(left.get(key), right.get(key)):
            out.figures.append((key, left.get(key), right.get(key)))
    return out


def _equal(x: Any, y: Any) -> bool:
    """Equality in which NaN equals NaN."""
    if isinstance(x, float) and isinstance(y, float) and math.isnan(x) and math.isnan(y):
        return True
    return bool(x == y)


def as_json(diff: Diff) -> str:
    """The comparison as JSON: `same`, logs, and the figures that differ."""
    logs = [{"log": x.name, "same": x.same, "sha256": x.sha, "first": x.first} for x in diff.logs]
    figures = {key: [a, b] for key, a, b in diff.figures}
    return json.dumps({"same": diff.same, "logs": logs, "figures": figures}, indent=1)


def report(diff: Diff) -> list[str]:
    """The comparison as text lines."""
    lines = []
    for log in diff.logs:
        lines.append(
            f"{log.name}: {'identical' if log.same else 'DIFFERENT'}  sha256 {log.sha[0][:12]} {log.sha[1][:12]}"
        )
        if not log.same:
            lines.append(f"  first: {log.first}")
    lines += [f"flown with {key}: {x} | {y}" for key, x, y in diff.settings]
    if not diff.figures:
        lines.append("figures: equal")
    for key, x, y in diff.figures:
        both = isinstance(x, (int, float)) and isinstance(y, (int, float))
        lines.append(f"{key}: {x} | {y}" + (f"  ({y - x:+.4g})" if both else ""))
    return lines
