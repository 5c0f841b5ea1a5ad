"""Receiver position in its tanker's wake from three air-data probes: iterated extended Kalman filter (sevil.md 8.4, 8.5).

State y, z and their rates in F, circulation errors of wing and tail, optionally the height of the wing's vortices, turbulence
and slow wind common to the probes. Start by maximum likelihood on a mean of readings, or by `seed`.

Fusing with another position sensor: give it to `aid`, as rows of this filter. They meet the same state, so the turbulence
that moves this estimate is not counted twice, and while the sensor is there the circulations and the height are learnt, which
carry the estimate when it is lost (contact, plant with 10 % less weight and a tail download of 0.03: 0.25 m in the 30 s after
the loss, 0.33 m if never aided). The error of `fix` is correlated in time: over 2.5 s in y, 4 s in z, where a third of the
variance (circulations) lasts longer than 20 s. A second filter that took `fix` every T seconds as if white would trust it far
too much: widen its sigma by sqrt(3 L / (V_T T)) there (a first-order process of correlation time c carries T / (2 c) as much
information per sample; c = 1.5 L / V_T, as measured), and never return to that filter a sensor already given to `aid`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from flightsw.filters.correction import state_update
from flightsw.kernels.linalg import finite
from flightsw.missions.receiver.airdata import believed
from flightsw.missions.receiver.airdata import expected as kp
from flightsw.missions.receiver.airdata import iekf as kf
from flightsw.missions.receiver.airdata import state as k
from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.reports import WakeFix
from flightsw.missions.receiver.airdata.wake_fix import MlFix, doubt, fix_of
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_vector
from flightsw.missions.receiver.airdata.wake_search import ok_channels
from flightsw.missions.receiver.airdata.wake_start import StartUp
from flightsw.missions.receiver.airdata.wake_watch import Watch
from flightsw.types import Vec3

Arr = NDArray[np.float64]
IDLE, STARTING, TRACKING = 0, 1, 2  # waits for air data; looks for the position; filters


class WakePosition:
    """Position estimator of one aircraft. Per step: predict, (prior), update; or `step` for all of it."""

    def __init__(self, ac: Aircraft, params: WakePositionParams, wake: WakeParams) -> None:
        """Probes from `ac`; raises ValueError if it has not exactly three."""
        self.p = params
        self.probes = np.array([q.position_m for q in ac.probe], dtype=np.float64)
        self.start = StartUp(self.probes, params, wake)
        self.watch = Watch(self.probes, params, wake)
        self.wk = wake_vector(wake)
        self.x, self.P = np.zeros(k.N), np.zeros((k.N, k.N))
        self.g = np.zeros(kp.G_SIZE)
        self._e, self._S = np.zeros(9), np.zeros((9, 9))
        self._y, self._ok = np.zeros(9), np.zeros(9, dtype=np.int64)
        self._sig = np.array([params.sigma_V, params.sigma_beta, params.sigma_alpha])
        self._q, self._tau, self._gm = believed.noises(params), believed.times(params), believed.sizes(params)
        self._fixed = np.zeros(k.N, dtype=np.int64)
        self.own_air = np.zeros((9, 9))  # covariance of what each probe's own air adds to the readings, as white noise
        self._out = np.zeros(2)
        self._gain, self._row = np.zeros(k.N), np.zeros(k.N)
        self.mode = IDLE
        self.restarts = 0
        self.t_us = 0
        self._since = 0.0  # [s] in this mode
        self._refused = 0  # updates in a row
        self._blind = 0.0  # [s] since an update was taken
        self._excess = 1.0  # [-] mean NIS per reading
        self._known: tuple[Arr, Arr] | None = None  # what another filter taught last, and its covariance
        self._kept: tuple[float, ...] | None = None  # wing, tail, height and their sigmas from before a restart
        self.fix = WakeFix()

    # -- start -------------------------------------------------------------------------------------------------------

    def seed(self, y: float, z: float, sigma: float, vy: float = 0.0, vz: float = 0.0) -> None:
        """Begin to track at (y, z) [m, F], known to sigma [m] per axis; (vy, vz) [m/s]. Ignored unless all are finite and sigma
        is positive."""
        if not (math.isfinite(y + z + vy + vz + sigma) and sigma > 0.0):
            return
        self._clear(y, z)
        self.x[k.X_VY], self.x[k.X_VZ] = vy, vz
        self.P[k.X_Y, k.X_Y] = self.P[k.X_Z, k.X_Z] = sigma * sigma
        self._track()

    def restart(self) -> None:
        """Forget the position and look for it again in the readings. What was learnt of the wake over a long time is kept, at
        restart_keep times its sigma; after a short one it is part of what went wrong."""
        p, P = self.p, self.P
        self._kept = None
        if self.mode == TRACKING and self._since >= p.restart_keep_s and self._sane():
            s = [p.restart_keep * math.sqrt(P[i, i]) for i in (k.X_KW, k.X_KT, k.X_H)]
            self._kept = (*(float(v) for v in self.x[k.LEARNT]), *s)
        self.mode, self._since = STARTING, 0.0
        self.restarts += 1
        self.start.reset()
        self.start.scale = None
        if p.scales and self._kept is not None:
            kw, kt, _, sw, st, _ = self._kept
            self.start.scale = 1.0 + kw, 1.0 + kt, min(sw, p.scale_wing_sigma), min(st, p.scale_tail_sigma)

    def _clear(self, y: float, z: float) -> None:
        p, x, P = self.p, self.x, self.P
        x[:], P[:] = 0.0, 0.0
        x[k.X_Y], x[k.X_Z] = y, z
        P.ravel()[:: k.N + 1] = believed.variances(p, self._gm)
        if self._known is not None:
            what, covariance = self._known
            x[k.TAUGHT] = what
            P[np.ix_(k.TAUGHT, k.TAUGHT)] = covariance

    def _track(self) -> None:
        self.mode, self._since = TRACKING, 0.0
        self.watch.reset()
        self._refused, self._blind, self._excess = 0, 0.0, 1.0

    def _take(self, ml: MlFix) -> None:
        """Begin to track at a maximum-likelihood position; its covariance widened by the motion within the mean and by rivals."""
        self._clear(*ml.pos)
        i = [k.X_Y, k.X_Z, k.X_KW, k.X_KT]  # in the order of the fix's covariance
        if self.p.scales:
            self.x[[k.X_KW, k.X_KT]] = [s - 1.0 for s in ml.scale]
            self.P[np.ix_(i, i)] = ml.cov
        else:
            self.P[k.PLACE, k.PLACE] = ml.cov[ml.PLACE, ml.PLACE]
        if self.p.height and self._kept is not None:
            _, _, self.x[k.X_H], _, _, sigma = self._kept
            self.P[k.X_H, k.X_H] = min(sigma, self.p.height_sigma_m) ** 2
        blur = 0.5 * self.start.duration_s * self.p.start_v_sigma
        for a in range(2):
            spread = max([abs(r[a] - ml.pos[a]) for r in ml.rivals], default=0.0)
            self.P[k.X_Y + a, k.X_Y + a] += blur * blur + spread * spread
        self._track()

    # -- one step ----------------------------------------------------------------------------------------------------

    def predict(
        self, t_us: int, att: Vec3, omega: Vec3, acc_rel_f: Vec3, x: float, s_x: float, V_T: float, rho: float, dt: float,
        x_dot: float = 0.0,
    ) -> None:  # fmt: skip
        """Carry the estimate over dt [s] to t_us, and take the frame of the readings to come.

        att = psi, theta, phi of the own body relative to F [rad]; omega own body rates [rad/s]; acc_rel_f own minus tanker's
        inertial acceleration [m/s^2, F]; x [m, F] known to s_x [m], its rate [m/s]; V_T [m/s] tanker airspeed, rho [kg/m^3].
        """
        self.t_us = t_us
        g = self.g
        g[kp.G_X], g[kp.G_XDOT], g[kp.G_V], g[kp.G_RHO], g[kp.G_SHARE] = x, x_dot, V_T, rho, self.p.height_tail_share
        g[kp.ATTITUDE], g[kp.RATES] = att, omega
        self._gm[k.M_X] = s_x
        dt = max(dt, 0.0)
        self._since += dt
        self._blind += dt
        if self.mode == TRACKING:
            self._tau[k.M_TURB] = self.p.gust_L_m / max(V_T, 1.0)
            self.watch.start.elapsed(dt)
            _, ay, az = acc_rel_f
            k.propagate(self.x, self.P, ay, az, dt, self._q, self._tau, self._gm)
        else:
            self.x[k.PLACE] += dt * self.x[k.SPEED]  # dead reckoning, not valid
            self.start.elapsed(dt)

    def prior(self) -> tuple[Arr, Arr] | None:
        """Expected readings e [9] at the prediction and their covariance S [9,9] = H P H^T + that of x and attitude (sensor
        noise not included), for fault detection; None when the position is not tracked. Copied by nobody: read at once."""
        if self.mode != TRACKING:
            return None
        kf.foresee(self.x, self.P, self.g, self.p.att_sigma, self.probes, self.wk, self._e, self._S)
        return self._e, self._S

    def aid(self, value: tuple[float, float], sigma: tuple[float, float], velocity: bool = False) -> float:
        """Take y, z [m, F] (velocity: their rates [m/s]) of another sensor with independent errors sigma each, as rows of this
        filter, between `predict` and `update`. Returns the NIS (2 dof, axis by axis); refused axes change nothing. 0 if not
        tracking."""
        nis = 0.0
        if self.mode == TRACKING and math.isfinite(sum(value)) and min(sigma) > 0.0:
            for a in range(2):
                i, e = (k.X_VY + a, -1) if velocity else (k.X_Y + a, k.X_AID + a)
                nis += state_update(
                    self.x, self.P, i, e, value[a], sigma[a] ** 2, self.p.aid_gate, self._fixed, self._gain, self._row
                )
        return nis

    def consider(self, on: bool) -> None:
        """From now on circulations, height and offsets keep their values, of which the uncertainty is carried on (on), or are
        estimated."""
        self._fixed[k.TAUGHT] = int(on)

    def rough(self, sigma_mps: float, own_air: Arr) -> None:
        """Turbulence of so much [m/s, 1 sigma per axis] from now on; own_air [9,9]: what each probe's own air adds to the
        readings, as covariance of white noise."""
        self._gm[k.M_TURB] = sigma_mps
        self._gm[k.M_LIFT] = self.p.lift_sigma * sigma_mps / self.p.gust_sigma
        self.own_air[:] = own_air

    def learn_from(self, other: WakePosition) -> None:
        """Take over circulations, height and offsets, considered here, of a filter that knows the position from elsewhere."""
        what, covariance = other.x[k.TAUGHT], other.P[np.ix_(k.TAUGHT, k.TAUGHT)]
        self._known = what, covariance
        if self.mode == TRACKING:
            k.be_taught(self.x, self.P, what, covariance)

    def drift(self, V_mps2: float, flow_radps: float, age_s: float, dt: float) -> None:
        """Let offsets grow less certain by a drift of so much [1 sigma] that has lasted for age_s and goes on for dt [s]."""
        grown = dt * (2.0 * age_s + dt)
        for c in range(9):
            rate = V_mps2 if c < kp.R_BETA else flow_radps
            self.P[k.X_OFF + c, k.X_OFF + c] += rate * rate * grown

    def update(self, readings: Arr, ok_mask: int) -> WakeFix:
        """Correct by the readings [9] (V of each probe, beta, alpha) whose bit is set; returns the new fix. Never raises."""
        p = self.p
        self._y[:] = readings
        n = ok_channels(ok_mask, self._ok)
        for c in range(9):
            if self._ok[c] and not abs(self._y[c]) < 1e4:
                self._ok[c] = 0
                n -= 1
        self._out[:] = 0.0, n
        if self.mode != TRACKING:
            if n:
                self.mode = STARTING
                ml = self.start.collect(self._y - self.x[k.OFFSETS], self._ok, self.g)
                if ml is not None:
                    self._take(ml)
        elif n:
            done = kf.correct(
                self.x, self.P, self._y, self._ok, self._sig, self.g, self.p.att_sigma, self.probes, self.wk,
                p.iterations, p.iterate_m, p.gate / 9.0, self._fixed, self.own_air, self._out,
            )  # fmt: skip
            w = 0.02  # [-] weight of one sample in the mean NIS: 2.5 s at 20 Hz
            self._excess += w * (min(self._out[kf.OUT_NIS] / n, 10.0) - self._excess)
            if done == kf.OK:
                self._refused, self._blind = 0, 0.0
                if p.watch_s > 0.0:
                    self._compare()
            elif done == kf.GATED:
                self._refused += 1
            lost = done == kf.BROKEN or self._refused >= p.restart_after or self._excess > p.restart_excess
            if lost or not self._sane():
                self.restart()
        return self._publish()

    def _compare(self) -> None:
        """Second opinion; moves the filter where it belongs."""
        there = self.watch.look(self._y - self.x[k.OFFSETS], self._ok, self.g, self.x[k.PLACE], float(self.radial_var))
        if there is not None:
            self.restarts += 1
            self._kept = None
            self._take(there)

    def step(
        self, t_us: int, V: Vec3, beta: Vec3, alpha: Vec3, ok_mask: int, att_F: Vec3, omega: Vec3, acc_rel_F: Vec3,
        x: float, s_x: float, V_T: float, rho: float, dt: float,
    ) -> WakeFix:  # fmt: skip
        """predict and update in one; V [m/s], beta, alpha [rad] of the three probes."""
        self.predict(t_us, att_F, omega, acc_rel_F, x, s_x, V_T, rho, dt)
        self._e[kp.OF_V], self._e[kp.OF_BETA], self._e[kp.OF_ALPHA] = V, beta, alpha
        return self.update(self._e, ok_mask)

    # -- output ------------------------------------------------------------------------------------------------------

    @property
    def radial_var(self) -> float:
        """Variance [m^2] of the position, y and z together."""
        return self.P[k.X_Y, k.X_Y] + self.P[k.X_Z, k.X_Z]

    def _sane(self) -> bool:
        x = self.x
        near = max(abs(x[k.X_Y]), abs(x[k.X_Z])) < self.p.domain_m and abs(x[k.X_KW]) < 0.9
        return bool(near and finite(x) and finite(self.P.ravel()))

    def _why_not(self) -> str:
        if self.mode != TRACKING:
            return "not started" if self.mode == IDLE else self.start.reason
        return doubt(self.p, self._since, self._blind, self._refused, self._excess, float(self.radial_var))

    def _publish(self) -> WakeFix:
        tracking = self.mode == TRACKING
        nis, dof = float(self._out[kf.OUT_NIS]), int(self._out[kf.OUT_COUNT]) if tracking else 0
        self.fix = fix_of(self.t_us, self._why_not(), self.x, self.P, self.g, tracking, nis, dof, self.restarts)
        return self.fix

    def get_state(self) -> dict[str, object]:
        """Copy of the state."""
        return {
            "arrays": [a.copy() for a in (self.x, self.P, self.g, self._tau, self._gm)],
            "flags": (self.mode, self.restarts, self.t_us, self._since, self._refused, self._blind, self._excess),
            "kept": self._kept,
            "taught": (self._known, self._fixed.copy(), self.own_air.copy()),
            "watch": self.watch.get_state(),
            "start": self.start.get_state(),
            "fix": replace(self.fix),
        }

    def set_state(self, s: dict[str, object]) -> None:
        """Restore what `get_state` returned."""
        arrays, flags = s["arrays"], s["flags"]
        assert isinstance(arrays, list) and isinstance(flags, tuple) and isinstance(s["fix"], WakeFix)
        for own, a in zip((self.x, self.P, self.g, self._tau, self._gm), arrays, strict=True):
            own[:] = a
        self.mode, self.restarts, self.t_us, self._since, self._refused, self._blind, self._excess = flags
        self.start.set_state(s["start"])
        self.watch.set_state(s["watch"])
        self._kept = s["kept"]  # type: ignore[assignment]
        taught = s["taught"]
        assert isinstance(taught, tuple)
        self._known, self._fixed[:], self.own_air[:] = taught
        self.fix = replace(s["fix"])
