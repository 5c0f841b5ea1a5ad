"""The gust mission's flights as arrays: estimate and truth at the estimate's times, for figures and pictures.

Truth of alpha_W is the down wind over the trim speed, truth of the vane bias what the scenario's events added, a_z the mean
upward acceleration from one row of the truth to the next. Truth that the run folder does not hold is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.icd.dialect import HOUSE
from ground.align import align
from ground.columns import Columns, Table, load
from ground.run import names_of
from ground.whole import scenario

Array = NDArray[np.float64]
BAND_HZ = 2.0
AW, VW, AB = 1, 2, 8  # of GUST_STATE.est
HOLD = 0  # WKF_GUST_LAW
PASSING = (
    "off",
    "dropout",
    "intermittent",
    "spike",
)  # faults that take readings away or spoil one, and leave the others true
SHOWN = {"alpha_w": AW, "v_w": VW, "bias": AB}


LAWS, ESTIMATORS = HOUSE.words("WKF_GUST_LAW"), HOUSE.words("WKF_GUST_ESTIMATOR")


def has_gust(tlm: Columns) -> bool:
    """Whether the run has a gust mission."""
    return any(name == "GUST_STATE" for _, name in tlm.tables)


def names(run: Path, tlm: Columns) -> dict[int, str]:
    """Aircraft of the run that fly the gust mission: system id -> name."""
    return names_of(run, [s for s in tlm.sysids() if tlm.get(s, "GUST_STATE") is not None])


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
    left_out: int = 0  # estimates without truth

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
        from scipy import signal  # slow to import: only where there is a gust flight

        if len(self.t_us) < 32:
            return np.zeros(len(self.t_us))
        rate = 1e6 / float(np.median(np.diff(self.t_us)))
        if rate <= 2.0 * BAND_HZ:
            return self.a_z
        sos = signal.butter(4, BAND_HZ, fs=rate, output="sos")
        return np.asarray(signal.sosfiltfilt(sos, self.a_z))


def trim_speed(sc: dict[str, Any], name: str) -> float:
    """Airspeed [m/s] of an aircraft's start, which is its model's trim; NaN where the scenario does not say."""
    start: dict[str, Any] = next((a.get("start", {}) for a in sc.get("aircraft", []) if a.get("name") == name), {})
    return float(start.get("V_mps", np.nan))


def vane_bias(sc: dict[str, Any], name: str, t: Array, injected_s: float = np.inf) -> Array:
    """Bias [rad] at times t [s] that the scenario's events put on the vane of an aircraft (its first probe).

    NaN where no record says what it was: all the time if the sensors draw one of their own, while a fault other than a bias or a
    drift falsifies the vane (PASSING ones do not), and from injected_s [s], the first failure injected.
    """
    noise, suite = sc.get("noise", {}), sc.get("sensors", {}).get(name, {})
    drawn = suite.get("air", {}).get("alpha_bias_std", 1.0) * noise.get("bias_scale", 1.0)
    out = np.full(len(t), np.nan if drawn else 0.0)
    for e in sc.get("event", []):
        if (e.get("target"), e.get("sensor")) != (name, "air") or e.get("kind") in PASSING:
            continue
        if e.get("channel", "") not in ("", "alpha") or e.get("index", -1) > 0:
            continue
        length = float(e.get("for_s", 0.0)) or np.inf
        on = (t >= e["t_s"] - 1e-9) & (t < e["t_s"] + length)
        value = e.get("value", [])
        size = float(value[min(1, len(value) - 1)]) if value else np.nan  # alone, or V, alpha, beta
        out[on] += {"bias": size, "drift": size * (t[on] - e["t_s"])}.get(e.get("kind"), np.nan)
    out[t >= injected_s] = np.nan
    return out


def injected_s(run: Path, sysid: int) -> float:
    """Time [s] of the first failure the plant was made to give an aircraft in flight, from plant.tlog; inf without any."""
    path = run / "plant.tlog"
    acks = load(path).get(sysid, "COMMAND_ACK") if path.exists() else None
    done = acks.t_us[acks["result"] == 0] if acks is not None else []
    return float(min(done)) * 1e-6 if len(done) else np.inf


def flights(run: Path, truth: Columns, tlm: Columns) -> list[GustFlight]:
    """Every aircraft of the run with estimate and truth, by system id."""
    sc, out = scenario(run), []
    for sysid, name in names(run, tlm).items():
        state, true = tlm.get(sysid, "GUST_STATE"), truth.get(sysid, "TRUTH")
        if state is None or true is None:
            continue
        a = align(true.t_us, state.t_us)
        if len(a) < 3:
            continue
        climb = -true["vel_n"][:, 2]
        rise = np.diff(climb) / np.diff(true.t_us * 1e-6)
        up = np.append(rise, rise[-1])[a.left]
        true, state = a.table(true), state.pick(a.at)
        t = true.t_us.astype(np.float64) * 1e-6
        q = true["q_nb"].astype(np.float64)
        psi = np.arctan2(2.0 * (q[:, 0] * q[:, 3] + q[:, 1] * q[:, 2]), 1.0 - 2.0 * (q[:, 2] ** 2 + q[:, 3] ** 2))
        tail = np.cos(psi) * true["wind_n"][:, 0] + np.sin(psi) * true["wind_n"][:, 1]
        bias = vane_bias(sc, name, t, injected_s(run, sysid))
        known = np.stack([true["wind_n"][:, 2] / trim_speed(sc, name), tail, bias], axis=1)
        columns = [AW, VW, AB]
        est, sigma = (state[k][:, columns].astype(np.float64) for k in ("est", "sigma"))
        out.append(GustFlight(name, true.t_us, state, true, est, sigma, known, state["valid"] != 0, up, a.left_out))
    return out
