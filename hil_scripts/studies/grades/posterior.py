"""How well the relative position can be known with sensors of a grade: the posterior Cramer-Rao bound.

With linear readings of Gaussian errors the conditional mean is a Kalman filter's, no estimate has a smaller mean square error
than its covariance, and that does not depend on what is read (Kalman 1960; Tichavsky, Muravchik, Nehorai 1998). So the
covariance of such a filter is carried along the true path, with the very sizes and times the plant draws its errors by, and
nothing of the onboard filters. Known besides: accelerations of both aircraft by their accelerometers and attitude references,
as on board; what is lasting in them is one Gauss-Markov state. Not counted against the estimate: latencies, quanta, losses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from flightsw.aircraft import Boom
from sim_plant.kernels.layout import G0
from sim_plant.kernels.rot import quat_dcm
from sim_plant.sensors.errors import NEAR_M
from sim_plant.sensors.terms import Group, group_terms
from sim_plant.truth import Truth

Arr = NDArray[np.float64]
GROUPS = ("imu", "att", "gnss", "rel", "boom")
RATE_HZ = 20.0  # of every sensor here, and of the steps
FAR_M, FAST_MPS = 100.0, 10.0  # of a position and velocity nothing is known of
LASTING = 1e9  # [s] correlation time of a constant


def terms_of(grade: str) -> dict[str, Group]:
    """What the plant draws the errors of a grade's sensors by; not of paper. Raises ConfigError."""
    found = {k: group_terms(k, grade, {}, "") for k in GROUPS}
    return {k: v for k, v in found.items() if v is not None}


@dataclass(frozen=True)
class State:
    """Three entries of the state from `at` on: 1-sigma `sd` [3] at first and, stationary, later; correlation time [s]."""

    at: int
    sd: Arr
    tau_s: float


class PositionBound:
    """Both aircraft with sensors of one grade. Call `step` RATE_HZ times a second from the start of the flight on."""

    def __init__(self, terms: dict[str, Group], boom: Boom, receptacle_m: tuple[float, ...]) -> None:
        """terms: of GROUPS; receptacle_m [3]: in the receiver's body axes."""
        self.terms, self.boom, self.arm = terms, boom, np.array(receptacle_m)
        self.states: dict[str, State] = {}
        rel, vel = terms["rel"].columns["pos"], terms["rel"].columns["vel"]
        fix, up = terms["gnss"].columns["pos_h"], terms["gnss"].columns["pos_v"]
        rate, climb = terms["gnss"].columns["vel_h"], terms["gnss"].columns["vel_v"]
        tilt, heading = terms["att"].columns["tilt"], terms["att"].columns["heading"]
        acc, root2 = terms["imu"].columns["acc"], math.sqrt(2.0)
        lean = math.hypot(tilt.constant, tilt.gm)
        self._add("d", FAR_M)
        self._add("u", FAST_MPS)
        self._add("acceleration", root2 * math.hypot(acc.constant, acc.gm, G0 * lean), tilt.tau_s)
        self._add("rel slow", rel.gm, rel.tau_s)
        self._add("rel constant", rel.constant)
        self._add("rel scale", rel.scale)
        self._add("rel align", rel.align)
        self._add("rel rate slow", vel.gm, vel.tau_s)
        self._add("rel rate constant", vel.constant)
        # of one receiver; the difference of two has both
        self._add("gnss slow", (root2 * fix.gm, root2 * fix.gm, root2 * up.gm), fix.tau_s)
        self._add("gnss rate slow", (root2 * rate.gm, root2 * rate.gm, root2 * climb.gm), rate.tau_s)
        self._add("gnss rate constant", (root2 * rate.constant, root2 * rate.constant, root2 * climb.constant))
        self._add("gnss arm", root2 * terms["gnss"].lever_m)
        for who in ("tanker", "receiver"):
            self._add(f"{who} slow", (tilt.gm, tilt.gm, heading.gm), tilt.tau_s)
            self._add(f"{who} constant", (tilt.constant, tilt.constant, heading.constant))
        angle, ext = terms["boom"].columns["angle"], terms["boom"].columns["extension"]
        self._add("boom", (angle.constant, angle.constant, ext.constant))
        self._white_boom = np.array([angle.white, angle.white, ext.white])
        self._accel2 = 2.0 * (acc.density**2 + (G0 * tilt.white) ** 2 / RATE_HZ)
        n = 3 * len(self.states)
        sd, tau = np.zeros(n), np.zeros(n)
        for s in self.states.values():
            sd[s.at : s.at + 3], tau[s.at : s.at + 3] = s.sd, s.tau_s
        self.P: Arr = np.diag(sd * sd)
        dt = 1.0 / RATE_HZ
        self._F: Arr = np.diag(np.exp(-dt / tau))
        self._Q: Arr = np.diag(-sd * sd * np.expm1(-2.0 * dt / tau))
        d, u, b = (self._at(k) for k in ("d", "u", "acceleration"))
        eye = np.eye(3)
        self._F[d, u], self._F[d, b], self._F[u, b] = dt * eye, 0.5 * dt * dt * eye, dt * eye
        self._Q[d, d], self._Q[u, u] = self._accel2 * dt**3 / 3.0 * eye, self._accel2 * dt * eye
        self._Q[d, u] = self._Q[u, d] = 0.5 * self._accel2 * dt * dt * eye

    def _add(self, name: str, sd: float | tuple[float, float, float], tau_s: float = LASTING) -> None:
        self.states[name] = State(3 * len(self.states), np.ones(3) * sd, tau_s)

    def _at(self, name: str) -> slice:
        s = self.states[name]
        return slice(s.at, s.at + 3)

    def step(self, tanker: Truth, receiver: Truth, latched: bool) -> Arr:
        """Take in a reading of every sensor, of the boom if it is latched; 1-sigma [3] m of the position in tanker axes."""
        self.P = self._F @ self.P @ self._F.T + self._Q
        C, xi = _dcm(tanker.q_nb), np.array(receiver.xi)
        place = self._rows(d=C, tanker=-_cross(xi))
        H, r = self._radio(C, xi, place)
        if latched:
            far, white = self._latched(tanker, receiver, C, place)
            H, r = np.vstack((H, far)), block_diag(r, white)
        PH = self.P @ H.T
        self.P -= PH @ np.linalg.solve(H @ PH + r, PH.T)
        self.P = 0.5 * (self.P + self.P.T)
        return np.sqrt(np.einsum("ij,jk,ik->i", place, self.P, place))

    def _rows(self, **parts: Arr) -> Arr:
        """[3, n] of matrices [3, 3] by state; of an aircraft's name: of the whole error of its attitude."""
        out = np.zeros((3, len(self.P)))
        for name, m in parts.items():
            names = (
                (f"{name} slow", f"{name} constant") if name in ("tanker", "receiver") else (name.replace("_", " "),)
            )
            for k in names:
                out[:, self._at(k)] += m
        return out

    def _radio(self, C: Arr, xi: Arr, place: Arr) -> tuple[Arr, Arr]:
        """Rows and covariance of relative sensor and difference of fixes: position and rate of each."""
        rel, vel = (self.terms["rel"].columns[k] for k in ("pos", "vel"))
        eye, near = np.eye(3), max(0.0, 1.0 - float(np.linalg.norm(xi)) / NEAR_M)
        blocked = 1.0 + (self.terms["gnss"].blocked - 1.0) * near
        more = math.sqrt(0.5 * (1.0 + blocked * blocked))  # the receiver sees less of the sky
        seen = place + self._rows(rel_slow=eye, rel_constant=eye, rel_scale=np.diag(xi), rel_align=_cross(xi))
        closing = self._rows(u=C, rel_rate_slow=eye, rel_rate_constant=eye)
        apart = self._rows(d=eye, gnss_slow=more * eye, gnss_arm=eye)
        drift = self._rows(u=eye, gnss_rate_slow=more * eye, gnss_rate_constant=more * eye)
        g = self.terms["gnss"].columns
        fix = [math.sqrt(2.0) * more * g[k].white for k in ("pos_h", "pos_h", "pos_v", "vel_h", "vel_h", "vel_v")]
        sd = np.array([*[rel.white] * 3, *[vel.white] * 3, *fix])
        return np.vstack((seen, closing, apart, drift)), np.diag(sd * sd)

    def _latched(self, tanker: Truth, receiver: Truth, C: Arr, place: Arr) -> tuple[Arr, Arr]:
        """Rows and covariance of the boom: pivot + arm(angles, extension) less the receptacle's arm by both attitudes."""
        el, az = receiver.boom_elevation, receiver.boom_azimuth
        length = self.boom.length_retracted_m + receiver.boom_extension
        ce, se, ca, sa = math.cos(el), math.sin(el), math.cos(az), math.sin(az)
        J = np.array(
            [
                [length * se * ca, length * ce * sa, -ce * ca],
                [-length * se * sa, length * ce * ca, ce * sa],
                [-length * ce, 0.0, -se],
            ]
        )
        turn = C @ _dcm(receiver.q_nb).T  # receiver's axes to the tanker's
        arm = _cross(turn @ self.arm)
        rows = place + self._rows(boom=J, receiver=arm @ turn) + self._rows(tanker=-arm)
        white = J * self._white_boom
        return rows, white @ white.T


def _cross(v: Arr) -> Arr:
    """[v]x, v [3]."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _dcm(q: tuple[float, float, float, float]) -> Arr:
    """NED to body [3,3] of a quaternion q_nb."""
    return np.array(quat_dcm(*q)).reshape(3, 3).T
