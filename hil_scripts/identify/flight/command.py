"""What `sil identify run:FOLDER[/AIRCRAFT]|LOG --like FILE` does: read, fit, say what the flight tells, write the aircraft
file."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.files import write_whole
from flightsw.strict import Tree, to_dict
from hil_scripts.identify import record
from hil_scripts.identify.flight import logs, readings
from hil_scripts.identify.flight.figure import draw
from hil_scripts.identify.flight.identified import Identified, identify_flight
from hil_scripts.identify.flight.intervals import SHARE
from hil_scripts.identify.flight.model import COEFFICIENTS
from hil_scripts.identify.flight.truth import flown
from hil_scripts.launch import tomlout

PREFIX = "run:"
Arr = NDArray[np.float64]


@dataclass(frozen=True)
class AskedOfFlight:
    """Of the command line: run:FOLDER[/AIRCRAFT] or a log, aircraft file it is taken to be like, seconds of the flight (None:
    those of the test inputs), folder to write."""

    source: str
    like: str
    span_s: tuple[float, float] | None
    out: Path | None


def identify(a: AskedOfFlight, console: Console) -> Path:
    """Identify an aircraft from a run or a log and write its file; returns the folder. Raises ValueError (ConfigError,
    LogError), naming what is missing, OSError for what cannot be read or written."""
    like, truth, tables = load_aircraft(a.like), None, Tree()
    if a.source.startswith(PREFIX):
        folder, name = readings.run_of(a.source.removeprefix(PREFIX))
        cfg, own = readings.sixdof_of(folder, name)
        f, tables, stem = readings.read_run(folder, name, cfg, own), cfg.tables, f"{folder.name}-{name}"
        if like.geometry == own.geometry:  # else the coefficients are of other areas
            truth = flown(folder, name, own)
    else:
        f = logs.read_log(Path(a.source))
        name = stem = Path(a.source).stem
    lo, hi = readings.window(f, a.span_s)
    found = identify_flight(f, like, lo, hi, tables)
    out = a.out or Path("identified") / stem
    out.mkdir(parents=True, exist_ok=True)
    _write(out / f"{name}.toml", f"{name}_identified", like, found, stem, (lo * f.dt_s, hi * f.dt_s))
    write_whole(out / "summary.json", json.dumps(summary(found, truth), indent=1) + "\n")
    pictures = draw(out, found)
    _show(console, found, truth, like.meta.name)
    files = ", ".join(str(p) for p in (out / f"{name}.toml", out / "summary.json", *pictures))
    console.print(f"written: {files}", soft_wrap=True, highlight=False)
    return out


def summary(found: Identified, truth: Arr | None) -> dict[str, float | bool]:
    """Flat dotted keys: value, 95 % half width and whether it is identified for each coefficient, and against the truth where
    there is one."""
    gusts = found.model.gusts
    out: dict[str, float | bool] = {
        "fit.steps": found.fit.steps, "fit.begun_by_equation_error": found.by_equation,
        "fit.channels_coloured": len(found.coloured), "identified.count": len(found.verdict.identified),
        "fit.gusts_mps": 0.0 if gusts is None else gusts.sigma,
    }  # fmt: skip
    for k, t in zip(COEFFICIENTS, found.verdict.told, strict=True):
        out |= {f"{k}.value": t.value, f"{k}.half95": t.half, f"{k}.identified": t.identified}
        if truth is not None:
            out |= {f"{k}.true": float(t.weights @ truth), f"{k}.held": t.holds(truth)}
    if truth is not None:
        told = found.verdict.identified
        out["identified.held"] = sum(t.holds(truth) for t in told)
    return out


def _write(path: Path, name: str, like: Aircraft, found: Identified, source: str, span_s: tuple[float, float]) -> None:
    v, m = found.verdict, found.model
    tree = to_dict(like)
    tree["meta"]["name"] = name
    tree["aero"] = dict(zip(COEFFICIENTS, v.written.tolist(), strict=True))
    notes = {}
    for k, t in zip(COEFFICIENTS, v.told, strict=True):
        among = f", with it {t.name.partition(' ')[2]}" if " " in t.name else ""
        notes[k] = (
            f"+- {t.sigma:.1g}{among}" if t.identified
            else f"not identified: {t.value:.3g} +- {t.half:.1g} (95 %); as in {like.meta.name}"
        )  # fmt: skip
    head = [
        (
            f"Identified from {source}, {span_s[0]:.1f} to {span_s[1]:.1f} s: output error, {len(v.identified)} of {len(v.told)} "
            "coefficients."
        ),
        (
            f"Everything but [aero] is that of {like.meta.name}. Behind each derivative its standard error, for residuals as "
            "they are correlated in time."
        ),
        (
            f"Held at the value of {like.meta.name}, as their 95 % intervals reach beyond {100 * SHARE:.0f} % of their size: "
            f"{', '.join(v.held) or 'none'}."
        ),
    ]
    if found.coloured:
        head.append(f"Intervals are lower bounds: residuals of {', '.join(found.coloured)} are no sensors' noise.")
    at = [f"V {m.engine[3]:.1f} m/s, height {m.engine[4]:.0f} m, mass {m.mass[0, 0]:.0f} kg"]
    write_whole(path, record.with_notes(tomlout.dumps(record.rounded(tree)), [*head, *at], notes))


def _show(console: Console, found: Identified, truth: Arr | None, like: str) -> None:
    columns = ["coefficient", like, "value", "95 % +-", "%"]
    table = Table(*columns, *(["true", "sigma off"] if truth is not None else []))
    base = found.model.mean[: len(COEFFICIENTS)]
    for t in found.verdict.told:
        share = 100.0 * t.half / abs(t.value) if t.value else math.inf
        more = []
        if truth is not None:
            true = float(t.weights @ truth)
            more = [f"{true:.4g}", f"{(t.value - true) / t.sigma:+.1f}"]
        row = [t.name, f"{float(t.weights @ base):.4g}", f"{t.value:.4g}", f"{t.half:.2g}"]
        table.add_row(*row, f"{share:.1f}" if t.identified else "not identified", *more)
    console.print(table)
    way = "equation error" if found.by_equation else f"the file of {like}"
    console.print(f"output error from {way}: {found.fit.steps} steps", highlight=False)
    if (gusts := found.model.gusts) is not None:
        words = f"no still air: gusts of {gusts.sigma:.2f} m/s along each axis sought with it"
        console.print(words, highlight=False, soft_wrap=True)
    if found.coloured:
        console.print(
            f"intervals are lower bounds: residuals of {', '.join(found.coloured)} are no sensors' noise (wind, or what the form "
            "cannot hold)",
            highlight=False, soft_wrap=True,
        )  # fmt: skip
    if truth is not None:
        told = found.verdict.identified
        held = sum(t.holds(truth) for t in told)
        console.print(f"against what was flown: {held} of {len(told)} intervals hold it", highlight=False)
