"""The gust mission's flights as arrays: estimate and truth at equal times, for figures and pictures.

Truth of alpha_W is the down wind over the trim speed, truth of the vane bias what the scenario's events added, a_z the mean
upward acceleration from one row of the truth to the next.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from flightsw.icd import mav
from ground.columns import Columns, Table, match

Array = NDArray[np.float64]
V0 = 20.0  # [m/s] trim speed of the small UAV
BAND_HZ = 2.0
AW, VW, AB = 1, 2, 8  # of GUST_STATE.est
HOLD = 0  # WKF_GUST_LAW
SHOWN = {"alpha_w": AW, "v_w": VW, "bias": AB}


def _names(enum: str, prefix: str) -> dict[int, str]:
    return {
        v: e.name.removeprefix(prefix).lower() for v, e in mav.enums[enum].items() if not e.name.endswith("ENUM_END")
    }


LAWS = _names("WKF_GUST_LAW", "WKF_GUST_LAW_")
ESTIMATORS = _names("WKF_GUST_ESTIMATOR", "WKF_GUST_ESTIMATOR_")


def has_gust(tlm: Columns) -> bool:
    """Whether the run has a gust mission."""
    return any(name == "GUST_STATE" for _, name in tlm.tables)


def scenario(run: Path) -> dict[str, Any]:
    """The run's scenario.toml, {} without a readable one."""
    try:
        return tomllib.loads((run / "scenario.toml").read_text())
    except (OSError, ValueError):
        return {}


def names(run: Path, tlm: Columns) -> dict[int, str]:
    """Aircraft of the run that fly the gust mission: system id -> name."""
    known = {int(a.get("sysid", 0)): str(a["name"]) for a in scenario(run).get("aircraft", []) if "name" in a}
    return {s: known.get(s, f"uav{s}") for s in tlm.sysids() if tlm.get(s, "GUST_STATE") is not None}


@dataclass(frozen=True)
class GustFlight:
    """One aircraft, N equal times. est, sigma, truth: columns alpha_W [rad], V_W [m/s], vane bias [rad]."""

    name: str
    t_us: NDArray[np.int64]
    state: Table  # GUST_STATE
    true: Table  # TRUTH
    est: Array  # [N,3]
    sigma: Array  # [N,3]
    truth: Array  # [N,3]
    valid: NDArray[np.bool_]
    a_z: Array  # [N] m/s^2

    @property
    def t(self) -> Array:
        """Times [N] s."""
        return self.t_us.astype(np.float64) * 1e-6

    @property
    def law(self) -> NDArray[Any]:
        """Law in force [N]."""
        return np.asarray(self.state["law"])

    def low(self) -> Array:
        """a_z [N] below 2 Hz (fourth-order Butterworth, both ways); zero where the flight is too short for it."""
        if len(self.t_us) < 32:
            return np.zeros(len(self.t_us))
        rate = 1e6 / float(np.median(np.diff(self.t_us)))
        if rate <= 2.0 * BAND_HZ:
            return self.a_z
        sos = signal.butter(4, BAND_HZ, fs=rate, output="sos")
        return np.asarray(signal.sosfiltfilt(sos, self.a_z))


def vane_bias(sc: dict[str, Any], name: str, t: Array) -> Array:
    """Bias [rad] at times t [s] that the scenario's events put on the vane of an aircraft."""
    out = np.zeros(len(t))
    for e in sc.get("event", []):
        if (e.get("kind"), e.get("target"), e.get("sensor"), e.get("channel")) != ("bias", name, "air", "alpha"):
            continue
        length = float(e.get("for_s", 0.0)) or np.inf
        on = (t >= e["t_s"] - 1e-9) & (t < e["t_s"] + length)
        out[on] += float(e["value"][0])
    return out


def flights(run: Path, truth: Columns, tlm: Columns) -> list[GustFlight]:
    """Every aircraft of the run with estimate and truth, by system id."""
    sc, out = scenario(run), []
    for sysid, name in names(run, tlm).items():
        state, true = tlm.get(sysid, "GUST_STATE"), truth.get(sysid, "TRUTH")
        if state is None or true is None:
            continue
        i, j = match(true.t_us, state.t_us)
        if len(i) < 3:
            continue
        climb = -true["vel_n"][:, 2]
        rise = np.diff(climb) / np.diff(true.t_us * 1e-6)
        up = np.append(rise, rise[-1])[i]
        true, state = true.pick(i), state.pick(j)
        t = true.t_us.astype(np.float64) * 1e-6
        forward = true["vel_n"][:, :2] / np.maximum(np.linalg.norm(true["vel_n"][:, :2], axis=1, keepdims=True), 1e-9)
        tail = (forward * true["wind_n"][:, :2]).sum(axis=1)
        known = np.stack([true["wind_n"][:, 2] / V0, tail, vane_bias(sc, name, t)], axis=1)
        columns = [AW, VW, AB]
        est, sigma = (state[k][:, columns].astype(np.float64) for k in ("est", "sigma"))
        out.append(GustFlight(name, true.t_us, state, true, est, sigma, known, state["valid"] != 0, up))
    return out
