"""Put a report together: chapters in order, pictures beside the page and inside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path

from ground.report import closed_loop, open_loop
from ground.report import page as p
from ground.report.lee import page as lee
from ground.report.load import Campaign, ReportError, load

PAGE = "lee.html"


class Pictures:
    """Writes every figure to the folder as PNG and gives it back for the page."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.names: list[str] = []

    def add(self, name: str, png: bytes, caption: str) -> str:
        """HTML of a figure that is also `<name>.png` beside the page. Raises OSError."""
        (self.folder / f"{name}.png").write_bytes(png)
        self.names.append(f"{name}.png")
        return p.figure(png, caption)


def lee_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/lee.html and its PNG figures from campaign folders; returns the page. Raises ReportError."""
    campaigns = load_all(folders)
    return write_page(out, PAGE, lambda: _text(campaigns, Pictures(out)))


def load_all(folders: Sequence[Path]) -> dict[str, Campaign]:
    """Campaigns by study. Raises ReportError without any, and when two are of one study."""
    campaigns: dict[str, Campaign] = {}
    for folder in folders:
        c = load(folder)
        if c.study in campaigns:
            raise ReportError(f"{folder} and {campaigns[c.study].folder} are both of study {c.study}; name one of them")
        campaigns[c.study] = c
    if not campaigns:
        raise ReportError("no campaign folder named")
    return campaigns


def write_page(out: Path, name: str, text: Callable[[], str]) -> Path:
    """Write `out`/`name` with what `text` gives, which may add pictures to the folder. Raises ReportError."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text())
    except OSError as e:
        raise ReportError(f"{out}: cannot be written: {e.strerror} ({e.filename})") from None
    return out / name


def _text(campaigns: dict[str, Campaign], pictures: Pictures) -> str:
    chapters: list[tuple[str, str, str]] = []  # anchor, title, body
    rank = {name: i for i, name in enumerate(["lee", *lee.STUDIES])}
    for study in sorted(campaigns, key=lambda s: (rank.get(s, 99), s)):
        c = campaigns[study]
        body = open_loop.tanker(c, pictures) if study == "lee" else _study(c, pictures)
        title = (
            "Tanker cases" if study == "lee" else lee.STUDIES[study].title if study in lee.STUDIES else c.meta["title"]
        )
        chapters.append((study, str(title), warnings(c) + body))
    chapters.append(("reading", "How to read this", _reading()))
    chapters.append(("provenance", "Provenance", provenance(list(campaigns.values()))))
    body = _headline(campaigns) + "\n".join(p.section(*c) for c in chapters)
    return p.document(lee.TITLE, lee.PURPOSE, [(a, t) for a, t, _ in chapters], body)


def _study(c: Campaign, pictures: Pictures) -> str:
    known = lee.STUDIES.get(c.study)
    body = p.paragraph(str(c.meta.get("purpose", "")))
    if known is not None:
        body += claims(c, known)
    loop, wind = closed_loop.chapter(c, pictures), open_loop.sweep(c, pictures)
    return body + (loop + wind or "") + open_loop.everything(c)


def claims(c: Campaign, known: lee.Sweep) -> str:
    """What the source printed, each claim with the noise it is for, and whether a case here has that noise."""
    coloured = {bool(c.meta["cases"][x].get("tau_s")) for x in c.cases}
    out = p.paragraph(f"Printed: {known.printed}.", "soft") if known.printed else ""
    for kind, text in ((False, known.white), (True, known.coloured)):
        if text:
            noise = "coloured" if kind else "white"
            here = "" if kind in coloured else f" No case here has {noise} noise: nothing below can be held against it."
            out += p.paragraph(f"Printed, {noise} noise: {text}.{here}", "soft")
    return out


def warnings(c: Campaign) -> str:
    """What a reader must know before the figures: an unfinished campaign, failed runs."""
    out = ""
    if not c.meta.get("complete", True):
        out += p.paragraph(
            f"This campaign is not complete: {len(c.rows)} runs on record. Figures are preliminary.", "warn"
        )
    failed = sum(c.failed(x) for x in c.cases)
    if failed:
        out += p.paragraph(
            f"{failed} of {len(c.rows)} runs failed and are in no statistic below; reasons under Provenance.", "bad"
        )
    return out


def _headline(campaigns: dict[str, Campaign]) -> str:
    rows = [r for c in campaigns.values() for r in c.rows]
    failed = sum(r["status"] != "ok" for r in rows)
    cards = [p.card(str(len(rows)), "runs"), p.card(str(failed), "failed runs", "bad" if failed else "good")]
    if "lee" in campaigns:
        met, of = open_loop.targets(campaigns["lee"])
        won, cases = open_loop.wins(campaigns["lee"])
        if of:
            cards.append(p.card(f"{met} of {of}", "accuracy targets met", "good" if met == of else "bad"))
        if cases:
            text = "cases where the default beats the printed method"
            cards.append(p.card(f"{won} of {cases}", text, "good" if won == cases else "bad"))
    return f'<div class="cards">{"".join(cards)}</div>'


READING = """
Wind magnitude error is (estimate - truth) / truth of the magnitude; direction error is the horizontal angle. Of errors the
RMS over the runs is given, of other figures the mean; the small line below is the 95 % confidence interval over runs
(Student's t; of an RMS from its mean square; of shares after Wilson).

Run i has the same seed in every case and for every filter, so the filters of one case are compared on the same noise;
"better in" counts the runs in which the default had the smaller error.

Consistency: a filter that knows its own error has it inside its 3-sigma bounds at least 97 % of the time, and its normalised
error squared (NEES) inside the chi-square band. Limit: RMS error over the posterior Cramer-Rao bound along the true
trajectory; on average no unbiased estimator gets below 1.

The source prints neither its process noise nor its gains; "as printed" means its equations with values of our own.
"""


def _reading() -> str:
    return "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))


def provenance(campaigns: Sequence[Campaign]) -> str:
    """Where the figures come from, and why runs failed."""
    rows = []
    for c in campaigns:
        m = c.meta
        code = ", ".join(i.get("code", "?") for i in m.get("identity", []))
        commit = str(m.get("git_commit", "unknown"))[:12] + (" (modified)" if m.get("git_dirty") else "")
        libs = ", ".join(f"{k} {v}" for k, v in m.get("versions", {}).items())
        rows.append(
            p.text(c.study) + p.text(c.folder, "name") + p.text(m["master_seed"]) + p.plain(len(c.rows)) + p.text(commit)
            + p.text(code) + p.text(f"Python {m.get('python', '?')}, {libs}") + p.text(m.get("started", "?"))
        )  # fmt: skip
    head = [(h, "") for h in ("study", "folder", "seed", "runs", "commit", "code digest", "libraries", "started")]
    head[3] = ("runs", "num")
    out = p.table(head, rows)
    reasons = [
        p.text(c.study) + p.text(case) + p.plain(n) + p.text(reason)
        for c in campaigns
        for (case, reason), n in sorted(c.reasons().items())
    ]
    if reasons:
        out += "<h3>Failed runs</h3>" + p.table([("study", ""), ("case", ""), ("runs", "num"), ("reason", "")], reasons)
    return out + p.paragraph(f"Page made {datetime.now().astimezone().isoformat(timespec='seconds')}.", "note")
