"""What a receiver's estimator holds and says of its state: rates, witnesses, publication (estimator.py makes the steps)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft
from flightsw.kernels.rotations import vec3
from flightsw.missions.receiver.aids import AidParams, GnssWitness, PositionAid, StationHold
from flightsw.missions.receiver.airdata.reports import WakeFix
from flightsw.missions.receiver.relative import (
    BehindTanker,
    RelativeSensors,
    RotationalWind,
    check,
    publish_relative_sigma,
    relative_sigma,
    rows,
)
from flightsw.missions.receiver.relative_kernel import (
    O_SIGMA,
    OWN,
    RELATIVE_OUT,
    relative_told,
)
from flightsw.missions.receiver.rotational import WIND_CODE
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.sixdof.aids import PROBES
from flightsw.sixdof.calculated_wind import CalculatedWind
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.judged import O_X, whole
from flightsw.sixdof.layout import NX, POS, RATE, ROT, TK, TK_END
from flightsw.sixdof.motion import relative_rates
from flightsw.sixdof.parts import Extras, Parts
from flightsw.types import NavState, SensorFrame, Vec3

REL_MAX_S = 2.0  # [s] age of the relative sensor beyond which the position is no longer its
PEER_COAST_S = 1.0  # [s] data-link age beyond which the tanker is continued straight ahead
NEEDED = (*rd.AIR, rd.GYRO, rd.ATT, rd.REL_POS)  # sensors without which no estimate becomes valid


class RelativeState:
    """State and parts of one receiver's estimator, and what is told of them."""

    def __init__(self, ac: Aircraft, params: NavParams, aid: AidParams | None = None) -> None:
        """aid: wake position, GNSS difference, a held station without the data link. Raises ConfigError for parameters that a
        receiver cannot obey."""
        check(params)
        p, probes = params, len(ac.probe)
        sigma = relative_sigma(p, probes)
        e = Extras.of(p, len(sigma), RotationalWind.STATES if p.rotational_wind else 0)
        self.core = c = TrustedCore(ac, p, rows(p, probes, aid is not None), e.total)
        self._tks = np.zeros((3, TK))  # the tanker at start, middle and end of the step
        self._R, self._Rn, self._fm, self._d = np.zeros(9), np.zeros(9), np.zeros(9), np.zeros(NX)
        self._e = np.zeros(3)
        self._given, self._told = np.zeros(OWN + PROBES + 4 * probes), np.zeros(RELATIVE_OUT)
        self.rot = RotationalWind(p) if p.rotational_wind else None
        self._nx = NX + e.own
        self.parts = Parts(
            c, e, BehindTanker(c, self._tks, self._nx), RelativeSensors(self._tks, self._nx, p.cmw or p.local_probes),
            sigma, self.rot, self._heading,
        )  # fmt: skip
        self.cmw = CalculatedWind(p, WIND_CODE) if p.cmw else None
        self.peer = PeerTracker()
        self.t_us = 0
        self.started_us = -1
        self.rel_us = -1
        self.rejoined = False
        self.aid = None if aid is None else PositionAid(aid)
        self.witness = GnssWitness(params.r_pos, params.bias_vel)
        self.fix: WakeFix | None = None  # wake position of this step, and
        self.R_ft = np.zeros(9)  # the tanker's air-path axes F to its body axes; filled by the owner
        self.x_f = 0.0  # [m] own x in F
        self.rate_fix: Vec3 | None = None  # [m/s] d(xi)/dt of this step from the calibrated difference of velocities
        self.hold = None if aid is None else StationHold(aid)
        self.out = NavState()
        # what relative_step works on; None: a variant, which goes step by step
        self._whole: tuple[Any, ...] | None = None
        if self.parts.plain and aid is None and not p.cmw and not p.local_probes and c.refusals is not None:
            own = whole(c, np.zeros((5, NX)), self._R, self._fm, self._d, self._told)
            self._whole = (*own, self._Rn, self._tks, *self.peer.sample)

    @property
    def _tk(self) -> np.ndarray:
        """The tanker now. No view of the stages is kept: a copy of the estimator would lose it."""
        return self._tks[TK_END]

    def begin_again(self, why: str) -> None:
        """Forget the estimate and start from the sensors as soon as they are there."""
        self.started_us = -1
        self.out.valid, self.out.rel_valid, self.out.reason = False, False, why

    def _heading(self) -> float:
        """Own heading [rad] of R_BI, during the prediction: at the start of the step."""
        return math.atan2(self._Rn[1], self._Rn[0])

    def _rates(self, u: np.ndarray, rho: float) -> None:
        """Rates of change `_d`, specific force `_fm` and R_BRBT `_R` of the present mean."""
        c = self.core
        relative_rates(c.ukf.x[: self._nx], u, rho, c.P, self._tk, self._R, self._fm, self._d)

    def _force(self, u: np.ndarray, rho: float, x: np.ndarray) -> np.ndarray:
        """Specific force [3] of the model at state x, body axes [m/s^2]."""
        fm = np.zeros(9)
        relative_rates(x[: self._nx], u, rho, self.core.P, self._tk, np.zeros(9), fm, np.zeros(NX))
        return fm[:3]

    def _hear(self, f: SensorFrame, u: np.ndarray, rho: float) -> None:
        """The witnesses on air data and relative position, after the correction."""
        c, tk, o = self.core, self._tk, self.out
        gate = c.refusals
        assert gate is not None
        V = None
        linked = not self.peer.coasting and o.peer_age_s < PEER_COAST_S
        if not gate.calm and linked and self.peer.wind_valid:
            V = math.dist(o.vel_n, self.peer.wind)
        c.hear(f, self._fm, partial(self._force, u, rho), V)
        if not linked or not f.rel_valid or f.gnss_t_us <= 0:
            return
        self.witness.hear(gate, f, tk, c.ukf.x[POS], self.peer.position(f.gnss_t_us))
        if rd.REL_POS in gate.opened:
            gate.opened.remove(rd.REL_POS)
            # in a step without a reading of it all channels of the group come, of which it fills three
            c.widen(POS, gate.gate.offsets(rd.REL_POS)[:3])

    def fits(self, f: SensorFrame) -> bool:
        """Whether a new reading of the relative sensor may be used elsewhere: what its gate would say of the position."""
        gate, o = self.core.refusals, self.out
        if gate is None or not o.rel_valid:
            return True
        dt = (f.rel_t_us - o.t_us) * 1e-6
        lost = self.core.drift(rd.REL_POS, 2.0 * self.core.p.bias_vel)
        limit = gate.gate.limit * math.hypot(self.core.p.r_pos, max(o.scatter), lost)
        off = (abs(f.rel_pos_t[i] - o.rel_pos_t[i] - o.rel_vel_t[i] * dt) for i in range(3))
        return not gate.held(rd.REL_POS) and max(off) <= limit

    @property
    def rate_change(self) -> np.ndarray:
        """Modelled d/dt [3] of the own body rates [rad/s^2], as of the last step."""
        return self._d[RATE]

    def _publish(self, f: SensorFrame, nis: float, m: int) -> NavState:
        c, at = self.core, self.peer.position(f.t_us)
        x, sigma = c.ukf.x, c.ukf.sigmas()
        relative_told(x, self._d, self._fm, self._R, self._Rn, self._tk, at, c.w_air, self._told)
        if self.rot is not None:
            self.out.wind_rot, self.out.wind_rot_sigma = vec3(x[ROT]), vec3(np.array(sigma[ROT]))
        return self._say(f, nis, m, self._told.tolist(), sigma)

    def _say(self, f: SensorFrame, nis: float, m: int, out: list[float], sigma: Sequence[float]) -> NavState:
        """What is published, by the outputs of relative_told and the 1-sigma [>=15] of the state."""
        c, o = self.core, self.out
        o.t_us = f.t_us
        o.reason = c.earned(o, self.started_us, *NEEDED)
        o.valid = not o.reason
        (
            o.V, o.beta, o.alpha, p, q, r, rel_psi, rel_theta, rel_phi, x, y, z, north, east, down, dx, dy, dz,
            ax, ay, az, qw, qx, qy, qz, wx, wy, wz, psi, theta, phi, px, py, pz, vx, vy, vz,
        ) = out[O_X:O_SIGMA]  # fmt: skip
        o.w_b, o.euler, o.q_nb = (wx, wy, wz), (psi, theta, phi), (qw, qx, qy, qz)
        o.pos_n, o.vel_n, o.acc_n, o.wind_n = (px, py, pz), (vx, vy, vz), (ax, ay, az), (north, east, down)
        c.publish_sigma(o, sigma)
        publish_relative_sigma(c, o, self.peer.pos_sigma)
        c.publish_trust(o)
        o.nis, o.nis_dof = nis, m
        o.rel_age_s = (f.t_us - self.rel_us) * 1e-6
        link, seen = o.peer_age_s < PEER_COAST_S and not self.peer.coasting, o.rel_age_s < REL_MAX_S
        o.rel_held = self.hold is not None and self.hold.step(f.t_us, link, seen, self.peer.level, self.fix)
        o.rel_valid = o.valid and ((link and seen) or o.rel_held)
        o.rel_pos_t, o.rel_vel_t = (x, y, z), (dx, dy, dz)
        o.rel_euler, o.rel_w_b = (rel_psi, rel_theta, rel_phi), (p, q, r)
        return o
