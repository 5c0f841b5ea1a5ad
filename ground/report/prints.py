"""What a published work prints, line by line: where, which command makes it here, the figure measured, and how it came out.

One file per work, `<work>/prints.toml`, beside its report; the report's chapter and the page in docs/reference are made of it.

python -m ground.report.prints CAMPAIGN...    figures of these campaign folders into the files of all works
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from flightsw.strict import ConfigError, OneOf, load
from ground.report import page as p
from ground.report.goals import Found, figure
from ground.report.load import Stat
from ground.report.load import load as campaign

HERE = Path(__file__).parent
YES, CORRECTED, NO, OPEN, TEXT = "reproduced", "reproduced with correction", "not reproduced", "open", "definition"
VERDICTS = (YES, CORRECTED, NO, OPEN, TEXT)
TONE = {YES: "good", NO: "bad", OPEN: "warn"}
ITEM = re.compile(r"(\(|[A-Z][a-z]+\.? )?(\d+(?:\.\d+)?)[a-z]*\)?(?:-\(?(?:\d+\.)?(\d+)[a-z]*\)?)?")
NUMBER = re.compile(r"(\d+\.)?(\d+)")


@dataclass(frozen=True)
class Printed:
    """A line. place: equations "(3)-(7)", figures "Fig. 2, 3", tables, algorithms, section; claim: what is printed; key: the
    figure of a campaign as study/case/value, `measured` over `runs`, both in units of `scale` SI (or, negative, of the other
    sign); low, high: where it must be for the verdict to hold."""

    place: str
    what: str
    verdict: Annotated[str, OneOf(VERDICTS)]
    command: str = ""
    claim: str = ""
    key: str = ""
    unit: str = ""
    scale: float = 1.0
    measured: float | None = None
    runs: int | None = None
    low: float | None = None
    high: float | None = None
    why: str = ""

    def __post_init__(self) -> None:
        if bool(self.command) == (self.verdict in (TEXT, OPEN)):
            raise ValueError(f"{self.place}: a command stands with what was tried, and only there")
        if self.verdict in (NO, OPEN, CORRECTED) and not self.why.strip("?"):
            raise ValueError(f"{self.place}: {self.verdict} without why")
        if self.key and self.key.count("/") != 2:
            raise ValueError(f"{self.place}: key = {self.key!r}; allowed study/case/value")

    def holds(self, value: float) -> bool:
        """Whether a figure bears the verdict out."""
        inside = (self.low is None or value >= self.low) and (self.high is None or value <= self.high)
        return inside is (self.verdict != NO) or self.low is self.high is None


@dataclass(frozen=True)
class Work:
    """A work. has: everything numbered that it prints, in the form of `place`; errata: the page of its corrections."""

    work: str
    errata: str
    has: tuple[str, ...]
    row: tuple[Printed, ...]

    def without(self) -> list[str]:
        """What the work prints and no line is about."""
        told = {x for r in self.row for x in numbered(r.place)}
        return [x for h in self.has for x in numbered(h) if x not in told]


def numbered(place: str) -> Iterator[str]:
    """Single numbers of "(2.3)-(2.5), Fig. 7.1-7.3, 7.9": "(2.3)", ..., "Fig. 7.9"."""
    kind = ""
    for part in place.split(", "):
        m = ITEM.fullmatch(part)
        if m is None:
            kind = ""
            continue
        kind = m[1] or kind
        first = NUMBER.fullmatch(m[2])
        if not kind or first is None:
            continue
        for n in range(int(first[2]), int(m[3] or first[2]) + 1):
            yield f"{kind}{first[1] or ''}{n}" + (")" if kind == "(" else "")


def works() -> dict[str, Path]:
    """Files by name of the work."""
    return {f.parent.name: f for f in sorted(HERE.glob("*/prints.toml"))}


def read(name: str) -> Work:
    """The lines of a work. Raises ConfigError naming what is wrong in its file."""
    return load(works()[name], Work)


def stat(found: Found, r: Printed) -> Stat | None:
    """The figure of a line in the campaigns at hand, None where there is none."""
    if not r.key:
        return None
    study, case, value = r.key.split("/")
    c = found.get(study)
    s = figure(c, case, value) if c is not None else None
    return s if s is not None and s.value is not None else None


def tally(w: Work) -> str:
    """How many lines came out how."""
    count = Counter(r.verdict for r in w.row)
    return f"{len(w.row)} lines: " + ", ".join(f"{count[v]} {v}" for v in VERDICTS if count[v]) + "."


def chapter(name: str, found: Found) -> str:
    """HTML of the lines of a work: figures of the campaigns at hand, else those on record."""
    w, rows = read(name), []
    for r in w.row:
        s = stat(found, r)
        what = f"{r.what} [{r.unit}]" if r.unit else r.what
        cells = p.text(r.place) + p.text(what) + p.text(r.claim) + p.text(r.command)
        if s is None or s.value is None:
            cells += p.plain(r.measured, "soft", "", _runs(r.runs))
        elif r.scale == 1.0:
            cells += p.cell(s, "" if r.holds(s.value) else "bad")
        else:
            value = s.value / r.scale
            cells += p.plain(value, "" if r.holds(value) else "bad", "", _runs(s.n))
        rows.append(cells + p.text(r.verdict, TONE.get(r.verdict, "")) + p.text(r.why, "claim"))
    head = [
        ("print", ""),
        ("what", ""),
        ("printed", ""),
        ("command", ""),
        ("measured", "num"),
        ("verdict", ""),
        ("", ""),
    ]
    note = "Grey: on record, the campaign is not at hand. Red: the figure does not bear the verdict out. E: errata of the source."
    return p.paragraph(tally(w)) + p.table(head, rows, note)


def _runs(n: int | None) -> str:
    return "" if n is None else "1 run" if n == 1 else f"{n} runs"


def markdown(name: str, again: str) -> str:
    """The page of a work; again: the line that says what makes it."""
    w = read(name)
    out = [f"# {w.work}, line by line", "", again, ""]
    out += [
        f"{tally(w)} Commands stand in `.venv/bin`; figures of `sil campaign` are means, or RMS, over the runs named; E and",
        "",
    ]
    out[-2] += f" trap: [{w.errata.partition('/')[2]}](../{w.errata})."
    out += ["| print | what | printed | command | measured | verdict | |", "|---|---|---|---|---|---|---|"]
    for r in w.row:
        got = "" if r.measured is None else f"{p.number(r.measured)} {r.unit}".strip()
        got += f" ({_runs(r.runs)})" if got and r.runs is not None else ""
        cells = (r.place, r.what, r.claim, f"`{r.command}`" if r.command else "", got, r.verdict, r.why)
        out.append("| " + " | ".join(c.replace("|", "\\|").replace("<", "&lt;") for c in cells) + " |")
    return "\n".join([*out, ""])


def record(path: Path, found: Found) -> int:
    """Write the figures of campaigns into a file of lines; returns how many. The text around them stays as it is."""
    top, *blocks = path.read_text().split("[[row]]\n")
    lines, count = load(path, Work).row, 0
    for i, r in enumerate(lines):
        s = stat(found, r)
        if s is None or s.value is None:
            continue
        kept = [x for x in blocks[i].splitlines() if not re.match(r"(measured|runs) = ", x)]
        at = next(j for j, x in enumerate(kept) if x.startswith("key = ")) + 1
        value = float(f"{s.value / r.scale:.4g}")
        blocks[i] = "\n".join([*kept[:at], f"measured = {value!r}", f"runs = {s.n}", *kept[at:]]).rstrip() + "\n\n"
        count += 1
    path.write_text("[[row]]\n".join([top, *blocks]).rstrip() + "\n")
    return count


def main(argv: Sequence[str] | None = None) -> int:
    """Record the figures of the folders named. Returns the exit code."""
    folders = sys.argv[1:] if argv is None else argv
    if not folders:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        found = {c.study: c for c in (campaign(Path(f)) for f in folders)}
        for name, path in works().items():
            print(f"{name}: {record(path, found)} figures")
    except (ConfigError, ValueError) as e:
        print(f"prints: {e}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
