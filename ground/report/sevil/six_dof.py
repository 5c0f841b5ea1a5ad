"""Chapter on the printed algorithms flown by the full aircraft: dynamic grid, holds, and the tables of fault detection."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ground.report import page as p
from ground.report.cases import Cases, matrix
from ground.report.figures import SPARE, TRUTH, Array, new_figure, png_bytes

HOLDS = {
    "hold_contact": "at contact (0, 8.5) m, the print's Figure 6.11",
    "hold_left": "at (-0.5, 9.5) m, Figure 6.12",
    "hold_right": "at (0.5, 6.5) m, Figure 6.13",
}
FOUND = {
    "A11": "Algorithm 11",
    "A11_trim": "Algorithm 11, maps of the trim",
    "A15_trim": "Algorithm 15, maps of the trim",
}
DETECTORS = {
    "plain": "plain", "printed": "as printed", "printed_trim": "as printed, attitude of the trim", "additive": "additive",
    "windowed": "windowed",
}  # fmt: skip


def six_dof(cases: Cases) -> str:
    """Dynamic grid, holds with Euler angles, fault detection on the flown approach. Empty where nothing of it was flown."""
    return _grid(cases) + _holds(cases) + _approach(cases) + _tables(cases)


def _grid(cases: Cases) -> str:
    rows = [c for c in cases.all if c.name.startswith("grid_") and "grid" in c.traces()]
    if not rows:
        return ""
    a = np.concatenate([c.traces()["grid"] for c in rows])
    names = ("A11", "A11_trim")
    said = []
    for i, name in enumerate(names):
        e = np.hypot(*a[:, 2 + 2 * i : 4 + 2 * i].T)
        have = np.isfinite(e)
        said.append(f"{FOUND[name]}: found at {have.sum()} of {len(e)} places, nearer than 0.5 m at {(e < 0.5).sum()}")
    out = p.paragraph(
        "Every place of the grid held for 40 s in calm air without noise. The maps are of one attitude; the aircraft trims "
        "another one at every place, and off the axis of symmetry the contours then meet elsewhere or not within 0.1 m. "
        + "; ".join(said)
        + "."
    )
    text = "Estimated y and z over the place flown, first run; crosses: no position. Exact would be even stripes of colour."
    return "<h3>Dynamic grid, Figure 6.10</h3>" + out + cases.pictures.add("six_dof_grid", grid(a, names), text)


def grid(a: Array, names: tuple[str, ...]) -> bytes:
    """Estimates y, z over the place flown. a [n,2+2k]: place and errors y, z [m] of each of the k names, NaN: none."""
    fig, axes = new_figure(11.5, 4.3 * len(names), len(names), 2, sharex=True, sharey=True)
    for i, name in enumerate(names):
        for axis, label in enumerate("yz"):
            ax = axes[i, axis]
            got = a[:, axis] + a[:, 2 + 2 * i + axis]
            have = np.isfinite(got)
            ax.plot(*a[~have, :2].T, "x", ms=5, color="#b9c1c9")
            lo, hi = float(a[:, axis].min()), float(a[:, axis].max())
            dots = ax.scatter(*a[have, :2].T, c=got[have], s=46, marker="s", cmap="viridis", vmin=lo, vmax=hi, lw=0)
            ax.plot(0.0, 8.5, "+", ms=12, mew=1.6, color="#b3261e")
            ax.set_title(f"{FOUND[name]}: {label}", fontsize=9.5, loc="left", color="#3a4550")
            fig.colorbar(dots, ax=ax, label=f"estimated {label} [m]", pad=0.01, extend="both")
        axes[i, 0].set_ylabel("z flown [m], down", fontsize=9.5)
    for ax in axes[-1]:
        ax.set_xlabel("y flown [m]", fontsize=9.5)
    axes[0, 0].invert_yaxis()
    return png_bytes(fig)


def _holds(cases: Cases) -> str:
    out = ""
    shown = [(c, text) for name, text in HOLDS.items() if (c := cases.named(name)) is not None]
    for c, text in shown:
        tr = c.traces()
        if "true" in tr:
            caption = f"Held {text}: position flown and as found once a second, and the aircraft's attitude to the tanker's path."
            out += cases.pictures.add(f"six_dof_{c.name}", hold(tr), caption)
    columns = [(f"{t}: {h}", f"{k}.{v}") for k, t in FOUND.items()
               for h, v in (("found [%]", "available_pct"), ("y [m]", "mean_m.y"), ("z [m]", "mean_m.z"))]  # fmt: skip
    columns += [(f"{t} [deg]", f"attitude.{k}_deg") for k, t in (("psi", "yaw"), ("theta", "pitch"), ("phi", "roll"))]
    note = "Mean error once the hold has settled."
    return "<h3>Holds</h3>" + out + matrix([c for c, _ in shown], columns, note=note) if shown else ""


def hold(tr: Mapping[str, Array], around: bool = True) -> bytes:
    """A flight. tr: t [N] s, true [N,2] m, att [N,3] rad, second [k] s, "<name>.position" [k,2] m; around: near its middle."""
    fig, axes = new_figure(13.2, 3.7, 1, 3, sharex=True)
    for i, label in enumerate("yz"):
        ax = axes[0, i]
        ax.plot(tr["t"], tr["true"][:, i], color=TRUTH, lw=1.4, label="flown", zorder=5)
        for k, (name, text) in enumerate((n, x) for n, x in FOUND.items() if f"{n}.position" in tr):
            ax.plot(tr["second"], tr[f"{name}.position"][:, i], ".", ms=4 + 2 * (2 - k), color=SPARE[k], label=text)
        ax.set_ylabel(f"{label} [m]" + (", down" if label == "z" else ""), fontsize=9.5)
        middle = float(np.median(tr["true"][:, i]))
        if around:
            ax.set_ylim(middle - 1.5, middle + 1.5)
    for i, (label, color) in enumerate((("yaw", SPARE[3]), ("pitch", SPARE[4]), ("roll", SPARE[1]))):
        axes[0, 2].plot(tr["t"], np.degrees(tr["att"][:, i]), lw=1.2, color=color, label=label)
    axes[0, 2].set_ylabel("attitude [deg]", fontsize=9.5)
    handles = [h + g for h, g in zip(*(ax.get_legend_handles_labels() for ax in axes[0, 1:]), strict=True)]
    fig.legend(*handles, loc="outside upper right", ncols=7, frameon=False, fontsize=9)
    for ax in axes[0]:
        ax.set_xlabel("time [s]", fontsize=9.5)
    return png_bytes(fig)


def _approach(cases: Cases) -> str:
    c = cases.named("tables_calm")
    tr = c.traces() if c else {}
    if c is None or "A11.position" not in tr:
        return ""
    text = "From observation to contact in calm air: position flown and as found once a second, and the attitude."
    columns = [(f"{t}: {h}", f"{k}.{v}_{w}_{u}") for k, t in list(FOUND.items())[:2] for w in ("before", "during", "after")
               for h, v, u in ((f"found {w} [%]", "available", "pct"), (f"median {w} [m]", "median", "m"))]  # fmt: skip
    picture = cases.pictures.add("six_dof_approach", hold(tr, around=False), text)
    shown = [x for n in ("tables_calm", "tables") if (x := cases.named(n)) is not None]
    return "<h3>Manoeuvre, Figure 6.14</h3>" + picture + matrix(shown, columns)


def _tables(cases: Cases) -> str:
    shown = [(c, t) for n, t in (("tables", "light turbulence and wind"), ("tables_calm", "calm"))
             if (c := cases.named(n)) is not None]  # fmt: skip
    if not shown:
        return ""
    kinds = (
        ("before", "fap_before_pct"),
        ("during", "fap_during_pct"),
        ("after", "fap_after_pct"),
        ("true", "tap_pct"),
    )
    head = [("detector", ""), *((f"{v}: {h} [%]", "num") for v in ("V", "sideslip", "incidence") for h, _ in kinds)]
    rows = []
    for c, text in shown:
        rows.append(p.group(text, len(head)))
        for name, label in DETECTORS.items():
            row = "".join(
                p.cell(c.stat(f"{name}.{v}.{k}"), interval=False) for v in ("V", "beta", "alpha") for _, k in kinds
            )
            rows.append(p.text(label, "name") + row)
    note = "False alarms before, during and after the manoeuvre; true alarms at contact: 3 m/s, 1 deg, 1 deg on one probe each."
    return "<h3>Tables 6.1 to 6.5 on the flown approach</h3>" + p.table(head, rows, note)
