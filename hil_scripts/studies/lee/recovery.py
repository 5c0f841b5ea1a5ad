"""Q of an estimator tuned after loop transfer recovery, Lee (2011) (4.5): Q = Q_1 + q^2 B B^T, on the linear tanker in its loop.

The loop is that of (2.38), (2.39): gains on nine states (heading, north and east bear on none of them) and on the integrals of
the errors of speed, height and turn rate, (2.37). The estimator is the steady filter of (4.4) with the readings of (4.8), in
continuous time, without servos. Doyle and Stein, Robustness with observers (1979): as q grows, the loop broken at the plant's
input becomes that of full state feedback.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov

from flightsw.sixdof.autopilot import KEEP
from flightsw.sixdof.layout import NX, WIND, X_PSI, X_V, X_Z
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.lee import flight as fl
from hil_scripts.studies.lee.linear import Q_WIND, READ, Tanker, tanker
from hil_scripts.studies.lee.printed_filter import free_wind
from hil_scripts.studies.lee.study import filters

Array = np.ndarray
FED = np.array(KEEP)  # states fed back
INPUTS = ("aileron", "elevator", "rudder", "thrust")
ROOTS = (0.0, 0.01, 0.1, 0.3, 1.0, 10.0, 100.0, 1000.0)  # q, per sqrt(s)
GRID = np.logspace(-5.0, 3.0, 1200)  # [rad/s]
STEPS = 121  # points of a first look at gains and phases


def _turned(deg: float) -> complex:
    return complex(np.exp(-1j * np.radians(deg)))


def _scaled(db: float) -> complex:
    return complex(10.0 ** (db / 20.0))


# margin: how far it is looked for, and the factor at the input
SCANS = {"phase_margin_deg": (180.0, _turned), "gain_up_db": (60.0, _scaled), "gain_down_db": (-60.0, _scaled)}


@dataclass(frozen=True)
class Open:
    """A loop broken at the plant's input: from what enters the plant to minus what the law asks, K (sI - A)^-1 B, all inputs in
    units of their weights."""

    A: Array
    B: Array
    K: Array

    def closed(self, factor: Array) -> Array:
        """State matrix of the closed loop with factor [4] (complex: a phase) at each input."""
        return np.asarray(self.A - self.B @ np.diag(factor) @ self.K)

    def response(self, w: Array) -> Array:
        """[k,4,4] at frequencies w [k] rad/s."""
        eye = np.eye(len(self.A))
        return np.asarray(self.K @ np.linalg.solve(1j * w[:, None, None] * eye - self.A, self.B[None].astype(complex)))


class Loop:
    """The tanker, its law and the choices of (4.5)."""

    def __init__(self, t: Tanker) -> None:
        """Weights are those the tanker of the studies flies with. Raises LinAlgError."""
        p = fl.LAW
        self.t, self.size = t, np.array(p.w_input)
        self.B = t.B * self.size
        self.C_e = np.zeros((3, NX))
        self.C_e[0, X_V] = self.C_e[1, X_Z] = 1.0
        self.C_e[2] = t.A[X_PSI]  # rate of heading
        n = len(FED)
        A, B = np.zeros((n + 3, n + 3)), np.zeros((n + 3, len(INPUTS)))
        A[:n, :n], A[n:, :n], B[:n] = t.A[np.ix_(FED, FED)], self.C_e[:, FED], self.B[FED]
        q = 1.0 / np.square([*p.w_air, *p.w_rate_radps, *p.w_att_rad, p.w_alt_m, *p.w_int])
        self.full = Open(A, B, B.T @ solve_continuous_are(A, B, np.diag(q), np.eye(len(INPUTS))))

    def gain(self, Q: Array, R: Array) -> tuple[Array, Array]:
        """Gain and covariance [15,15] of the steady filter; Q, R [15,15] densities per second of process and readings (4.8)."""
        # units in which the numbers are of one size
        s = np.concatenate((np.sqrt(np.diag(R)[:READ]), np.ones(NX - READ)))
        d = np.sqrt(np.diag(R))
        A, C = self.t.A * s / s[:, None], np.diag(s / d)
        P = solve_continuous_are(A.T, C.T, Q / np.outer(s, s), R / np.outer(d, d)) * np.outer(s, s)
        return np.linalg.solve(R, P).T, P

    def estimated(self, L: Array) -> Open:
        """The loop on estimates of gain L [15,15]: fed states, integrals, and the estimator's error [15]."""
        n, k = len(FED), len(self.full.A)
        A, B = np.zeros((k + NX, k + NX)), np.vstack((self.full.B, self.B))
        K = np.hstack((self.full.K, np.zeros((len(INPUTS), NX))))
        K[:, k + FED] = -self.full.K[:, :n]  # the estimate is the state less its error
        A[:k, :k] = self.full.A
        A[n:k, k:] = -self.C_e
        A[k:, k:] = self.t.A - L
        A[k:] += self.B @ K  # the estimator is told what the law asks, the plant what enters it
        return Open(A, B, K)


def margins(loop: Open) -> dict[str, float]:
    """Least singular value of I + L [-]; of each input with the others closed: gain margins up and down [dB], phase margin [deg].

    Gain and phase by the closed loop's poles, the phase the lesser of lead and lag; infinite: none within the range looked at.
    """
    L = loop.response(GRID)
    out = {"return_difference": float(np.linalg.svd(np.eye(len(INPUTS)) + L, compute_uv=False)[:, -1].min())}
    for i, name in enumerate(INPUTS):
        for margin, (end, factor) in SCANS.items():
            out[f"{name}.{margin}"] = _first(loop, i, factor, end)
    return out


def _first(loop: Open, i: int, factor: Callable[[float], complex], end: float) -> float:
    """Where from 0 to end the loop with `factor` at input i is first not stable, to a thousandth; infinite if it always is."""
    each = np.ones(len(INPUTS), complex)

    def stable(v: float) -> bool:
        each[i] = factor(v)
        return bool(np.linalg.eigvals(loop.closed(each)).real.max() < 0.0)

    points = [float(v) for v in np.linspace(0.0, end, STEPS)]
    k = next((k for k, v in enumerate(points) if not stable(v)), 0)
    if k == 0:
        return float(np.copysign(np.inf, end))
    low, high = points[k - 1], points[k]
    while abs(high - low) > 1e-3:
        mid = 0.5 * (low + high)
        low, high = (mid, high) if stable(mid) else (low, mid)
    return high


def readings(t: Tanker, sigma: Array) -> tuple[Array, Array]:
    """Densities R [15,15] of (4.8), states and calculated wind, per second: as they are, and as the filter takes them.

    sigma [15]: readings and inertial velocity. The wind's share of the states' noise (erratum E19) is left out by the filter.
    """
    z = np.concatenate((t.x[:READ], t.A[READ - 3 : READ, X_V] * t.x[X_V]))
    J = np.zeros((NX, NX))
    J[:READ, :READ] = np.eye(READ)
    J[READ:] = np.array([(free_wind(*_halves(z + e)) - free_wind(*_halves(z - e))) / 2e-4 for e in 1e-4 * np.eye(NX)]).T
    R = fl.DT * J @ np.diag(np.square(sigma)) @ J.T
    return R, np.diag(np.diag(R))


def _halves(z: Array) -> tuple[Array, Array]:
    return z[:READ], z[READ:]


def initial(t: Tanker, sigma: Array, exact: bool) -> Array:
    """Q_1 [15,15] per second: of the wind and little else, or the diagonal that flies as printed in study lee."""
    p = filters(sigma, "ecwm", 0.0)["random_walk" if exact else "printed"]
    wind = 0.0 if exact else p.q_wind
    air = (p.q_V, p.q_beta, p.q_alpha)
    Q = np.diag(np.square([*air, *[p.q_rate] * 3, *[p.q_euler] * 3, *[p.q_pos] * 3, *[wind] * 3]))
    return Q + p.q_wind**2 * t.G @ t.G.T if exact else Q


def run_recovery(case: Case, seed: int) -> RunResult:
    """Margins, error of the wind, and what noise of the readings does to the commands, for full state feedback and each q."""
    p = case.params
    loop = Loop(tanker())
    t, sigma = loop.t, fl.LARGE if p["noise"] == "large" else fl.SMALL
    R, assumed = readings(t, sigma)
    Q_1 = initial(t, sigma, bool(p.get("exact")))
    B = t.B if p.get("units") else loop.B
    wind = Q_WIND**2 * t.G @ t.G.T
    values = {f"full.{k}": v for k, v in margins(loop.full).items()}
    for q in ROOTS:
        L, P = loop.gain(Q_1 + q * q * B @ B.T, assumed)
        est = loop.estimated(L)
        found: dict[str, float] = margins(est)
        true = solve_continuous_lyapunov(t.A - L, -(wind + L @ R @ L.T))
        for i, a in enumerate("ned"):
            k = WIND.start + i
            found |= {f"wind.rms_mps.{a}": float(np.sqrt(true[k, k])), f"wind.sigma_mps.{a}": float(np.sqrt(P[k, k]))}
        found["wind.error_mps"] = float(np.sqrt(np.trace(true[WIND, WIND])))
        # the estimator's error alone carries the readings' noise into the loop
        into = np.vstack((np.zeros((len(loop.full.A), NX)), L))
        X = solve_continuous_lyapunov(est.closed(np.ones(len(INPUTS))), -into @ R @ into.T)
        rms = np.sqrt(np.diag(est.K @ X @ est.K.T)) * loop.size
        found |= {f"{n}.noise_rms_deg": float(np.degrees(v)) for n, v in zip(INPUTS[:3], rms[:3], strict=True)}
        found["thrust.noise_rms_n"] = float(rms[3])
        values |= {f"{name(q)}.{k}": v for k, v in found.items()}
    return RunResult(values)


def name(q: float) -> str:
    """Key of a q, for example q_0p1."""
    return f"q_{q:g}".replace(".", "p")


def _case(label: str, **params: Any) -> Case:
    return Case(label, params)


STUDY = Study(
    name="lee_recovery",
    title="Loop transfer recovery",
    purpose="Q = Q_1 + q^2 B B^T, Lee (2011) (4.5), on the linear tanker in its loop: margins at the plant's input against those "
    "of full state feedback, error of the wind, and noise in the commands; Q_1 as flown as printed, or that of the wind; B in "
    "units of the law's weights, or in rad and N",
    cases=(
        _case("small", noise="small"),
        _case("large", noise="large"),
        _case("small_wind", noise="small", exact=True),
        _case("large_wind", noise="large", exact=True),
        _case("large_units", noise="large", units=True),
    ),
    run=run_recovery,
    default_runs=1,
)
