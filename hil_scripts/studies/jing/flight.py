"""One approach of the twin-jet through wind shear: plant, estimator, guidance and control in one loop, on record."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import twinjet
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear import monitor_kernel as kk
from flightsw.missions.windshear.continuous import make_nav
from flightsw.missions.windshear.control import NidParams, WindshearControl
from flightsw.missions.windshear.estimator import ALL, WindshearNav, WindshearParams, start_sigma
from flightsw.missions.windshear.guidance import PHASES, WindshearGuidance, WindshearGuidanceParams
from flightsw.missions.windshear.monitor import WindshearMonitor
from sim_plant.aircraft.twinjet.flight import TwinJet, TwinJetAir, TwinJetParams
from sim_plant.rng import generator

Arr = NDArray[np.float64]
DT = 0.02
ESCAPE = PHASES.index("escape")
GRAVITY = twinjet().air.gravity_mps2


@dataclass(frozen=True)
class FlightPlan:
    """What is flown. nav None: perfect state. feedback "monitor": the kinematic filter steers, its missing states dead-reckoned.

    start: "drawn" (mean off by a draw of the filter's own start covariance), "exact", "cold" (from the first readings).
    clear_s: the flight ends this long after it is clear and 60 m high, climbing (0: flies on).
    """

    air: TwinJetAir
    plant: TwinJetParams = field(default_factory=TwinJetParams)
    nav: WindshearParams | None = None
    guidance: WindshearGuidanceParams = field(default_factory=WindshearGuidanceParams)
    control: NidParams = field(default_factory=NidParams)
    duration_s: float = 110.0
    start: str = "drawn"
    feedback: str = "nav"
    monitor: bool = False
    clear_s: float = 0.0


@dataclass
class Flight:
    """Record at DT: truth [N,15], estimate [N,15], sigma [N,15], NIS per reading [N], F true and estimated [N], quick and slow
    low-pass of it [N], phase [N], controls [N,2] (kN, rad), monitor's state [N,10] and sigma. lost: ground contact."""

    truth: Arr
    x: Arr
    sigma: Arr
    nis: Arr
    F: Arr
    F_hat: Arr
    quick: Arr
    slow: Arr
    phase: NDArray[np.int64]
    u: Arr
    monitor: Arr
    monitor_sigma: Arr
    lost: bool = False
    monitor_apart: bool = False
    cautions: int = 0
    restarts: int = 0  # of the estimator

    @property
    def t(self) -> NDArray[Any]:
        """Times [N] s."""
        return np.arange(len(self.truth)) * DT

    def first(self, mask: NDArray[np.bool_]) -> int:
        """First index where `mask` holds, -1: nowhere."""
        return int(np.argmax(mask)) if mask.any() else -1

    @property
    def abort_index(self) -> int:
        """Sample of the abort, -1: none."""
        return self.first(self.phase >= ESCAPE)

    def cut(self, n: int) -> None:
        """Keep the first n samples."""
        for name, v in list(vars(self).items()):
            if isinstance(v, np.ndarray):
                setattr(self, name, v[:n])


def true_state(truth: Arr, out: Arr) -> None:
    """out [15] <- the estimators' state from the plant's truth [11]; second rates of the wind are left at zero, scales at one."""
    out[: k.WXDD] = truth
    out[k.T] *= 1e-3
    out[k.WXDD : k.KL] = 0.0
    out[k.KL] = out[k.KD] = 1.0


def true_F(truth: Arr) -> Arr:
    """Hazard index of truth rows [N,>=11], by the energy it costs (seed (8))."""
    return (truth[:, 9] * np.cos(truth[:, 3]) + truth[:, 10] * np.sin(truth[:, 3])) / GRAVITY - truth[:, 8] / truth[
        :, 2
    ]


class _Reckoned:
    """State [15] out of the kinematic filter: thrust by its lag, position by its speed, pitch rate as read."""

    def __init__(self, x0: Arr, nav: WindshearParams) -> None:
        self.x, self._tau = x0.copy(), twinjet().engine.lag_s
        self.x[k.KL], self.x[k.KD] = nav.lift_scale, nav.drag_scale

    def step(self, m: Arr, z: Arr, u: Arr) -> Arr:
        """The state [15] after a sample: m the kinematic filter's mean, readings z [>=6], controls u [2] in force."""
        x = self.x
        vx, vh = m[kk.K_VX] - m[kk.K_WX], m[kk.K_VH] - m[kk.K_WH]
        x[k.X] += DT * m[kk.K_VX]
        x[k.H], x[k.VA], x[k.GA] = m[kk.K_H], math.hypot(vx, vh), math.atan2(vh, vx)
        x[k.AL], x[k.Q] = m[kk.K_TH] - x[k.GA], z[k.Y_Q]
        x[k.T] += (u[0] - x[k.T]) * -math.expm1(-DT / self._tau)
        x[k.WX : k.KL] = m[kk.K_WX :]
        return x


class Loop:
    """A flight that can be stopped, copied and flown on with another escape law: what came before the abort is the same."""

    def __init__(self, plan: FlightPlan, seed: int) -> None:
        """On the slope at the start, nothing flown yet."""
        self.plan, self.i = plan, 0
        self.jet = TwinJet(plan.plant, plan.air, seed, plan.duration_s, DT)
        self.n = n = self.jet.samples - 1
        none = [np.full(n, np.nan) for _ in range(5)]
        wide = [np.full((n, m), np.nan) for m in (15, 15, kk.NK, kk.NK)]
        self.r = Flight(
            np.zeros((n, 15)), wide[0], wide[1], none[0], none[1], none[2], none[3], none[4],
            np.zeros(n, dtype=np.int64), np.zeros((n, 2)), wide[2], wide[3],
        )  # fmt: skip
        self.guidance, self.control = WindshearGuidance(plan.guidance), WindshearControl(plan.control)
        self.control.reset(self.jet.controls[0] * 1e-3, self.jet.controls[1])
        x0 = np.zeros(k.NX)
        true_state(self.jet.truth, x0)
        self.guidance.aim(x0[k.X], x0[k.H])
        self.nav = self._prepared(x0, seed)
        steers = plan.feedback == "monitor"
        self.monitor = WindshearMonitor() if plan.monitor or steers else None
        self.reckoned = _Reckoned(x0, plan.nav or WindshearParams())
        self._clear, self._truth, self._u = 0.0, np.zeros(k.NX), np.zeros(2)

    def _prepared(self, x0: Arr, seed: int) -> WindshearNav | None:
        plan = self.plan
        if plan.nav is None or plan.feedback == "monitor":
            return None
        nav = make_nav(plan.nav)
        if plan.start == "cold":
            return nav
        mean, sigma = x0.copy(), start_sigma(plan.nav)
        mean[k.WXD : k.KL] = 0.0  # rates of the smooth wind; those of the turbulence are not states
        mean[k.KL], mean[k.KD] = plan.nav.lift_scale, plan.nav.drag_scale
        if plan.start == "drawn":
            mean[: k.KL] += sigma[: k.KL] * generator(seed, "jing.start").standard_normal(k.KL)
        nav.start(mean, sigma)
        return nav

    def branch(self, guidance: WindshearGuidanceParams) -> Loop:
        """A copy that flies on with other guidance parameters."""
        twin = copy.deepcopy(self)
        twin.guidance.p = guidance
        return twin

    def run(self, to_abort: bool = False) -> Flight:
        """Fly on until the ground, the end, safety (plan.clear_s) or, if asked, until hazard comes near (for `branch`)."""
        while self.i < self.n:
            if self._sample():
                break
            h = self.guidance.hazard
            near = h.state.slow > 0.8 * h.p.abort_F or h.state.quick > 0.8 * h.p.caution_F
            if to_abort and near:
                return self.r
        r = self.r
        r.cut(self.i)
        r.F = true_F(r.truth)
        r.cautions = self.guidance.hazard.cautions
        r.restarts = self.nav.restarts if self.nav is not None else 0
        return r

    def _estimate(self, z: Arr, truth: Arr) -> tuple[Arr, float, bool]:
        """State [15], F and validity of what steers at this sample."""
        i, plan, r, nav = self.i, self.plan, self.r, self.nav
        x, F, valid = truth, float(k.f_factor(truth, GRAVITY)), True
        if self.monitor is not None:
            good = self.monitor.step(z, ALL, DT)
            r.monitor[i], r.monitor_sigma[i] = self.monitor.x, self.monitor.sigma
            if plan.feedback == "monitor":
                x, F, valid = self.reckoned.step(self.monitor.x, z, self.control.u), self.monitor.F, good
        if nav is not None and (i > 0 or plan.start == "cold"):
            if plan.start == "cold" and i == 0:
                nav.place(truth[k.X])
            e = nav.step(z, ALL, self.control.u, DT)
            r.sigma[i], r.nis[i] = e.sigma[: k.NX], e.nis / max(e.channels, 1)
            if self.monitor is not None and self.monitor.compare(e.x, e.sigma, DT):
                r.monitor_apart = True
            if plan.feedback == "nav":
                x, F, valid = e.x, e.F, e.valid
        return x, F, valid

    def _sample(self) -> bool:
        """One sample; True when the flight is over."""
        i, r, jet, g = self.i, self.r, self.jet, self.guidance
        truth = self._truth
        true_state(jet.truth, truth)
        x, F, valid = self._estimate(jet.reading, truth)
        demand = g.step(x, F, DT, valid)
        u = self.control.step(x, demand) if valid else self.control.u
        h = g.hazard.state
        r.truth[i], r.x[i], r.u[i] = truth, x[: k.NX], u
        r.F_hat[i], r.quick[i], r.slow[i], r.phase[i] = F, h.quick, h.slow, PHASES.index(g.phase)
        self.i += 1
        if truth[k.H] <= 0.0:
            r.lost = True
            return True
        done = g.phase == "clear" and truth[k.H] > 60.0 and jet.reading[k.Y_HD] > 0.0
        self._clear = self._clear + DT if done else 0.0
        if self.plan.clear_s > 0.0 and self._clear >= self.plan.clear_s:
            return True
        self._u[:] = u[0] * 1e3, u[1]
        jet.step(self._u)
        return False


def fly(plan: FlightPlan, seed: int) -> Flight:
    """Fly `plan` with the randomness of `seed`, until the ground, the end or safety."""
    return Loop(plan, seed % 2**31).run()


def wind_errors(r: Flight, after_s: float = 0.0) -> dict[str, float]:
    """RMS errors of w_x, w_h [m/s], shares inside two sigma, F (RMS, largest), NIS per reading, of a flight with a filter."""
    m = (r.t >= after_s) & np.isfinite(r.sigma[:, 0])
    if not m.any():
        return {"restarts": float(r.restarts)}
    d = r.x[m] - r.truth[m]
    out: dict[str, float] = {}
    for name, at in (("w_x", k.WX), ("w_h", k.WH)):
        out[f"{name}.rms_mps"] = float(np.sqrt(np.mean(d[:, at] ** 2)))
        out[f"{name}.max_mps"] = float(np.abs(d[:, at]).max())
        out[f"{name}.inside_2sigma"] = float(np.mean(np.abs(d[:, at]) <= 2.0 * r.sigma[m, at]))
    e = r.F_hat[m] - r.F[m]
    out["F.rms"], out["F.max_error"] = float(np.sqrt(np.mean(e * e))), float(np.abs(e).max())
    out["F.peak"], out["F.peak_estimate"] = float(r.F.max()), float(np.nanmax(r.F_hat[m]))
    out["nis_over_m"] = float(np.nanmean(r.nis[m]))
    out["restarts"] = float(r.restarts)
    out["lift_scale"], out["drag_scale"] = float(r.x[-1, k.KL]), float(r.x[-1, k.KD])
    return out


def height_apart(r: Flight, ref: Flight) -> tuple[float, float]:
    """RMS and largest difference of height [m] from a reference flight at the same range, over the range both have."""
    lo = max(r.truth[0, k.X], ref.truth[0, k.X])
    hi = min(r.truth[-1, k.X], ref.truth[-1, k.X])
    m = (r.truth[:, k.X] >= lo) & (r.truth[:, k.X] <= hi)
    d = r.truth[m, k.H] - np.interp(r.truth[m, k.X], ref.truth[:, k.X], ref.truth[:, k.H])
    return float(np.sqrt(np.mean(d * d))), float(np.abs(d).max())


def flown(r: Flight) -> dict[str, float]:
    """How the flight went: least height and airspeed, time and place of caution and abort, whether it was lost."""
    out = {
        "lost": float(r.lost),
        "height_min_m": float(r.truth[:, k.H].min()),
        "speed_min_mps": float(r.truth[:, k.VA].min()),
        "alpha_max_rad": float(r.truth[:, k.AL].max()),
    }
    i = r.abort_index
    c = r.first(r.phase >= 1)
    out["aborted"], out["cautioned"] = float(i >= 0), float(c >= 0)
    if i >= 0:
        out["abort_s"], out["abort_x_m"] = float(r.t[i]), float(r.truth[i, k.X])
    if c >= 0:
        out["caution_s"], out["caution_x_m"] = float(r.t[c]), float(r.truth[c, k.X])
    return out


def traces(r: Flight, prefix: str = "", every: int = 5) -> dict[str, NDArray[Any]]:
    """What a picture needs, every fifth sample."""
    s = slice(None, None, every)
    return {
        f"{prefix}{name}": getattr(r, name)[s].copy()
        for name in ("t", "truth", "x", "sigma", "F", "F_hat", "quick", "slow", "phase", "u")
    }
