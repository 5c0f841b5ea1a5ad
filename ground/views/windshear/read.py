"""The windshear mission's flights as arrays: estimate and truth at the estimate's times, the hazard index of both, the downburst.

The true hazard index takes the wind's change from one row of the truth to the next; a low-pass of it with the alerting's time
constant is what the index in the caution can be compared with, for in turbulence the raw one is all noise.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.icd.dialect import HOUSE, VALUES
from ground.align import align
from ground.columns import Columns, Table
from ground.run import names_of

Array = NDArray[np.float64]
G = 9.81
X, H, VA, GA, AL, Q, T, WX, WH, WXD, WHD, WXDD, WHDD, KL, KD = range(15)  # of WINDSHEAR_STATE.est
CAUTION, ABORT, ACCUSED = 1, 2, 4  # WINDSHEAR_STATE.alert
ESCAPE_PHASE, CLEAR_PHASE = VALUES["WKF_PHASE_WS_ESCAPE"], VALUES["WKF_PHASE_WS_CLEAR"]
LAYERS = 12.5  # ratio of the two heights of the downburst's profile, NASA TM-100632
DEFAULTS = {"caution_F": 0.12, "abort_F": 0.12, "caution_s": 1.5, "abort_s": 4.0}


LAWS, ESTIMATORS = HOUSE.words("WKF_WS_LAW"), HOUSE.words("WKF_WS_ESTIMATOR")


def has_windshear(tlm: Columns) -> bool:
    """Whether the run has a windshear mission."""
    return any(name == "WINDSHEAR_STATE" for _, name in tlm.tables)


def _toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text())
    except (OSError, ValueError):
        return {}


@dataclass(frozen=True)
class Downburst:
    """Oseguera and Bowles's downburst as the scenario's table has it, written anew from the report. Strength 0: none."""

    outflow_mps: float = 0.0
    radius_m: float = 915.0
    outflow_height_m: float = 46.0
    x_m: float = 0.0
    offset_m: float = 0.0

    def wind(self, x: Array, h: Array) -> tuple[Array, Array]:
        """Wind along x and up [m/s] at x, h [m]."""
        from scipy.optimize import brentq  # slow to import: only where there is a windshear flight

        top = self.outflow_height_m * (LAYERS - 1.0) / math.log(LAYERS)
        low = top / LAYERS
        a = brentq(lambda r: 2.0 * r * r + 1.0 - math.exp(r * r), 0.8, 1.5)  # radius of the largest outflow
        shape = (1.0 - math.exp(-a * a)) / (2.0 * a)
        largest = math.exp(-self.outflow_height_m / top) - math.exp(-self.outflow_height_m / low)
        rate = self.outflow_mps / (self.radius_m * shape * largest)
        d = np.asarray(x, dtype=np.float64) - self.x_m
        z = np.maximum(np.asarray(h, dtype=np.float64), 0.0)
        s = np.maximum((d * d + self.offset_m**2) / self.radius_m**2, 1e-9)
        along = 0.5 * rate * d * -np.expm1(-s) / s * (np.exp(-z / top) - np.exp(-z / low))
        up = -rate * np.exp(-s) * (-top * np.expm1(-z / top) + low * np.expm1(-z / low))
        return along, up


@dataclass(frozen=True)
class WindshearFlight:
    """One aircraft, N equal times. x: estimate [N,15], sigma [N,15]; true: the first nine of them and the pitch rate's place as
    in the estimate, thrust in kN; F [N] true hazard index; thresholds: [guid.hazard] of the flight file."""

    name: str
    t_us: NDArray[np.int64]
    state: Table  # WINDSHEAR_STATE
    x: Array
    sigma: Array
    true: Array  # [N,9]
    F: Array
    phase: NDArray[np.int64]  # WKF_PHASE
    valid: NDArray[np.bool_]
    burst: Downburst
    thresholds: dict[str, float]
    left_out: int = 0  # estimates without truth

    @property
    def t(self) -> Array:
        """Times [N] s."""
        return self.t_us.astype(np.float64) * 1e-6

    @property
    def dt(self) -> float:
        """Interval of the rows [s]."""
        return float(np.median(np.diff(self.t)))

    def low(self, tau_s: float) -> Array:
        """True hazard index [N] in a first-order low-pass, as the alerting takes its own."""
        a = -math.expm1(-self.dt / tau_s)
        return np.fromiter(accumulate(self.F.tolist(), lambda low, f: low + a * (f - low), initial=0.0), float)[1:]

    def first(self, mask: NDArray[np.bool_]) -> int:
        """First row where `mask` holds, -1: none."""
        return int(np.argmax(mask)) if mask.any() else -1

    @property
    def abort(self) -> int:
        """Row of the escape's begin, -1: none."""
        return self.first((self.phase == ESCAPE_PHASE) | (self.phase == CLEAR_PHASE))


def names(run: Path, tlm: Columns) -> dict[int, str]:
    """Aircraft of the run that fly the windshear mission: system id -> name."""
    return names_of(run, [s for s in tlm.sysids() if tlm.get(s, "WINDSHEAR_STATE") is not None])


def _burst(run: Path, name: str) -> Downburst:
    for a in _toml(run / "scenario.toml").get("aircraft", []):
        if a.get("name") == name:
            table = a.get("plant", {}).get("burst", {})
            return Downburst(**{k: float(v) for k, v in table.items() if k in Downburst.__dataclass_fields__})
    return Downburst()


def _thresholds(run: Path, name: str) -> dict[str, float]:
    hazard = _toml(run / f"flight_{name}.toml").get("guid", {}).get("hazard", {})
    return {k: float(hazard.get(k, v)) for k, v in DEFAULTS.items()}


def flights(run: Path, truth: Columns, tlm: Columns) -> list[WindshearFlight]:
    """Every aircraft of the run with estimate and truth, by system id."""
    out = []
    for sysid, name in names(run, tlm).items():
        state, true, mission = (
            tlm.get(sysid, "WINDSHEAR_STATE"),
            truth.get(sysid, "TRUTH"),
            tlm.get(sysid, "MISSION_STATUS"),
        )
        if state is None or true is None:
            continue
        a = align(true.t_us, state.t_us)
        if len(a) < 3:
            continue
        known, F = _known(true)
        state = state.pick(a.at)
        t_us = state.t_us
        phase = np.zeros(len(a), dtype=np.int64)
        if mission is not None and len(mission.t_us):
            at = np.searchsorted(mission.t_us, t_us, side="right") - 1
            phase = np.where(at >= 0, mission["phase"][np.maximum(at, 0)], 0).astype(np.int64)
        x, sigma = (state[k].astype(np.float64) for k in ("est", "sigma"))
        out.append(
            WindshearFlight(
                name,
                t_us,
                state,
                x,
                sigma,
                a.of(known),
                a.of(F),
                phase,
                state["valid"] != 0,
                _burst(run, name),
                _thresholds(run, name),
                a.left_out,
            )
        )
    return out


def _known(true: Table) -> tuple[Array, Array]:
    """Truth [N,9] in the order of the estimate, and the hazard index [N]."""
    v, w = true["vel_n"].astype(np.float64), true["wind_n"].astype(np.float64)
    q = true["q_nb"].astype(np.float64)
    psi = np.arctan2(2.0 * (q[:, 0] * q[:, 3] + q[:, 1] * q[:, 2]), 1.0 - 2.0 * (q[:, 2] ** 2 + q[:, 3] ** 2))
    c, s = np.cos(psi), np.sin(psi)
    along, up = c * w[:, 0] + s * w[:, 1], -w[:, 2]
    speed = true["V"].astype(np.float64)
    path = np.arctan2(-v[:, 2] - up, c * v[:, 0] + s * v[:, 1] - along)
    p = true["pos_n"]
    known = np.stack(
        [
            c * p[:, 0] + s * p[:, 1], -p[:, 2], speed, path, true["alpha"], true["w_b"][:, 1], true["controls"][:, 3] * 1e-3,
            along, up,
        ], axis=1,
    ).astype(np.float64)  # fmt: skip
    t = true.t_us * 1e-6
    rates = np.stack([np.diff(k, append=k[-1:]) / np.diff(t, append=t[-1] + 1.0) for k in (along, up)])
    return known, (rates[0] * np.cos(path) + rates[1] * np.sin(path)) / G - up / speed
