"""What every report is put together with: campaigns by study, pictures beside the page and inside it, warnings, provenance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path

from ground.report import page as p
from ground.report.load import Campaign, ReportError, load


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


def load_all(folders: Sequence[Path], order: Sequence[str] = ()) -> dict[str, Campaign]:
    """Campaigns by study, those of `order` first and in it, the others by name; without one as they were given.

    Raises ReportError without any, and when two are of one study.
    """
    campaigns: dict[str, Campaign] = {}
    for folder in folders:
        c = load(folder)
        if c.study in campaigns:
            raise ReportError(f"{folder} and {campaigns[c.study].folder} are both of study {c.study}; name one of them")
        campaigns[c.study] = c
    if not campaigns:
        raise ReportError("no campaign folder named")
    if not order:
        return campaigns
    rank = {name: i for i, name in enumerate(order)}
    return {s: campaigns[s] for s in sorted(campaigns, key=lambda s: (rank.get(s, len(rank)), s))}


def write_page(out: Path, name: str, text: Callable[[], str]) -> Path:
    """Write `out`/`name` with what `text` gives, which may add pictures to the folder. Raises ReportError."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text())
    except OSError as e:
        raise ReportError(f"{out}: cannot be written: {e.strerror} ({e.filename})") from None
    return out / name


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
