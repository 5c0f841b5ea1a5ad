"""What `sil estimate FILE` does: read, estimate, compare, print, write summary.json and the picture."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.table import Table

from flightsw.files import write_whole
from hil_scripts.estimate import compare, flightlog, offline
from hil_scripts.estimate.columns import FlightLog
from hil_scripts.estimate.kinematic import KinematicParams

CANNOT = (
    "There is no independent wind truth (no mast, lidar or second aircraft): what is shown are differences between estimates",
    "that share the same probe, attitude and velocity. A common error of those does not show.",
)
DOWN_ZERO = (
    "The logged vertical wind is constant at {0:g}: nothing onboard estimated it, there is nothing to compare with."
)
TURNS = "Vertical wind and alpha offset separate only through turns: this log takes {0:.0f} % off the variance of the offset."
SLOW = "The logged wind comes no closer at any shift within {0:g} s: it is slow rather than late; compared as logged."
NO_ALPHA = "There is no incidence in the log: its vertical wind is little more than the incidence that was assumed."
NO_ACCEL = (
    "There is no accelerometer in the log: the specific force (the tether's pull included) is a state that follows the velocity. "
    "A correction of velocity or attitude onboard is seen as wind or as an outlier."
)
TUNED = (
    "The wind's random walk of {0:g} m/s per sqrt(s) was chosen near the most likely one for the AP2 log itself: a mean NIS near "
    "its expectation there is a fit, not a proof; whiteness, synthetic flights and the logged wind are the tests."
)
SHORT = "{0:.0f} s: statistics of wind below {1:.2f} Hz rest on a handful of cycles; the mean wind is one sample of the day's."
JUMPS = "The logged position jumps by up to {0:.2f} m in a step against its own velocity; it is checked, never fused."


def estimate(path: Path, out: Path, twins: int, console: Console) -> dict[str, float]:
    """Run everything on one log and write summary.json and wind.png into `out`; returns the figures. Raises LogError, OSError."""
    log = flightlog.read(path)
    p = offline.params_for(log, KinematicParams())
    tr = offline.run(log, p)
    read = offline.run(log, compare.without_probe(p))
    v = compare.figures(log, tr, read, p)
    v.update(compare.sensitivity(log, tr, read, p))
    if twins and all(log.vanes):
        v.update(compare.twins(log, p, twins))
    for k, x in asdict(p).items():
        each = zip(compare.PROBE, x, strict=True) if isinstance(x, tuple) else ()
        v.update({f"params.{k}.{c}": float(y) for c, y in each} or {f"params.{k}": float(x)})
    out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(dict(sorted(v.items())), indent=1, allow_nan=False)
    write_whole(out / "summary.json", text + "\n")
    from hil_scripts.estimate import figure

    figure.draw(log, tr, out / "wind.png")
    show(console, log, v)
    console.print(f"written: {out / 'summary.json'}, {out / 'wind.png'}", highlight=False, soft_wrap=True)
    return v


def _table(title: str, *heads: str) -> Table:
    t = Table(title=title, title_justify="left", title_style="bold")
    for k, h in enumerate(heads):
        t.add_column(h, justify="left" if k == 0 else "right")
    return t


def show(console: Console, log: FlightLog, v: dict[str, float]) -> None:
    """Print the tables and what the data cannot show."""
    console.print(
        f"{log.name}: {len(log)} samples, {v['log.duration_s']:.2f} s at {1.0 / v['log.step_s']:.1f} Hz; "
        f"first {v['log.settle_s']:g} s left out of the figures",
        highlight=False,
    )
    _show_wind(console, v)
    show_faults(console, log)
    _show_differences(console, v)
    _show_residuals(console, v)
    _show_innovations(console, v)
    _show_probe(console, v)
    if "twin.exact.n" in v:
        _show_twins(console, v)
    _show_limits(console, log, v)


def _show_wind(console: Console, v: dict[str, float]) -> None:
    t = _table("Wind [m/s]", "", "N mean", "E mean", "D mean", "N std", "E std", "D std", "speed", "from [deg]")
    for name in ("estimate", "as_read", "triangle", "logged"):
        if f"wind.{name}.speed" in v:
            cells = [f"{v[f'wind.{name}.{a}.{s}']:.2f}" for s in ("mean", "std") for a in "ned"]
            t.add_row(name, *cells, f"{v[f'wind.{name}.speed']:.2f}", f"{v[f'wind.{name}.from_rad'] * 57.29578:.1f}")
    console.print(t)


def _show_differences(console: Console, v: dict[str, float]) -> None:
    t = _table(
        "Differences [m/s]: RMS (95th percentile), share inside 3 sigma of the estimate",
        "",
        "N",
        "E",
        "D",
        "horizontal",
    )
    lag = f" {v['delay.logged_s']:.2f} s later" if "delay.logged_s" in v else ""
    for one in ("estimate", "as_read", "triangle"):
        for other, says in (("logged", lag), ("logged_undelayed", ""), ("triangle", "")):
            k = f"diff.{one}_{other}"
            if f"{k}.n.rms" in v:
                name = f"{one} - {other.removesuffix('_undelayed')}{says}"
                t.add_row(name, *[_cell(v, f"{k}.{a}") for a in ("n", "e", "d", "horizontal")])
    console.print(t)


def _show_residuals(console: Console, v: dict[str, float]) -> None:
    t = _table(
        "Probe read less probe implied by the wind: mean (RMS)", "", "airspeed [m/s]", "beta [deg]", "alpha [deg]"
    )
    for name in ("estimate", "logged"):
        if f"residual.{name}.airspeed.rms" in v:
            cells = []
            for c, s in (("airspeed", 1.0), ("beta", 57.29578), ("alpha", 57.29578)):
                k = f"residual.{name}.{c}"
                cells.append(f"{v[f'{k}.mean'] * s:+.2f} ({v[f'{k}.rms'] * s:.2f})" if f"{k}.rms" in v else "-")
            t.add_row(name, *cells)
    console.print(t)


def _show_innovations(console: Console, v: dict[str, float]) -> None:
    t = _table("Innovations", "channel", "std (1 = model)", "lag-1 correlation", "lags 1-25 in white band")
    for c in offline.CHANNELS:
        k = f"innovation.{c}"
        if f"{k}.std" not in v:
            continue
        t.add_row(c, f"{v[f'{k}.std']:.2f}", f"{v[f'{k}.lag1']:+.2f}", f"{v[f'{k}.lags_inside95']:.0%}")
    console.print(t)
    for name, dof in (("air", 3), ("velocity", 3), ("all", 6)):
        k = f"nis.{name}"
        if f"{k}.mean" not in v:
            continue
        console.print(
            f"NIS {name} ({dof} degrees of freedom): mean {v[f'{k}.mean']:.2f}, median {v[f'{k}.median']:.2f}, 95 % band of the "
            f"mean {v[f'{k}.band95_lo']:.2f}-{v[f'{k}.band95_hi']:.2f}; samples in their 95 % band {v[f'{k}.inside95']:.1%}",
            highlight=False, soft_wrap=True,
        )  # fmt: skip
    console.print(
        f"gate: {v['gate.softened_share']:.2%} of scalar measurements lost weight, {v['gate.refused_share']:.2%} refused",
        highlight=False,
    )


def _show_probe(console: Console, v: dict[str, float]) -> None:
    t = _table("Probe errors: what the flight shows, and what 3 % or 1 deg more would do to the wind", "", "value", "1 sigma",
               "prior", "shown", "wind shift N E D, estimated", "taken as read")  # fmt: skip
    for name, s, u in (("scale", 100.0, "%"), ("beta", 57.29578, "deg"), ("alpha", 57.29578, "deg")):
        k = f"probe.{name}"
        shift = [
            " ".join(f"{v[f'shift.{name}.{m}.{a}.rms']:.2f}" for a in "ned") if f"shift.{name}.by" in v else "-"
            for m in ("estimate", "as_read")
        ]
        cells = [f"{v[f'{k}.{x}'] * s:.2f} {u}" for x in ("value", "sigma", "prior_sigma")]
        shown = f"{v[f'{k}.information_gained']:.0%}"
        if v[f"{k}.held"]:
            cells[0] = "held at 0"
        if v.get(f"params.observed_share.{name}") == 1.0:
            cells[0], shown = "assumed 0", "-"
        t.add_row(name, *cells, shown, *shift)
    console.print(t)
    console.print(
        f"shown: share of the prior's variance the flight takes away; below {v['params.observed_share.scale']:.0%} it knows less "
        "than the prior, and the error is held at 0 with the prior's sigma",
        highlight=False, soft_wrap=True,
    )  # fmt: skip


def show_faults(console: Console, log: FlightLog) -> None:
    """What was wrong with the log and what was done about it."""
    for text in log.notes:
        console.print(f"note: {text}", highlight=False, markup=False, soft_wrap=True)
    for name, there in zip(offline.ASSUMED, log.vanes, strict=True):
        if not there:
            offset, rest = (57.29578 * x for x in offline.ASSUMED[name])
            console.print(
                f"no {name} in the log: taken as 0 +- {offset:.1f} deg, and +- {rest:.1f} deg from moment to moment",
                style="yellow", highlight=False, soft_wrap=True,
            )  # fmt: skip
    for f in log.frozen:
        console.print(
            f"{f.sensor} frozen from {f.start_s:.2f} to {f.end_s:.2f} s ({f.samples} samples): not used there",
            style="yellow", highlight=False, soft_wrap=True,
        )  # fmt: skip
    if log.skipped:
        few = "; ".join(log.skipped[:3]) + ("; ..." if len(log.skipped) > 3 else "")
        console.print(
            f"{len(log.skipped)} rows left out: {few}", style="yellow", highlight=False, markup=False, soft_wrap=True
        )


def _cell(v: dict[str, float], k: str) -> str:
    if f"{k}.rms" not in v:
        return "-"
    inside = f", {v[f'{k}.inside_3sigma']:.1%}" if f"{k}.inside_3sigma" in v else ""
    return f"{v[f'{k}.rms']:.2f} ({v[f'{k}.p95']:.2f}){inside}"


def _show_twins(console: Console, v: dict[str, float]) -> None:
    n = v["twin.exact.n"]
    t = _table(f"Synthetic flights on this path, wind and probe errors known, {n:.0f} of each kind: RMS error (95 % interval)",
               "kind", "N", "E", "D", "in 3 sigma", "NEES wind", "NEES probe", "band (3)",
               "probe RMS (sigma): scale, beta, alpha")  # fmt: skip
    for kind in ("exact", "like_log"):
        k = f"twin.{kind}"
        cells = [f"{v[f'{k}.{a}.rms']:.2f} ({v[f'{k}.{a}.ci95_lo']:.2f}-{v[f'{k}.{a}.ci95_hi']:.2f})" for a in "ned"]
        probe = ", ".join(
            f"{v[f'{k}.probe_{x}.rms'] * s:.2f} ({v[f'{k}.probe_{x}.sigma'] * s:.2f}) {u}"
            for x, s, u in (("scale", 100.0, "%"), ("beta", 57.29578, "deg"), ("alpha", 57.29578, "deg"))
        )
        t.add_row(kind, *cells, f"{v[f'{k}.inside_3sigma']:.1%}", f"{v[f'{k}.nees_wind']:.2f}", f"{v[f'{k}.nees_probe']:.2f}",
                  f"{v[f'{k}.nees_band95_lo']:.2f}-{v[f'{k}.nees_band95_hi']:.2f}", probe)  # fmt: skip
    console.print(t)


def _show_limits(console: Console, log: FlightLog, v: dict[str, float]) -> None:
    lines = [" ".join(CANNOT)]
    if log.wind_n is not None and float(log.wind_n[:, 2].max() - log.wind_n[:, 2].min()) == 0.0:
        lines.append(DOWN_ZERO.format(log.wind_n[0, 2]))
    if not log.vanes[1]:
        lines.append(NO_ALPHA)
    else:
        lines.append(TURNS.format(100.0 * v["probe.alpha.information_gained"]))
    if v.get("delay.found") == 0.0:
        lines.append(SLOW.format(compare.LAG_MAX_S))
    lines.append(NO_ACCEL)
    lines.append(TUNED.format(v["params.q_wind"]))
    if log.pos_n is not None:
        step = (log.pos_n[1:] - log.pos_n[:-1]) - 0.5 * (log.vel_n[1:] + log.vel_n[:-1]) * (log.t[1:] - log.t[:-1])[
            :, None
        ]
        lines.append(JUMPS.format(float(abs(step).max())))
    lines.append(SHORT.format(v["log.duration_s"], 5.0 / v["log.duration_s"]))
    console.print("What this log cannot show", style="bold")
    for line in lines:
        console.print(f"- {line}", highlight=False, soft_wrap=True)
