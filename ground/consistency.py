"""Whether published 1-sigma values tell the truth (nees.*), what navigation refused (nav.*), when the tanks ran dry (run.*)."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft, load_airframe
from flightsw.strict import ConfigError
from ground.align import align
from ground.columns import Columns, Table
from ground.geometry import quat_euler, wrap
from ground.run import Run
from ground.views.base import Figures

SETTLE_S = 60.0  # [s] the figures start here
AXES_NEES = ("position", "attitude")  # of nees.<aircraft>
DRY_KG = 0.01  # [kg] single-precision mass of a heavy aircraft
Pairs = tuple[Table, Table]
Array = NDArray[np.float64]


def nees(error: Array, sigma: Array) -> float | None:
    """Mean of (error / sigma)^2 over samples and axes, both (n,3): 1 for a sigma that tells the truth, whatever the correlations.

    Samples without a sigma are left out; None when none is left.
    """
    known = (sigma > 0.0).all(axis=1)
    if not known.any():
        return None
    return float(np.mean((error[known] / sigma[known].astype(np.float64)) ** 2))


def pairs(truth: Columns, tlm: Columns, sysid: int, message: str) -> Pairs | None:
    """Rows of TRUTH and of an estimate at equal times after SETTLE_S; those marked invalid are left out."""
    true, hat = truth.get(sysid, "TRUTH"), tlm.get(sysid, message)
    if true is None or hat is None:
        return None
    if "valid" in (hat.rows.dtype.names or ()):
        hat = hat.pick(hat["valid"] != 0)
    hat = hat.pick(hat.t_us >= SETTLE_S * 1e6)
    a = align(true.t_us, hat.t_us)
    return (a.table(true), hat.pick(a.at)) if len(a) else None


def consistency_figures(run: Run, crafts: Mapping[int, str]) -> Figures:
    """nees.<aircraft>.position, attitude of those that publish NAV_STATE; None where one has no samples."""
    out: Figures = {}
    for sysid, name in crafts.items():
        if run.tlm.get(sysid, "NAV_STATE") is None:
            continue
        out |= {f"nees.{name}.{k}": None for k in AXES_NEES}
        nav, local = pairs(run.truth, run.tlm, sysid, "NAV_STATE"), run.tlm.get(sysid, "LOCAL_POSITION_NED")
        if nav is None:
            continue
        true, hat = nav
        euler = np.stack([hat[k].astype(np.float64) for k in ("psi", "theta", "phi")], axis=1)
        out[f"nees.{name}.attitude"] = nees(wrap(euler - quat_euler(true["q_nb"])), hat["att_sigma"])
        if local is not None:
            a = align(local.t_us, hat.t_us)
            at = np.stack([a.of(local[k].astype(np.float64)) for k in "xyz"], axis=1)
            out[f"nees.{name}.position"] = nees(at - true["pos_n"][a.at], hat["pos_sigma"][a.at])
    return out


def refusal_figures(run: Run, crafts: Mapping[int, str]) -> Figures:
    """nav.<aircraft>.refused: readings that navigation refused; nav.<aircraft>.kept_out_s: time with a sensor kept out; of those
    that publish NAV_STATE."""
    out: Figures = {}
    for sysid, name in crafts.items():
        health = run.tlm.get(sysid, "HEALTH_STATUS")
        if health is not None and len(health) and run.tlm.get(sysid, "NAV_STATE") is not None:
            step = float(np.median(np.diff(health.t_us))) * 1e-6 if len(health) > 1 else 0.0
            out[f"nav.{name}.refused"] = int(health["refused"][-1].sum())
            out[f"nav.{name}.kept_out_s"] = float((health["kept_out"] != 0).sum()) * step
    return out


def fuel_metrics(run: Path, truth: Columns) -> Figures:
    """run.fuel_exhausted_s.<aircraft>: when the tanks ran dry, None if they did not; {} where the run's scenario is not known."""
    try:
        crafts = tomllib.loads((run / "scenario.toml").read_text())["aircraft"]
    except (OSError, KeyError, tomllib.TOMLDecodeError):
        return {}
    out: Figures = {}
    for craft in crafts:
        try:
            true, name, ac = truth.get(int(craft["sysid"]), "TRUTH"), craft["name"], load_airframe(craft["file"])
        except (KeyError, ConfigError):
            continue
        if true is None or not isinstance(ac, Aircraft):
            continue
        dry = np.flatnonzero(true["mass"] <= ac.mass.empty_kg + DRY_KG)
        out[f"run.fuel_exhausted_s.{name}"] = float(true.t_us[dry[0]]) * 1e-6 if len(dry) else None
    return out
