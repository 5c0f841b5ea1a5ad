"""An estimator core that judges its readings, and says what it knows: which sensors it uses, whether it may be believed, how far.

With nav.gate.false_alarm = 0 nothing is judged: it is EstimatorCore, and validity is a matter of time alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft
from flightsw.kernels.linalg import product, semidefinite_factor, solve
from flightsw.kernels.rotations import less, vec3
from flightsw.refusal import AidStatus, Refusals
from flightsw.sixdof.estimator_core import EstimatorCore, NavParams, sane
from flightsw.sixdof.layout import AIR, WIND, X_ALPHA, X_BETA, X_P, X_R, X_V
from flightsw.sixdof.witness import Forces, verdict
from flightsw.types import NavState, SensorFrame, Text, Vec3


def _times(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A [n,k] B [k,m], both contiguous, in the house's own order of summation."""
    out = np.empty((A.shape[0], B.shape[1]))
    product(A, B, out)
    return out


Forced = Callable[[np.ndarray], np.ndarray]
HEAR_S = 0.95  # [s] between two looks of the witnesses while nothing is in dispute
LATE_S = 0.5  # [s] without a reading from which dead reckoning counts
DRAGGED = 5.0  # sigma by which the lift contradicts an estimate that goes where a reading leads it
LIFT_LEAST = 1.0  # [m/s^2] across the flight path, below which nothing is made of its share
TILT = 0.01  # [rad] of incidence, for the slope of the lift
LIKE = 0.5  # [-] share by which the wind's change may differ from what the reading lacks by the lift
BORNE = 0.3  # [-] share of what the lift gives back that stays unknown


class TrustedCore(EstimatorCore):
    """EstimatorCore with a gate. Call `begin` every step, `update` for every correction, `hear` after it, then publish."""

    def __init__(self, ac: Aircraft, p: NavParams, m: int, extra: int = 0) -> None:
        super().__init__(ac, p, m, extra)
        p = self.p
        self.refusals = Refusals(p.gate, m) if p.gate.false_alarm > 0.0 else None
        self.forces = Forces(p.gate.lift_sigma, p.gate.lift_error, p.gate.side_sigma)
        # kept wind needs entries 12..14 to be wind while the filter works, and a single filter
        self._unheard_s = 0.0
        self._dragged = -1  # the sensor kept out because it led the estimate away from the lift
        self._was: list[np.ndarray] = []
        self._keeps = p.state_form == "wind" and p.adapt_wind != "bank"

    # --- one step -----------------------------------------------------------------------------------------------------
    def begin(self, t_us: int) -> None:
        """A new step at t_us."""
        gate = self.refusals
        if gate is not None:
            gate.t_us = t_us
            if t_us - gate.judged_us > 500_000:  # no reading of any sensor
                gate.calm = gate.plain = False

    def restart(self, t_us: int) -> None:
        """The estimate has been taken from the sensors anew."""
        self.forces.reset()
        if self.refusals is not None:
            self.refusals.restart(t_us)

    def noise_factor(self, R_bi: np.ndarray, dt: float) -> None:
        """As EstimatorCore; where no sensor measures, the model alone has no say to its last digit: aerodynamics are 10 % off."""
        super().noise_factor(R_bi, dt)
        gate, SQ = self.refusals, self.ukf.SQ
        if gate is None or gate.calm:
            return
        if any(gate.unmeasured(k) for k in rd.AIR):
            for i in range(X_V, X_P):
                SQ[i, i] *= gate.p.loosen
        if gate.unmeasured(rd.ATT):
            for i in range(X_P, X_R + 1):
                SQ[i, i] = max(SQ[i, i], gate.p.loose_rate * math.sqrt(dt))

    def update(self) -> float:
        """Measurement update with the queued rows, their images in ukf.Y; NIS. Refused rows are left out and taken off."""
        ukf, gate = self.ukf, self.refusals
        if gate is None:
            return super().update()
        memory = ukf.memory()
        for a, b in zip(self.before(), memory, strict=True):
            a[...] = b
        nis = ukf.correct(self.y, self.r, self.m)
        if nis < 0.0:  # the filter itself refused it
            return nis
        keep = gate.judge(self.group, ukf.nu, ukf.Sy, self.slack, self.m, max(float(ukf.x[X_V]), 1.0))
        if gate.calm:
            return nis
        return self._again(gate, memory, keep, nis)

    def before(self) -> list[np.ndarray]:
        """Arrays for the filter's mean and covariance before a correction."""
        memory = self.ukf.memory()
        if len(self._was) != len(memory):  # the first time
            self._was = [np.zeros_like(a) for a in memory]
        return self._was

    def sifted(self, n: int, nis: float) -> float:
        """As `update`, where filter and gate have done their part (sixdof/judged.py): n by `sift`; NIS."""
        gate = self.refusals
        assert gate is not None
        keep = gate.sifted(n, self.m)
        return nis if gate.calm else self._again(gate, self.ukf.memory(), keep, nis)

    @property
    def calm(self) -> bool:
        """Whether readings are judged and none is missed, refused, kept out or in dispute."""
        return self.refusals is not None and self.refusals.calm

    @property
    def taking(self) -> bool:
        """Whether nothing is refused for now."""
        return self.refusals is not None and self.refusals.taking

    def _again(self, gate: Refusals, memory: tuple[np.ndarray, ...], keep: np.ndarray | None, nis: float) -> float:
        """The correction once more, from the state before it, where a reading is refused or the wind is not measured; NIS."""
        ukf = self.ukf
        out = [j for j, kind in enumerate(rd.AIR) if gate.unmeasured(kind)]
        if keep is None and not out:
            return nis
        for a, b in zip(memory, self._was, strict=True):
            a[...] = b
        before = ukf.P[WIND, WIND].copy() if out else None
        if keep is not None:
            ukf.Y[:, : len(keep)] = ukf.Y[:, keep]
            self.pick(keep)
        nis = ukf.correct(self.y, self.r, self.m) if self.m else 0.0
        if before is not None and self._keeps and self.m:
            self._keep_wind(self._was[0][WIND], before, out)
        return nis

    def _keep_wind(self, wind: np.ndarray, P: np.ndarray, out: list[int]) -> None:
        """Give back to the wind what the correction took along the directions `out` of wind axes whose air data are not measured.

        wind [3], P [3,3] before it. No other sensor measures that wind, but products in the model (incidence times airspeed) let
        noise speak on it: the error of a regressor. So it is a memory, which ages as the wind's process noise says.
        """
        ukf = self.ukf
        x, J = ukf.x, self.wind_jacobian
        scale = np.array([1.0, x[X_V] * math.cos(x[X_BETA]), x[X_V]])
        D = np.ascontiguousarray(-(J * scale[:, None])[out].T)  # [3,k] unit vectors NED
        lost = _times(np.ascontiguousarray(D.T), _times(P - ukf.P[WIND, WIND], D))
        column = np.zeros((ukf.n, len(out)))
        column[WIND] = _times(D, semidefinite_factor(lost))
        column[AIR] = _times(J, column[WIND])
        back = _times(D, _times(np.ascontiguousarray(D.T), (wind - x[WIND]).reshape(3, 1)))
        ukf.set_factor(np.hstack([ukf.S, column]))
        x[WIND] += back[:, 0]
        x[AIR] += _times(J, back)[:, 0]

    def ears(self, valid: bool, dt: float) -> bool:
        """Whether the witnesses are to be heard in this step of dt [s]: at the start and in a dispute, else now and then."""
        gate = self.refusals
        self._unheard_s += dt
        return gate is not None and (not (valid and gate.calm) or self._unheard_s >= HEAR_S)

    def hear(self, f: SensorFrame, fm: np.ndarray, at: Forced, peer_V: float | None = None) -> None:
        """After a correction: let the witnesses speak on air data, and open the estimate where they are for the airspeed.

        fm [>=3] the model's specific force [m/s^2] in body axes at the estimate, `at` gives it at another state, peer_V [m/s] the
        airspeed by another aircraft's wind.
        """
        gate = self.refusals
        assert gate is not None
        w, here = self.forces, vec3(fm[:3])
        if self.p.model == "aero" and f.gyro_count:
            w.step(f.acc_mean_b, here, vec3(self.ukf.x[WIND]), self._unheard_s, gate.calm)
        self._unheard_s = 0.0
        self._give_back(gate, here, at)
        if gate.calm:
            return
        for j, kind in enumerate(rd.AIR):
            if not gate.held(kind):
                continue
            x, d = self.ukf.x.copy(), gate.dispute(kind)
            x[j] += d
            there = at(x)
            unsure = self.ukf.sigmas()[j] / abs(d) if d else 0.0
            if kind == rd.BETA:
                more = float(there[1] - here[1])
                said = [w.sideways(more, unsure * more)]
            else:
                share = float(there[2] / here[2])
                said = [w.lift(share, unsure * abs(share - 1.0))]
            if kind == rd.V and peer_V is not None:
                s = gate.p.peer_wind_sigma
                said.append(((x[X_V] - peer_V) / s, (float(self.ukf.x[X_V]) - peer_V) / s))
            gate.verdict[kind] = verdict(said, gate.verdict[kind])
        for j, kind in enumerate(rd.AIR):
            if kind in gate.opened:
                gate.opened.remove(kind)
                column = self._by_wind(j, gate.dispute(kind))
                self.ukf.set_factor(np.hstack([self.ukf.S, column]))

    def _by_wind(self, j: int, more: float) -> np.ndarray:
        """States [n,1] by which air state j is `more` and the wind other by as much: ground speed is not in question."""
        column = np.zeros((self.ukf.n, 1))
        column[j] = more
        wind = column[AIR].copy()
        solve(self.wind_jacobian.copy(), wind)
        column[WIND] = wind
        return column

    def _give_back(self, gate: Refusals, here: Vec3, at: Forced) -> None:
        """Keep out an airspeed or an incidence that the estimate follows away from the lift, and fly by the one that bears it.

        What drifts is taken, as it may be the prediction that is wrong; a tube that ices over drifts. The gate alone cannot tell.
        The specific force can, as V^2 at the incidence, where the gate strains at one of the two alone, or the wind has changed
        by what that one lacks: an airspeed that drifts makes a headwind, an incidence an updraught (led-astray.md 1 to 3).
        """
        w, k = self.forces, self._dragged
        if k >= 0 and not gate.held(k):
            k = self._dragged = -1
        if not self._keeps or abs(here[2]) < LIFT_LEAST or (k < 0 and abs(w.lift(1.0, 0.0)[1]) < DRAGGED):
            return
        x = self.ukf.x
        tilted = x.copy()
        tilted[X_ALPHA] += TILT
        slope = float(at(tilted)[2] / here[2] - 1.0) / TILT
        columns = {
            rd.V: self._by_wind(rd.V, float(x[X_V]) * w.faster),
            rd.ALPHA: self._by_wind(rd.ALPHA, w.more / slope),
        }
        if k < 0:
            moved = less(w.wind, vec3(x[WIND]))
            who = [i for i, c in columns.items() if self._leads(gate, i, moved, vec3(c[WIND, 0]))]
            if len(who) != 1:
                return
            k = self._dragged = who[0]
            gate.keep_out(k)
        w.borne()
        x += columns[k][:, 0]
        self.ukf.set_factor(np.hstack([self.ukf.S, BORNE * columns[k]]))

    @staticmethod
    def _leads(gate: Refusals, k: int, moved: Vec3, lost: Vec3) -> bool:
        """Whether k leads the estimate: the gate strains at it alone, or the wind has `moved` [m/s] by what it has `lost`."""
        other = rd.ALPHA if k == rd.V else rd.V
        if gate.held(k) or gate.held(other) or gate.strained[other]:
            return False
        return gate.strained[k] > 0.0 or math.dist(moved, lost) < LIKE * math.hypot(*lost)

    def widen(self, states: slice, by: np.ndarray) -> None:
        """Open the estimate: an error of the size `by` [k] of the `states`, common to them, may be in it."""
        column = np.zeros((self.ukf.n, 1))
        column[states, 0] = by
        self.ukf.set_factor(np.hstack([self.ukf.S, column]))

    @property
    def aids(self) -> tuple[AidStatus, ...]:
        """Status of every aid that has offered a reading; none where nothing is judged."""
        return () if self.refusals is None else self.refusals.aids

    # --- validity -----------------------------------------------------------------------------------------------------
    def lost(self, valid: bool) -> str:
        """Why the estimate has to begin anew from its sensors; empty: it need not."""
        gate = self.refusals
        if not sane(self.ukf.x, self.ukf.S):
            return "estimate left its domain, restarting"
        if gate is not None and not gate.calm:
            if not valid and gate.flags:
                return "sensors contradict the first reading, restarting"
            if gate.contradicted:
                gate.texts.append(Text(3, "sensors contradict the estimate, restarting"))
                return "sensors contradict the estimate, restarting"
        return ""

    def earned(self, o: NavState, started_us: int, *kinds: int) -> str:
        """Why the estimate is not valid yet: `settle_s`, readings accepted of the sensors `kinds`, lift; empty: it is."""
        gate = self.refusals
        if o.t_us - started_us < self.p.settle_s * 1e6:
            return "settling"
        if gate is None or o.valid:
            return ""
        if why := gate.missing(*kinds):
            return why
        return "" if self.forces.plausible else "lift does not fit the airspeed"

    # --- what is published --------------------------------------------------------------------------------------------
    def drift(self, kind: int, rate: float) -> float:
        """What is lost by dead reckoning at an error of `rate` since sensor `kind` was last accepted, unless it is kept out."""
        gate = self.refusals
        if gate is None or gate.calm or gate.held(kind):
            return 0.0
        age = gate.age_s(kind)
        return rate * age if age > LATE_S else 0.0

    def lasting(self, kind: int, bias: float) -> float:
        """Error [m] of a published position that averaging leaves: the sensor's own, dead reckoning, what is disputed."""
        gate = self.refusals
        if gate is None or gate.plain:
            return bias
        return math.hypot(bias, self.p.bias_vel * max(gate.age_s(kind) - LATE_S, 0.0), gate.doubt(kind))

    def publish_sigma(self, o: NavState, s: Sequence[float]) -> None:
        """As EstimatorCore, with what is in dispute and with the drift of an attitude that is not measured."""
        super().publish_sigma(o, s)
        gate = self.refusals
        if gate is None or gate.plain:
            return
        a = math.hypot(gate.doubt(rd.ATT), self.p.bias_gyro * max(gate.age_s(rd.ATT) - LATE_S, 0.0))
        w = math.hypot(gate.doubt(rd.V), o.V * gate.doubt(rd.BETA), o.V * gate.doubt(rd.ALPHA), o.V * a)
        if w > 0.0:
            x, y, z = o.wind_sigma
            o.wind_sigma = (math.hypot(x, w), math.hypot(y, w), math.hypot(z, w))
        if a > 0.0:
            x, y, z = o.att_sigma
            o.att_sigma = (math.hypot(x, a), math.hypot(y, a), math.hypot(z, a))

    def publish_trust(self, o: NavState) -> None:
        """Whether the wind may be given out, and what is wrong with a valid estimate. The sigmas are filled."""
        gate = self.refusals
        o.wind_valid, o.trouble = o.valid, ""
        if gate is None or not o.valid:
            return
        g = gate.p
        w, a, p = max(o.wind_sigma), max(o.att_sigma), max(o.pos_sigma)
        o.wind_valid = w <= g.wind_sigma_max
        if not o.wind_valid:
            o.trouble = f"wind sigma {w:.1f} m/s"
        elif not p <= g.pos_sigma_max:
            o.trouble = f"position sigma {p:.1f} m"
        elif not a <= g.att_sigma_max:
            o.trouble = f"attitude sigma {math.degrees(a):.1f} deg"
        elif not gate.calm and gate.silent_s > g.silent_s:
            o.trouble = f"no reading taken for {gate.silent_s:.0f} s"
