"""The refuelling by grade of sensors and level of turbulence as a page: outcomes, station keeping, estimates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ground.report import page as p
from ground.report.build import load_all, provenance, warnings, write_page
from ground.report.load import Campaign

PAGE = "grades.html"
TITLE = "Grades of sensors: what the refuelling makes of them"
PURPOSE = (
    "The refuelling is flown whole, plant and onboard processes, with every sensor of both aircraft of one grade, in each level "
    "of turbulence. Contact is held on the straight leg and in the turn; the truth judges."
)
OUTCOMES = {
    "kept": "kept",
    "left": "left in time",
    "late": "late",
    "silent": "silent",
    "keep_out": "keep-out",
    "upset": "upset",
    "lost": "lost",
    "refused": "refused, said why",
    "not_reached": "not reached",
}
HOLD = tuple(
    (f"contact.{stat}_m.{x}", f"{words} {x}, m") for stat, words in (("rms", "RMS"), ("p95", "95 %")) for x in "xyz"
)
ESTIMATE = (
    *((f"relative.rms_m.{x}", f"position {x}, m") for x in "xyz"),
    ("relative.inside_3sigma_pct", "inside 3σ, %"),
    *((f"wind.rms_mps.{x}", f"wind {x}, m/s") for x in "ned"),
    ("wind.inside_3sigma_pct", "inside 3σ, %"),
)
WIND = tuple(
    (f"wind.{who}.{when}.{stat}", f"{who}, {words}: {unit}")
    for who in ("tanker", "receiver")
    for when, words in (("straight", "before"), ("turned", "after"))
    for stat, unit in (("size_rms_pct", "size, %"), ("direction_rms_deg", "direction, deg"))
)
PRECONTACT = (
    *((f"precontact.rms_m.{x}", f"RMS {x}, m") for x in "xyz"),
    ("precontact.off_rms_m", "distance, RMS m"), ("precontact.off_rms_bound_m", "least possible, m"),
    ("precontact.off_p95_m", "distance, 95 % m"),
    ("precontact.inside_3sigma_pct", "inside 3σ, %"), ("precontact.nees_per_axis", "(error/σ)²"),
    *((f"precontact.rms_over_bound.{x}", f"RMS/bound {x}") for x in "xyz"),
)  # fmt: skip
BEST = tuple(
    (f"{key}.rms_over_bound.{x}", f"{words} {x}")
    for key, words, axes in (
        ("relative", "position", "xyz"),
        ("wind", "wind, receiver", "ned"),
        ("wind.tanker", "tanker", "ned"),
    )
    for x in axes
)
SAID = (
    "attitude", "limits", "bound", "sources", "air", "boom", "station", "recovery", "order", "navigation", "other",
)  # fmt: skip
SAYS = tuple((f"says.{k}", k) for k in SAID)
TRUST = (
    ("relative.nees_per_axis", "position, (error/σ)²"),
    *((f"{key}.{stat}", f"{words}, {unit}")
      for key, words in (("wind", "wind, receiver"), ("wind.tanker", "tanker"),
                         ("attitude.receiver", "attitude, receiver"), ("attitude.tanker", "tanker"))
      for stat, unit in (("nees_per_axis", "(error/σ)²"), ("inside_3sigma_pct", "inside 3σ, %"))),
    ("bound.held_pct", "bound held, %"), ("bound.within_limit_pct", "bound within the limit, %"),
    *((f"bound.p50_m.{x}", f"bound {x}, m") for x in "xyz"),
)  # fmt: skip
READING = """
An outcome is that of the fault matrix, with no fault but the grade and the air: kept is never further than 2 m from the contact
point with contact not left; left in time is announced before the limit; silent is beyond it for 1 s with nothing said. Not
reached: the receiver did not report contact in the time it had. Shares are of all runs, with Wilson intervals at 95 %.

Station keeping and estimates are of the time in contact: from the receiver's first report of it until it was left, the flight
ended or the watch was over, of runs with at least 5 s of it; their number stands in the table. A run gives one figure; the
interval is over runs, by Student's t. RMS over runs is the root of the mean square; 95 % is the mean of the runs' 95th
percentiles. Runs that left early are in it with the time they had: read it beside the outcomes.

Inside 3σ: share of the errors of all three axes within three times the sigma published with them, both as sent at 10 Hz. Of a
Gaussian error with an honest sigma 99.7 % are inside. Slow errors of a sensor are one draw a run: the share differs from run to
run.

Wind: before and after the aircraft has turned by 90° since contact, from which on its estimator can tell wind from airspeed.

At pre-contact: distance of the relative position from the truth, before contact is ordered. Attitude: heading, pitch and bank as
sent with their sigmas.

RMS/bound: RMS error over the RMS of the least sigma there can be, the posterior Cramér-Rao bound. Of the position it is the
covariance of a linear filter with the very errors the plant draws, carried along the true path; of the wind that of the onboard
filter told the sensors' very errors, the air as on board. A lasting error is one draw a run: a run can be far below one, and only
the RMS over many runs is held to be at least that.

Said: share of the runs in which the receiver gave a warning, or left, for that reason. Refused: contact not reached, and a
reason given.

Alerts: no source of position is wrong in these flights, so each one newly left out, or in dispute, is a false alert, and so is a
breakaway; rate of both over all hours flown, with the Poisson interval at 95 %. The nominal flights are long ones: contact,
pre-contact and contact again on a racetrack, each to its end or to the first breakaway.
"""


def grades_report(folders: Sequence[Path], out: Path) -> Path:
    """Write `out`/grades.html from a campaign folder; returns the page. Raises ReportError."""
    found = load_all(folders, ("grades",))
    return write_page(out, PAGE, lambda: _text(next(iter(found.values()))))


def _text(c: Campaign) -> str:
    chapters = [
        ("outcomes", "Outcomes", _table(c, "", tuple((f"is.{k}", w) for k, w in OUTCOMES.items()), c.runs)),
        ("said", "What was said", _table(c, "", SAYS, c.runs)),
        ("precontact", "Position at pre-contact", _table(c, "with pre-contact", PRECONTACT, _with(c, "precontact.s"))),
        ("hold", "Station keeping in contact", _table(c, "with contact", HOLD, _held(c))),
        ("estimates", "Errors of the estimates in contact", _table(c, "with contact", ESTIMATE, _held(c))),
        ("winds", "Wind by size and direction", _table(c, "with contact", WIND, _held(c))),
        ("best", "RMS error over the least possible", _table(c, "with contact", BEST, _held(c))),
        ("trust", "Consistency and bounds", _table(c, "with contact", TRUST, _held(c))),
        ("alerts", "False alerts", _alerts(c)),
        ("reading", "How to read this", "".join(p.paragraph(t) for t in READING.strip().split("\n\n"))),
        ("provenance", "Provenance", provenance([c])),
    ]
    body = warnings(c) + "\n".join(p.section(*x) for x in chapters)
    return p.document(TITLE, PURPOSE, [(a, t) for a, t, _ in chapters], body)


def _held(c: Campaign) -> Callable[[str], int]:
    return _with(c, "contact.s")


def _with(c: Campaign, value: str) -> Callable[[str], int]:
    return lambda case: c.stat(case, value).n


def _alerts(c: Campaign) -> str:
    """Of the cases with bounds, all runs of a case together."""
    lines = []
    for case in (x for x in c.cases if c.meta["cases"][x].get("guarded")):
        alerts, left, watched = (c.stat(case, k) for k in ("alerts", "breakaways", "watched_s"))
        if alerts.value is None or left.value is None or not watched.value:
            continue
        found = [round(x.value * x.n) for x in (alerts, left) if x.value is not None]
        count, hours = sum(found), watched.value * watched.n / 3600.0
        lo, hi = poisson(count)
        cells = "".join(p.plain(x) for x in (hours, *found, count / hours))
        lines.append(p.text(case, "name") + cells + p.text(f"{lo / hours:.2f} to {hi / hours:.2f}"))
    head = ("hours", "sources doubted", "breakaways", "per hour")
    return p.table([("case", ""), *((k, "num") for k in head), ("95 %", "")], lines)


def poisson(count: int) -> tuple[float, float]:
    """The interval at 95 % of the mean of a count (Garwood: quantiles of chi squared)."""
    from scipy.stats import chi2

    return (float(chi2.ppf(0.025, 2 * count)) / 2.0 if count else 0.0), float(chi2.ppf(0.975, 2 * count + 2)) / 2.0


def _table(c: Campaign, which: str, columns: tuple[tuple[str, str], ...], runs: Callable[[str], int]) -> str:
    """A row per grade below a head per level of turbulence; runs: how many the row is of."""
    lines, judged = [], [x for x in c.cases if "long_s" not in c.meta["cases"][x]]
    for sigma in dict.fromkeys(c.meta["cases"][x]["sigma_mps"] for x in judged):
        lines.append(p.group(f"turbulence of {sigma:g} m/s", 2 + len(columns)))
        for case in judged:
            if c.meta["cases"][case]["sigma_mps"] == sigma:
                cells = "".join(p.cell(c.stat(case, value)) for value, _ in columns)
                name = c.meta["cases"][case]["grade"] + (", guarded" if c.meta["cases"][case].get("guarded") else "")
                lines.append(p.text(name, "name") + p.plain(runs(case)) + cells)
    head = [("grade", ""), (f"runs {which}".strip(), "num"), *((words, "num") for _, words in columns)]
    return p.table(head, lines)
