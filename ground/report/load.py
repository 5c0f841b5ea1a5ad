"""A campaign folder as the report sees it: meta.json, summary.json, runs.parquet, traces/<case>.npz.

Every printed number comes from summary.json; runs.parquet is used for what needs single runs (pairwise comparison, reasons
of failed runs).
"""

from __future__ import annotations

import json
import math
import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

KEY_COLUMNS = ("case", "run", "master_seed", "seed", "status", "reason")
LOSSES = {"lost": "lost", "contact.lost": "lost", "unfinished": "unfinished"}  # shares of runs, and what to say of them
SWEPT = re.compile(r"(?P<what>[A-Za-z]+)_(?P<value>-?\d+(?:\.\d+)?)(?:_(?P<variant>.+))?")


class ReportError(ValueError):
    """A folder that cannot be reported; the text names it and what is wrong."""


@dataclass(frozen=True)
class Stat:
    """One number of the summary: its key there, value, 95 % interval and number of runs. None: no such number, and `why` if
    that is known (all runs lost, failed, or not finite); with a value `why` says which runs are not in it."""

    key: str
    value: float | None
    lo: float | None = None
    hi: float | None = None
    n: int = 0
    why: str = ""


def finite(value: Any) -> float | None:
    """A number of a file as it is, None for what is none: nothing may be judged by it."""
    return value if isinstance(value, (int, float)) and math.isfinite(value) else None


@dataclass
class Campaign:
    """One campaign. `columns` are the value keys; `rows` the Parquet's rows as dicts."""

    folder: Path
    meta: dict[str, Any]
    summary: dict[str, Any]
    columns: list[str]
    rows: list[dict[str, Any]]
    _traces: dict[str, dict[str, NDArray[np.float64]]] = field(default_factory=dict)

    @property
    def study(self) -> str:
        """Name of the study."""
        return str(self.meta["study"])

    @property
    def cases(self) -> list[str]:
        """Cases with at least one row, in the study's order."""
        return [c for c in self.meta["cases"] if f"{c}.runs" in self.summary]

    def stat(self, case: str, value: str) -> Stat:
        """Statistic of a value over runs: for per-run RMS values the RMS over runs, else the mean; with its interval."""
        prefix = f"{case}.{value}"
        kind, ci = ("rms", "rms_ci95") if "rms" in value else ("mean", "ci95")
        get = self.summary.get
        found, n = finite(get(f"{prefix}.{kind}")), int(get(f"{prefix}.n") or 0)
        wild = int(get(f"{prefix}.nonfinite") or 0)
        why = (f"not finite in {wild} of {n + wild} runs" if n else f"not finite in all {wild} runs") if wild else ""
        if found is None:
            why = self.fate(case, value) or why or ("not a number" if get(f"{prefix}.{kind}") is not None else "")
        return Stat(
            f"{prefix}.{kind}", found, finite(get(f"{prefix}.{ci}_lo")), finite(get(f"{prefix}.{ci}_hi")), n, why
        )  # fmt: skip

    def fate(self, case: str, value: str) -> str:
        """Why no run of a case has a value ("<actor>.<what>"): its actor was lost, or did not finish, in all of them, or all
        failed; "" if nothing is known."""
        parts = value.split(".")
        for k in range(len(parts), -1, -1):
            for word, text in LOSSES.items():
                key = ".".join([case, *parts[:k], word])
                if finite(self.summary.get(f"{key}.mean")) == 1.0:
                    return f"{text} in all {int(self.summary.get(f'{key}.n') or self.runs(case))} runs"
        runs = self.runs(case)
        return f"all {runs} runs failed" if runs and self.failed(case) == runs else ""

    def bar(self, case: str, value: str) -> tuple[float, float | None, float | None] | str | None:
        """Value and interval of a value for a figure; why there is none, if that is known."""
        s = self.stat(case, value)
        return (s.value, s.lo, s.hi) if s.value is not None else s.why or None

    def actors(self, metric: str, cases: Sequence[str] | None = None) -> list[str]:
        """Filters or controllers that have `metric` in any of `cases`, or could not because they were lost in all runs of one;
        the default first, the printed method second."""
        found = [c[: -len(metric) - 1] for c in self.columns if c.endswith("." + metric)]
        cases = self.cases if cases is None else cases
        some = [a for a in found if any(f"{c}.{a}.{metric}.n" in self.summary for c in cases)]
        known = [c.rpartition(".")[0] for c in self.columns if c.rpartition(".")[2] in LOSSES]
        lost = [a.removesuffix(".contact") for a in known if a and any(self.fate(c, a) for c in cases)]
        some += [a for a in dict.fromkeys(lost) if a not in some] if found else []
        return sorted(some, key=lambda a: ({"default": 0, "printed": 1}.get(a, 2), a))

    def failed(self, case: str) -> int:
        """Number of failed runs of a case."""
        return int(self.summary.get(f"{case}.failed", 0))

    def runs(self, case: str) -> int:
        """Number of runs of a case on record, failed ones included."""
        return int(self.summary.get(f"{case}.runs", 0))

    def reasons(self) -> dict[tuple[str, str], int]:
        """(case, reason) of failed runs and how often."""
        out: dict[tuple[str, str], int] = {}
        for r in self.rows:
            if r["status"] != "ok":
                out[r["case"], r["reason"]] = out.get((r["case"], r["reason"]), 0) + 1
        return out

    def better(self, case: str, a: str, b: str) -> tuple[int, int]:
        """In how many runs value `a` is below value `b`, and of how many with both: same seed, hence the same noise."""
        pairs = [(r.get(a), r.get(b)) for r in self.rows if r["case"] == case]
        good = [(x, y) for x, y in pairs if x is not None and y is not None and math.isfinite(x) and math.isfinite(y)]
        return sum(x < y for x, y in good), len(good)

    def traces(self, case: str) -> dict[str, NDArray[np.float64]]:
        """Arrays of traces/<case>.npz, none when there is no such file. Raises ReportError when it is damaged."""
        if case not in self._traces:
            path = self.folder / "traces" / f"{case}.npz"
            try:
                with np.load(path, allow_pickle=False) as f:
                    self._traces[case] = {k: f[k] for k in f.files}
            except FileNotFoundError:
                self._traces[case] = {}
            except (OSError, ValueError, zipfile.BadZipFile) as e:
                raise ReportError(f"{path}: cannot be read: {e}") from None
        return self._traces[case]

    def swept(self, names: Sequence[str] = ()) -> dict[str, tuple[float, str]]:
        """case -> (value of the swept parameter, variant) for cases called like `tau_0.05` or `G_3_coloured`.

        A parameter of one of `names` in the case's params wins over the number in the name.
        """
        out: dict[str, tuple[float, str]] = {}
        for case in self.cases:
            m = SWEPT.fullmatch(case)
            given = [self.meta["cases"][case][n] for n in names if n in self.meta["cases"][case]]
            value = given[0] if given and isinstance(given[0], (int, float)) else float(m["value"]) if m else None
            if value is not None:
                out[case] = (float(value), (m["variant"] or "") if m else "")
        return out


def load(folder: Path) -> Campaign:
    """Read a campaign folder. Raises ReportError naming the file that is missing or damaged."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    texts: dict[str, Any] = {}
    for name, needs in (("meta.json", {"study", "cases", "master_seed"}), ("summary.json", set())):
        path = folder / name
        try:
            texts[name] = json.loads(path.read_text())
        except OSError as e:
            raise ReportError(f"{folder} is not a campaign folder: {name}: {e.strerror}") from None
        except ValueError as e:
            raise ReportError(f"{path}: damaged: {e}") from None
        if not isinstance(texts[name], dict) or not needs <= texts[name].keys():
            raise ReportError(f"{path}: not a campaign's {name}")
    try:
        table = pq.read_table(folder / "runs.parquet")
    except (OSError, pa.ArrowException) as e:
        raise ReportError(f"{folder / 'runs.parquet'}: cannot be read: {e}") from None
    columns = [c for c in table.column_names if c not in KEY_COLUMNS]
    return Campaign(folder, texts["meta.json"], texts["summary.json"], columns, table.to_pylist())
