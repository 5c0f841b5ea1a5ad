"""INTEGRITY_STATUS on the ground: words, arrays and figures of the protection level against the alert limit and the true error.

A sample is of one axis of the tanker (x, y, z). Regions of the Stanford-ESA diagram (Tossaint et al. 2007): available, PL within
AL; misleading, error beyond PL; hazardous, error beyond AL while PL is within it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsw.icd.dialect import HOUSE
from ground.align import align
from ground.columns import Columns, Table
from ground.link.packets import Fields
from ground.run import Run
from ground.signals import XYZ, Signal
from ground.views.base import Figures, Words
from ground.views.refueling.aircraft import RECEIVER

Array = NDArray[np.float64]
MESSAGE = "INTEGRITY_STATUS"
NONE = 1e8  # from here on a number of the message stands for none (1e9)
SAID = {"rel": "relative sensor", "gnss": "GNSS difference", "boom": "boom", "wake": "wake position"}
SOURCES = tuple(HOUSE.words("INTEGRITY_SOURCE")[1 << i] for i in range(len(HOUSE.words("INTEGRITY_SOURCE"))))
LIVE = "live"


def source_names(mask: int) -> str:
    """Sources of a mask by name, "" if none."""
    return ", ".join(SAID.get(s, s) for i, s in enumerate(SOURCES) if mask >> i & 1)


def known(values: NDArray) -> Array:
    """Numbers of the message, NaN for none."""
    v = np.asarray(values, dtype=np.float64)
    return np.where(v < NONE, v, np.nan)


def states(d: Table, i: int) -> list[str]:
    """What the source of place i is, row by row. What is wrong comes before what is used."""
    bit = {k: d[k] >> i & 1 > 0 for k in ("used", "excluded", "undecided")}
    cases = [bit["excluded"], bit["undecided"], bit["used"], d["ratio"][:, i] > 0.0]
    out: list[str] = np.select(cases, ["excluded", "undecided", "in use", LIVE], "not live").tolist()
    return out


def words(status: Fields | None) -> list[Words]:
    """Lines of the monitor: protection level against alert limit axis by axis, sources, tests; [] if there is no message."""
    if status is None:
        return []
    out = []
    for axis, pl, al in zip("xyz", status["pl"], status["al"], strict=True):
        text = f"{pl:.2f}" if pl < NONE else "none"
        text += f" of {al:.2f} m" if al < NONE else " m, no limit" if pl < NONE else ", no limit"
        out.append(Words(f"PL {axis}", MESSAGE, text, al < NONE and pl > al))
    parts = [source_names(status["used"]) or "NONE in use"]
    parts += [f"{k.upper()} {source_names(status[k])}" for k in ("excluded", "undecided") if status[k]]
    out.append(Words("sources", MESSAGE, "; ".join(parts), len(parts) > 1 or not status["used"]))
    ratios = [
        f"{SAID.get(s, s)} {r:.2f}" if r < NONE else f"{SAID.get(s, s)} fails"
        for s, r in zip(SOURCES, status["ratio"], strict=True)
        if r > 0.0
    ]
    air, most = status["turbulence"], status["turbulence_max"]
    if 0.0 < most < NONE:
        out.append(Words("turbulence", MESSAGE, f"{air:.1f} of {most:.1f} m/s", air > most))
    out.append(Words("tests", MESSAGE, ", ".join(ratios) or "none", any(r > 1.0 for r in status["ratio"])))
    return out


def signals(run: Run) -> Iterator[Signal]:
    """nav/<receiver>/integrity/{pl, al, sigma, position, error} [m] in the tanker's axes, NaN where there is none; turbulence
    [m/s]; ratio [-] and state/<source> (words) per source."""
    name, d = run.names.get(RECEIVER), run.tlm.get(RECEIVER, MESSAGE)
    if name is None or d is None:
        return
    at = f"nav/{name}/integrity"
    for key, field in (("pl", "pl"), ("al", "al"), ("sigma", "sigma"), ("position", "pos")):
        yield Signal(f"{at}/{key}", d.t_us, known(d[field]), "m", XYZ, MESSAGE)
    yield Signal(f"{at}/turbulence", d.t_us, known(d["turbulence"]), "m/s", (), MESSAGE)
    yield Signal(f"{at}/ratio", d.t_us, known(d["ratio"]), "", SOURCES, MESSAGE)
    for i, source in enumerate(SOURCES):
        yield Signal(f"{at}/state/{source}", d.t_us, np.array(states(d, i), dtype=object), source=MESSAGE)
    judged = judge(run.truth, run.tlm)
    if judged is not None and len(judged.t_us):
        yield Signal(f"{at}/error", judged.t_us, judged.error, "m", XYZ, MESSAGE)


@dataclass(frozen=True)
class Judged:
    """Samples of INTEGRITY_STATUS with a truth: t_us [n]; error [n,3] signed, pl and al [n,3] m, infinite: none."""

    t_us: NDArray[np.int64]
    error: Array
    pl: Array
    al: Array

    @property
    def size(self) -> Array:
        """Error without its sign [n,3] m."""
        return np.abs(self.error)

    @property
    def available(self) -> NDArray[np.bool_]:
        """[n,3] the level is within the limit (of samples with a limit; a level that is none is in no limit)."""
        return np.isfinite(self.pl) & (self.pl <= self.al)

    @property
    def misleading(self) -> NDArray[np.bool_]:
        """[n,3] error beyond the level."""
        return self.size > self.pl

    @property
    def hazardous(self) -> NDArray[np.bool_]:
        """[n,3] error beyond the limit while the level is within it."""
        return self.available & (self.size > self.al)


def judge(truth: Columns, tlm: Columns) -> Judged | None:
    """Protection levels against the truth (TRUTH.xi at the sample's time); None without the message or without truth."""
    d, true = tlm.get(RECEIVER, MESSAGE), truth.get(RECEIVER, "TRUTH")
    if d is None or true is None:
        return None
    a = align(true.t_us, d.t_us)
    error = d["pos"][a.at].astype(np.float64) - a.of(true["xi"])
    pl, al = (np.nan_to_num(known(d[k][a.at]), nan=np.inf) for k in ("pl", "al"))
    return Judged(d.t_us[a.at], error, pl, al)


def figures(truth: Columns, tlm: Columns) -> Figures:
    """integrity.*: samples; per axis median and p95 of the level where there is one, its availability while there is a limit,
    samples misleading and hazardous, largest error over level; excluded_pct per source. {} without the message."""
    d = tlm.get(RECEIVER, MESSAGE)
    if d is None:
        return {}
    out: Figures = {"integrity.samples": len(d)}
    for i, source in enumerate(SOURCES):
        out[f"integrity.excluded_pct.{source}"] = float(100.0 * np.mean(d["excluded"] >> i & 1)) if len(d) else None
    out["integrity.undecided_pct"] = float(100.0 * np.mean(d["undecided"] != 0)) if len(d) else None
    pl, al = known(d["pl"]), known(d["al"])
    j = judge(truth, tlm)
    for i, axis in enumerate(XYZ):
        some = pl[:, i][np.isfinite(pl[:, i])]
        for key, q in (("median", 50), ("p95", 95)):
            out[f"integrity.pl_m.{key}.{axis}"] = float(np.percentile(some, q)) if len(some) else None
        limited = np.isfinite(al[:, i])
        within = pl[limited, i] <= al[limited, i]  # false of a level that is none
        out[f"integrity.available_pct.{axis}"] = float(100.0 * within.mean()) if limited.any() else None
        for key in ("misleading", "hazardous"):
            out[f"integrity.{key}.{axis}"] = None if j is None else int(getattr(j, key)[:, i].sum())
        share = np.empty(0) if j is None else j.size[:, i] / np.maximum(j.pl[:, i], 1e-9)
        out[f"integrity.error_over_pl_max.{axis}"] = float(share.max()) if len(share) else None
    return out
