"""A correction of the square-root filter and the gate's judgement of it in one compiled call."""

from __future__ import annotations

from typing import Any

import numpy as np

from flightsw import refusal as rd
from flightsw.filters.group_gate import WEIGHT, sift
from flightsw.filters.srukf import SquareRootUKF, correct
from flightsw.kernels.jit import jit
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.layout import X_V

# what a step that is one compiled call ends with: all is done; the gate finds something out of the ordinary; the filter itself
# refuses the correction; the estimate has left its domain
DONE, UNUSUAL, REFUSED, LOST = range(4)
# its first outputs: rows used, probes averaged, one of those, what `sift` returned, NIS, density [kg/m^3]; the estimator's own
O_M, O_PROBES, O_END, O_SIFTED, O_NIS, O_RHO, O_X = range(7)


def whole(
    c: TrustedCore, W: np.ndarray, R: np.ndarray, fm: np.ndarray, d: np.ndarray, out: np.ndarray
) -> tuple[Any, ...]:
    """What both estimators' steps in one call are given of a core with a square-root filter and a gate, in the kernels' order; W
    [5,15] workspace, R, fm [9], d [15] the estimator's attitude, specific force and rates, out its outputs. All but the numbers
    at the end are the owners' own arrays."""
    ukf, gate, (was_x, was_S) = c.ukf, c.refusals, c.before()
    assert isinstance(ukf, SquareRootUKF) and gate is not None
    return (
        c.tune, c.P, c.probe_pos, *ukf.arrays(), was_x, was_S, c.noise, c.wind_jacobian, W, R, fm, d, c.w_air, c.air, *c.rows,
        *gate.gate.arrays(), out, *ukf.scaling, gate.gate.limit2, gate.gate.watched, c.p.correlated_wind,
    )  # fmt: skip


@jit
def judged(
    now: float, taking: bool, limit2: float, watched: int, m: int, w0m: float, w0c: float, wi: float,
    X: np.ndarray, Y: np.ndarray, y: np.ndarray, r: np.ndarray, x: np.ndarray, S: np.ndarray,
    nu: np.ndarray, K: np.ndarray, Sy: np.ndarray, A: np.ndarray, B: np.ndarray, D: np.ndarray,
    was_x: np.ndarray, was_S: np.ndarray, group: np.ndarray, slack: np.ndarray,
    st: np.ndarray, bad: np.ndarray, var: np.ndarray, channel: np.ndarray, keep: np.ndarray,
) -> tuple[float, int, int]:  # fmt: skip
    """As TrustedCore.update with a gate: was_x [n], was_S [n,n] <- the estimate before; `correct`; then the gate's `sift`, with
    the airspeed making gusts of flow angles. Returns NIS, what sift returns, and DONE, UNUSUAL or REFUSED.

    now [us]; other arguments as correct and sift.
    """
    for i in range(x.shape[0]):
        was_x[i] = x[i]
        for j in range(x.shape[0]):
            was_S[i, j] = S[i, j]
    nis = correct(X, Y, y, r, m, w0m, w0c, wi, x, S, nu, K, Sy, A, B, D)
    if nis < 0.0:
        return nis, 0, REFUSED
    speed = x[X_V]
    if speed < 1.0:  # of no number nothing is made
        speed = 1.0
    st[rd.BETA, WEIGHT] = st[rd.ALPHA, WEIGHT] = speed
    n = sift(group, nu, Sy, slack, m, now, limit2, watched, taking, st, bad, var, channel, keep)
    return nis, n, DONE if n >= 0 else UNUSUAL
