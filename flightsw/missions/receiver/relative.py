"""Motion, sensors and states of a receiver relative to its tanker, as its estimator may choose them (sixdof/parts.py)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.gauss_markov import first_order
from flightsw.kernels.atmosphere import density
from flightsw.kernels.linalg import inner
from flightsw.kernels.rotations import dcm_from_quat, euler_from_dcm, to_parent
from flightsw.missions.receiver.aids import STAND_IN_ROWS, WAKE_ROWS
from flightsw.missions.receiver.relative_kernel import USE_REL_POS, USE_REL_VEL, attitude_behind
from flightsw.missions.receiver.rotational import differenced_relative, measure_local
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.refusal import REL_POS
from flightsw.sixdof.aids import own_sensors
from flightsw.sixdof.estimator_core import EstimatorCore, NavParams, channel_sigma
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.layout import (
    AIR,
    BEYOND,
    EULER,
    M_VEL,
    NX,
    NX_ROT,
    POS,
    RELATIVE_CHANNELS,
    ROT,
    TK_END,
    TK_RATE,
    TK_START,
    TK_VEL,
    WIND,
    X_ALPHA,
    X_BETA,
    X_P,
    X_PE,
    X_V,
)
from flightsw.sixdof.measure import measure_relative
from flightsw.sixdof.motion import propagate_relative
from flightsw.strict import ConfigError
from flightsw.types import NavState, SensorFrame, Vec3

N_ROT = slice(X_PE + BEYOND, X_PE + BEYOND + 3)  # columns of the noise factor


def check(p: NavParams) -> None:
    """Raises ConfigError for what a receiver cannot do."""
    if p.model != "aero":
        raise ConfigError(f"nav.model = {p.model!r}: allowed for a receiver: aero")
    if p.state_form != "wind":
        raise ConfigError(f"nav.state_form = {p.state_form!r}: allowed for a receiver: wind")
    if p.bias_pos != NavParams.bias_pos:
        raise ConfigError(
            f"nav.bias_pos = {p.bias_pos:g}: a receiver knows its place by the tanker's; allowed: left out"
        )
    if p.local_probes and p.colour == "removed" and p.colour_tau_s:
        raise ConfigError("nav.local_probes = true: allowed with colour = scaled, augmented or ignored")


def altitude(f: SensorFrame) -> float:
    """Height [m] to take the density at."""
    return -f.gnss_pos_n[2] if f.gnss_t_us else f.baro_alt_m


def inputs(
    c: TrustedCore, peer: PeerTracker, f: SensorFrame, stages: tuple[int, int, int], sound: int, fresh: bool, dt: float
) -> tuple[float, ...]:
    """Inputs of a step (relative_kernel.py), no rows queued before. stages [us]: its start, middle and end; sound: UPD_* that are
    new and believed; fresh: the relative reading is taken."""
    p, (a, b, e) = c.p, stages
    more = (USE_REL_POS | USE_REL_VEL if p.velocity else USE_REL_POS) if fresh else 0
    own_vel = p.r_vel if peer.coasting else math.hypot(p.r_vel, p.r_own_vel)
    return (
        (a - peer.t_us) * 1e-6, (b - peer.t_us) * 1e-6, (e - peer.t_us) * 1e-6, altitude(f),
        (f.t_us - f.rel_t_us) * 1e-6, c.drift(REL_POS, 2.0 * p.bias_vel), *f.rel_pos_t, *f.rel_vel_t, 0.0,
        *own_sensors(c, f, sound, dt, own_vel, p.peer_att, more),
    )  # fmt: skip


def relative_sigma(p: NavParams, probes: int) -> np.ndarray:
    """1-sigma [18] of the measurement channels in code order, or [21 + 3 probes] where each probe is one of its own."""
    own = [math.hypot(p.r_vel, p.r_own_vel)] * 3  # as the estimator queues it
    sigma = np.concatenate((channel_sigma(p, probes), own))
    if not p.local_probes:
        return sigma
    wind, probe = [p.r_vel] * 3, [p.r_V, p.r_beta, p.r_alpha]
    return np.concatenate((sigma, wind, probe * probes))


def swing_floor(p: NavParams, x: np.ndarray, floor: np.ndarray) -> None:
    """floor [c] of d(xi)/dt <- 1-sigma [m/s] that noise states of the sensors do not stand for, at the state x.

    The tanker's rates are taken as exact in w_T x xi. Beside velocity readings known to a hundredth of their noise their scatter
    would be regressed on xi and pull it towards zero, by metres (errors in variables).
    """
    floor[M_VEL : M_VEL + 3] = p.r_peer_rate * math.sqrt(inner(x[POS], x[POS]))


def first_state(x: np.ndarray, f: SensorFrame, air: np.ndarray, tk: np.ndarray) -> None:
    """First 15 of x [>=15] <- what one reading of every sensor says; air [3] V, beta, alpha, tk [18] the tanker at that time."""
    R, e, w = np.empty(9), np.empty(3), tk[TK_RATE]
    attitude_behind(np.array(f.att_q_nb), tk, R)
    euler_from_dcm(R, e)
    x[AIR], x[EULER], x[POS] = air, e, f.rel_pos_t
    for i in range(3):
        x[X_P + i] = f.gyro_b[i] - (R[3 * i] * w[0] + R[3 * i + 1] * w[1] + R[3 * i + 2] * w[2])
    cb = math.cos(x[X_BETA])
    u_a = x[X_V] * np.array([math.cos(x[X_ALPHA]) * cb, math.sin(x[X_BETA]), math.sin(x[X_ALPHA]) * cb])
    dcm_from_quat(np.array(f.att_q_nb), R)
    to_parent(R, u_a, e)
    x[WIND] = np.array(f.gnss_vel_n) - e


def publish_relative_sigma(c: TrustedCore, o: NavState, tankers: Vec3) -> None:
    """1-sigma of position and attitude relative to the tanker, and of the own position: that, and `tankers` [m] of its own."""
    lasting, (x, y, z) = c.lasting(REL_POS, c.p.bias_rel), o.scatter
    o.rel_sigma = (math.hypot(x, lasting), math.hypot(y, lasting), math.hypot(z, lasting))
    publish_own_sigma(c, o, tankers)
    psi, theta, phi = o.att_sigma
    o.rel_att_sigma = (math.hypot(psi, c.p.peer_att), math.hypot(theta, c.p.peer_att), math.hypot(phi, c.p.peer_att))


def publish_own_sigma(c: TrustedCore, o: NavState, tankers: Vec3) -> None:
    """1-sigma of the own position: rel_sigma, which is filled, and `tankers` [m] of the tanker's."""
    arm, (n, e, d) = c.p.peer_att * math.hypot(*o.rel_pos_t), tankers
    most = max(o.rel_sigma)  # whatever way the tanker's axes point
    o.pos_sigma = (math.hypot(n, most, arm), math.hypot(e, most, arm), math.hypot(d, most, arm))


def rows(p: NavParams, probes: int, aided: bool) -> int:
    """Measurements at most in one correction; aided: with those that stand in for the relative sensor.

    Augmented filters draw their points for this number: room for the wake position is left whether it is used or not.
    """
    local = 3 * (int(p.cmw) + probes * int(p.local_probes))
    return RELATIVE_CHANNELS + local + WAKE_ROWS + (STAND_IN_ROWS if aided else 0)


class BehindTanker:
    """The aerodynamic model in the frame of a tanker that moves as its data link says."""

    def __init__(self, core: EstimatorCore, stages: np.ndarray, nx: int) -> None:
        """stages [3,18]: tanker at start, middle and end of the step, filled by the owner; nx: 15, or 18 with rotational wind."""
        self.core, self.stages = core, stages
        self._work = np.zeros((5, nx))

    def start(self, f: SensorFrame) -> None:
        """Nothing is remembered."""

    def carry(self, X: np.ndarray, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        """As Motion."""
        propagate_relative(X, u, rho, self.core.P, self.stages, dt, self._work)


class RelativeSensors:
    """What a receiver's sensors read: measure.measure_relative; of single probes and calculated wind: measure_local."""

    def __init__(self, stages: np.ndarray, nx: int, local: bool) -> None:
        """stages as BehindTanker; nx: 15, or 18 with rotational wind; local: rows beyond the common codes are queued."""
        self.stages, self.nx, self.local = stages, nx, local

    def expect(self, X: np.ndarray, c: EstimatorCore) -> None:
        """As Sensors."""
        tk, m = self.stages[TK_END], c.m
        if self.local:
            own = c.codes[:m] >= RELATIVE_CHANNELS
            c.pick(np.argsort(own, kind="stable"))  # two kernels share the columns: common codes first
            m -= int(own.sum())
            measure_local(X, self.nx > NX, c.codes, m, c.m, tk, c.probe_pos, c.ukf.Y)
        measure_relative(X, c.codes, m, tk, c.ukf.Y)

    def differenced(
        self, X: np.ndarray, c: EstimatorCore, f: SensorFrame, u: np.ndarray, dt: float, cf: float, cx: float, m: int
    ) -> None:  # fmt: skip
        """As Sensors."""
        tk = self.stages[TK_END]
        a_t = (tk[TK_VEL] - self.stages[TK_START, TK_VEL]) / dt  # the data link's acceleration
        differenced_relative(X, self.nx, c.codes, m, u, density(altitude(f)), c.P, tk, a_t, cf, cx, c.ukf.Y)


class RotationalWind:
    """Effective rotational wind as three Gauss-Markov states."""

    STATES = NX_ROT - NX

    def __init__(self, p: NavParams) -> None:
        self.p = p

    def start(self, x: np.ndarray, S: np.ndarray) -> None:
        """Zero mean, stationary spread, into x and S in place."""
        x[ROT] = 0.0
        S[ROT, :] = S[:, ROT] = 0.0
        S[ROT, ROT] = np.eye(3) * self.p.rot_sigma

    def propagate(self, X: np.ndarray, SQ: np.ndarray, dt: float) -> None:
        """Decay of the points X over dt [s], and process noise into SQ."""
        phi, q = first_order(dt, self.p.rot_tau_s, self.p.rot_sigma)
        X[:, ROT] *= phi
        SQ[ROT, N_ROT] = np.eye(3) * q
