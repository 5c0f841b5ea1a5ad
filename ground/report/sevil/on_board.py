"""Chapter on the printed position flown on board in place of the filter: what each finds at contact, and what comes of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ground.report import page as p
from ground.report.cases import CaseOf, Cases, matrix
from ground.report.figures import SPARE, TRUTH, Array, new_figure, png_bytes

STUDY = "sevil_baseline"
METHODS = {
    "filter": "filter",
    "filter_air_only": "filter, air data only",
    "algorithm_11": "Algorithm 11, mean of 1 s",
    "algorithm_15": "Algorithm 15, mean of 1 s",
    "algorithm_11_10s": "Algorithm 11, mean of 10 s",
}
CALM = {
    "filter_calm": "filter",
    "algorithm_11_calm": "Algorithm 11, mean of 1 s",
    "algorithm_15_calm": "Algorithm 15, mean of 1 s",
}
SHOWN_M = 2.5  # either side of the middle of the flight


def on_board(cases: Cases) -> str:
    """Pictures and figures of a campaign `sevil_baseline`. Empty where there is none."""
    mine = {c.name: c for c in cases.all if c.campaign.study == STUDY}
    shown = [(mine[name], text) for name, text in METHODS.items() if name in mine]
    out = _pictures(cases, "on_board", shown, "First run: y and z flown and as found on board; gaps: no position. From 48 s on "
                    "the relative sensor is silent; a line that leaves the picture is a flight that left.")  # fmt: skip
    if shown:
        columns = [("found [%]", "contact.available_pct"), ("RMS [m]", "contact.rms_m"), ("mean y [m]", "contact.mean_m.y"),
                   ("mean z [m]", "contact.mean_m.z"), ("p95 y [m]", "contact.p95_m.y"), ("p95 z [m]", "contact.p95_m.z"),
                   ("left without the sensor", "breakaway"), ("kept [s]", "lost.kept_s"),
                   ("station RMS [m]", "lost.station.rms_m")]  # fmt: skip
        out += matrix([c for c, _ in shown], columns, note="At contact, then 20 s without the relative sensor.")
    still = [(mine[name], text) for name, text in CALM.items() if name in mine]
    picture = _pictures(
        cases, "on_board_calm", still, "Moved across in calm air without noise: the maps know no motion."
    )
    if picture:
        columns = [("lag [s]", "lag_s"), ("largest error across [m]", "moving.max_m.y")]
        out += "<h3>Moved across</h3>" + picture + matrix([c for c, _ in still], columns)
    if not out:
        return ""
    return (
        p.paragraph(
            "The print's Algorithms 11 and 15 fly in place of the filter (airdata.position.method), on the same seeds."
        )
        + out
    )


def _pictures(cases: Cases, name: str, shown: Sequence[tuple[CaseOf, str]], text: str) -> str:
    flown = [(c.traces(), label) for c, label in shown]
    flown = [(tr, label) for tr, label in flown if "wake" in tr]
    return cases.pictures.add(name, found(flown), text) if flown else ""


def found(flown: Sequence[tuple[Mapping[str, Array], str]]) -> bytes:
    """y and z over time, a row a method. Of each: t [N] s, xi, wake [N,3] m as flown and as found, valid [N]."""
    fig, axes = new_figure(13.2, 2.3 * len(flown), len(flown), 2, sharex=True)
    for row, (tr, label) in zip(axes, flown, strict=True):
        have = tr["valid"] > 0
        for ax, i, axis in zip(row, (1, 2), "yz", strict=True):
            true = tr["xi"][:, i]
            ax.plot(tr["t"], true, color=TRUTH, lw=1.4, label="flown", zorder=5)
            ax.plot(
                tr["t"], np.where(have, tr["wake"][:, i], np.nan), ".", ms=2.5, color=SPARE[0], label="found on board"
            )
            middle = float(np.median(true))
            ax.set_ylim(middle - SHOWN_M, middle + SHOWN_M)
            ax.set_ylabel(f"{axis} [m]" + (", down" if axis == "z" else ""), fontsize=9.5)
        row[0].set_title(label, fontsize=9.5, loc="left", color="#3a4550")
    for ax in axes[-1]:
        ax.set_xlabel("time [s]", fontsize=9.5)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2, frameon=False, fontsize=9)
    return png_bytes(fig)
