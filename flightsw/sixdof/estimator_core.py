"""What the aircraft estimators share: parameters, state layout, air-data intake, start-up values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from flightsw import plugins
from flightsw.aircraft import Aircraft
from flightsw.filters.coloured import FORMS
from flightsw.filters.factory import make_filter
from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit
from flightsw.kernels.rotations import to_parent
from flightsw.refusal import GateParams
from flightsw.sixdof.layout import (
    BEYOND,
    N_WD,
    N_WE,
    N_WN,
    NX,
    X_ALPHA,
    X_BETA,
    X_PHI,
    X_PSI,
    X_THETA,
    X_V,
    X_WD,
    X_WE,
    X_WN,
    X_X,
    X_Y,
    X_Z,
)
from flightsw.sixdof.measure import average_probes
from flightsw.sixdof.motion import air_jacobian
from flightsw.sixdof.params import parameter_vector, set_mass
from flightsw.strict import OneOf, Range
from flightsw.types import (
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    HF_PEER,
    HF_REL,
    UPD_AIR,
    UPD_ATT,
    UPD_GNSS,
    UPD_IMU,
    UPD_PEER,
    UPD_REL,
    Health,
    NavState,
    SensorFrame,
)

Pos = Annotated[float, Range(1e-12)]
NonNeg = Annotated[float, Range(0.0)]

# [us] a filter is not led over a longer gap between two steps (the process stood still, its cable was cut): it begins anew
GAP_US = 600_000
# all aerodynamic; translation from accelerometers; rotation from the differenced gyro too; rates as a random walk instead
MODELS = ("aero", "hybrid", "inertial", "random_rates")
WIND_MODELS = ("random_walk", "gauss_markov", "dryden")
COLOURS = ("scaled", "ignored", "removed", "augmented")
FORMS_OF_STATE = ("wind", "velocity")  # what entries 12..14 are while the filter works (models.velocity_form)
ADAPTATIONS = ("off", "single", "bank")  # nothing; one filter matched to its innovations; three filters weighted

SENSOR_SIGMAS = ("r_V", "r_beta", "r_alpha", "r_rate", "r_euler", "r_pos", "r_vel")
# of NavParams what compiled rows are given: EstimatorCore.tune
TUNE = (*SENSOR_SIGMAS, "r_peer_rate")
R_V, R_BETA, R_ALPHA, R_RATE, R_EULER, R_POS, R_VEL, R_PEER_RATE = range(len(TUNE))


@dataclass(frozen=True)
class NavParams:
    """Tuning of a 15-state aircraft and wind estimator. Process noise per sqrt(s); sensor values 1-sigma per sample.

    Sources: process noise Lee 2011 re-tuned for 10 % aerodynamic error; `bias_*` are lasting errors of the sensors, which the
    state does not carry: they are added to what is published (they bound what averaging can reach) and change no gain.
    """

    q_V: NonNeg = 0.3  # [m/s]
    q_beta: NonNeg = 0.002  # [rad]
    q_alpha: NonNeg = 0.002  # [rad]
    q_rate: NonNeg = 0.003  # [rad/s]
    q_euler: NonNeg = 1e-5  # [rad]
    q_pos: NonNeg = 1e-3  # [m]
    q_wind: NonNeg = 0.33  # [m/s]
    r_V: Pos = 0.2  # [m/s] per probe
    r_beta: Pos = 0.0035  # [rad] per probe
    r_alpha: Pos = 0.0044  # [rad] per probe
    r_rate: Pos = 0.0131  # [rad/s]
    r_euler: Pos = 0.0035  # [rad]
    r_pos: Pos = 0.5  # [m]
    r_vel: Pos = 0.1  # [m/s]
    # receiver only: own GNSS velocity beside the tanker's transmitted one. Their biases differ, and a conflict of 0.05 m/s would
    # pull the relative position by decimetres, so this is added to the noise r_vel in square
    r_own_vel: NonNeg = 0.5  # [m/s]
    noise_scale: Pos = 1.0  # factor on all r_*: the grade of the sensors fitted
    bias_V: NonNeg = 0.2  # [m/s]
    bias_flow: NonNeg = 0.0015  # [rad] alpha and beta vanes
    bias_att: NonNeg = 0.001  # [rad]
    bias_vel: NonNeg = 0.03  # [m/s]
    bias_pos: NonNeg = (
        1.2  # [m] free aircraft only: GNSS position, per axis: slow errors of a code receiver with corrections
    )
    model_pitch: NonNeg = 0.0  # [rad] how far forces that are not the aircraft's pull the pitch angle; published
    bias_gyro: NonNeg = 3e-4  # [rad/s] what attitude drifts by without its reference
    bias_rel: NonNeg = 0.06  # [m] receiver only: relative sensor
    peer_att: NonNeg = 1.4e-3  # [rad] receiver only: of the tanker's transmitted attitude, lasting error and scatter
    wind_sigma0: Pos = 20.0  # [m/s]
    gate: GateParams = field(default_factory=GateParams)
    filter: Annotated[str, plugins.PartOf(plugins.ESTIMATORS)] = "srukf"  # flightsw.filters.factory
    model: Annotated[str, OneOf(MODELS)] = "aero"  # what drives the prediction (free aircraft)
    velocity: bool = True  # inertial velocity is a measurement
    cmw: bool = False  # calculated measurement of wind instead (Lee's printed method)
    cmw_samples: Annotated[int, Range(1, 1001)] = 41  # its moving average
    correlated_wind: bool = True  # a wind increment enters V, beta, alpha at once; False: diagonal Q as printed
    state_form: Annotated[str, OneOf(FORMS_OF_STATE)] = "wind"  # "velocity": free aircraft only
    wind_model: Annotated[str, OneOf(WIND_MODELS)] = "random_walk"
    wind_tau_s: Pos = 100.0  # [s] correlation time, model "gauss_markov"
    gust_sigma: Pos = 0.39  # [m/s] turbulence, model "dryden"
    gust_L_m: Pos = 533.4  # [m] its scale length
    q_slow: NonNeg = 0.15  # [m/s] per sqrt(s) of the prevailing wind beside the turbulence, model "dryden"
    colour_tau_s: NonNeg = 0.0  # [s] correlation time of the measurement noise; 0: white
    colour: Annotated[str, OneOf(COLOURS)] = "scaled"  # how it is treated
    colour_form: Annotated[str, OneOf(FORMS)] = "exact"  # of measurement differencing; "printed": first order in T/tau
    adapt_wind: Annotated[str, OneOf(ADAPTATIONS)] = "off"  # whether the wind's process noise follows the innovations
    rotational_wind: bool = False  # receiver only: effective rotational wind is estimated, three more states
    rot_sigma: Pos = 0.03  # [rad/s] its stationary value
    rot_tau_s: Pos = 5.0  # [s] its correlation time
    rot_q_rate: NonNeg = 0.03  # [rad/s] replaces q_rate, which stands for rotational wind where none is estimated
    r_peer_rate: NonNeg = 0.005  # [rad/s] receiver only: of the tanker's transmitted rates, beside noise states
    local_probes: bool = False  # receiver only: every probe is a measurement of its own
    settle_s: NonNeg = 0.5  # [s] from first fix to `valid`


class EstimatorCore:
    """Filter, parameter vector and intake buffers of a 15-state estimator with at most `m` measurements."""

    def __init__(self, ac: Aircraft, p: NavParams, m: int, extra: int = 0) -> None:
        """`extra` states beyond the 15, each with a process-noise column of its own."""
        if p.noise_scale != 1.0:
            p = replace(p, **{k: getattr(p, k) * p.noise_scale for k in SENSOR_SIGMAS}, noise_scale=1.0)
        self.ac, self.p = ac, p
        self.ukf = make_filter(p.filter, NX + extra, m, NX + BEYOND + extra)
        self.P = parameter_vector(ac, ac.mass.empty_kg + ac.mass.default_fuel_kg)
        self._fuel_kg = 0.0
        self.probe_pos = np.array([q.position_m for q in ac.probe], dtype=float)
        self._readings = np.zeros((4, len(ac.probe)))  # V, alpha, beta of every probe, 1 for the good ones
        self._every, self._good = (1 << len(ac.probe)) - 1, (1.0,) * len(ac.probe)  # where all of them are
        self.tune = np.array([getattr(p, k) for k in TUNE])
        self.air = np.zeros(3)
        self.probes = 0
        self.q_wind = p.q_wind  # [m/s per sqrt(s)] in force; moves when adapted (sixdof/wind_noise.py scales SQ)
        self.w_air = np.zeros(3)
        self.codes = np.zeros(m, dtype=np.int64)
        self.group = np.zeros(m, dtype=np.int64)  # WKF_READING each row belongs to
        self.y = np.zeros(m)
        self.r = np.zeros(m)
        self.slack = np.zeros(m)  # 1-sigma of what the filter is not told of, for the gate alone
        self.m = 0
        self.wind_jacobian = np.zeros((3, 3))
        q_rate = p.rot_q_rate if p.rotational_wind else p.q_rate
        self.noise = np.array(  # 1-sigma per sqrt(s) of what moves each state [15] by itself
            [p.q_V, p.q_beta, p.q_alpha, *[q_rate] * 3, *[p.q_euler] * 3, *[p.q_pos] * 3, 0.0, 0.0, 0.0]
        )

    def burn(self, fuel_kg: float) -> None:
        """Mass and inertia for a reading of the fuel gauge [kg]; 0: there is none."""
        if fuel_kg > 0.0 and fuel_kg != self._fuel_kg:
            self._fuel_kg = fuel_kg
            set_mass(self.P, self.ac, self.ac.mass.empty_kg + fuel_kg)

    def start_factor(self) -> None:
        """Independent errors of a state taken from one reading of every sensor."""
        p = self.p
        s = [p.r_V, p.r_beta, p.r_alpha, *[p.r_rate] * 3, *[p.r_euler] * 3, *[2 * p.r_pos] * 3, *[p.wind_sigma0] * 3]
        self.ukf.set_factor(np.diag([*s, *[1.0] * (len(self.ukf.x) - NX)]))

    def readings_of_probes(self, f: SensorFrame) -> tuple[float, ...]:
        """V [m/s] of every probe of `f`, then alpha, then beta [rad], then 1 for those that are good in all three, else 0."""
        V, alpha, beta, mask, bad = f.air_V, f.air_alpha, f.air_beta, f.air_mask, f.air_bad
        k, lacks = len(self.probe_pos), len(self.probe_pos) - len(V)
        if lacks > 0:
            none = (0.0,) * lacks
            V, alpha, beta, mask = (*V, *none), (*alpha, *none), (*beta, *none), mask & (1 << len(f.air_V)) - 1
        ok: Sequence[float] = self._good
        if bad or mask != self._every:
            ok = [1.0 if mask >> i & 1 and not bad >> i & 0b1001001 else 0.0 for i in range(k)]
        return (*V[:k], *alpha[:k], *beta[:k], *ok)

    def take_air(self, f: SensorFrame) -> int:
        """Average the probes of `f` that are good in all three readings into `air` [3] (V, beta, alpha at the cg); how many."""
        a = self._readings
        a.ravel()[:] = self.readings_of_probes(f)
        self.probes = int(average_probes(a[0], a[1], a[2], a[3], self.probe_pos, self.w_air, self.air))
        return self.probes

    def add(self, code: int, value: float, sigma: float, kind: int, slack: float = 0.0) -> None:
        """Queue one scalar measurement of a sensor (refusal.py) for the coming update; slack: 1-sigma for the gate alone."""
        m = self.m
        self.codes[m], self.y[m], self.r[m], self.group[m], self.slack[m] = code, value, sigma, kind, slack
        self.m += 1

    @property
    def rows(self) -> tuple[np.ndarray, ...]:
        """Where compiled rows are queued: codes, values, 1-sigma, sensors, 1-sigma for the gate alone."""
        return self.codes, self.y, self.r, self.group, self.slack

    def took(self, m: int, probes: int, updated: int) -> None:
        """Compiled rows have been queued, so many; with new air data (UPD_* `updated`) so many probes were averaged."""
        self.m = m
        if updated & UPD_AIR:
            self.probes = probes

    def pick(self, rows: np.ndarray) -> None:
        """Keep these of the queued measurements, in this order."""
        n = self.m = len(rows)
        for a in (self.codes, self.y, self.r, self.group, self.slack):
            a[:n] = a[rows]

    def update(self) -> float:
        """Measurement update with the queued rows, their images in ukf.Y; NIS."""
        return self.ukf.correct(self.y, self.r, self.m)

    def noise_factor(self, R_bi: np.ndarray, dt: float) -> None:
        """Fill the 15 rows of the filter's SQ: diagonal part, and the wind increment through -eps^-1 R_BI (R_bi [9])."""
        rt = dt**0.5
        fill_noise(
            self.ukf.SQ,
            self.ukf.x,
            R_bi,
            self.noise,
            rt,
            self.p.q_wind * rt,
            self.p.correlated_wind,
            self.wind_jacobian,
        )

    def publish_sigma(self, o: NavState, s: Sequence[float]) -> None:
        """Write the reported 1-sigma values of wind and attitude: those of the filter, s [>=15], and the sensors' lasting errors
        on top."""
        n = max(self.probes, 1)  # biases of separate probes average out
        p = self.p
        b = o.V * o.V * (p.bias_flow**2 / n + p.bias_att**2) + p.bias_V**2 / n + p.bias_vel**2
        a = p.bias_att
        o.wind_sigma = (math.sqrt(s[X_WN] ** 2 + b), math.sqrt(s[X_WE] ** 2 + b), math.sqrt(s[X_WD] ** 2 + b))
        o.att_sigma = (math.hypot(s[X_PSI], a), math.hypot(s[X_THETA], a, p.model_pitch), math.hypot(s[X_PHI], a))
        o.scatter = (s[X_X], s[X_Y], s[X_Z])


def channel_sigma(p: NavParams, probes: int) -> np.ndarray:
    """1-sigma [15] of the measurement channels in code order (layout.M_*); air data averaged over `probes`."""
    air = np.array([p.r_V, p.r_beta, p.r_alpha]) / math.sqrt(probes)
    return np.array([*air, *[p.r_rate] * 3, *[p.r_euler] * 3, *[p.r_pos] * 3, *[p.r_vel] * 3])


@jit
def inertial(R: np.ndarray, fm: np.ndarray, a: np.ndarray) -> None:
    """a [3] NED <- inertial acceleration [m/s^2]: specific force fm [>=3] turned by R_BI [9], and gravity."""
    to_parent(R, fm, a)
    a[2] += G0


@jit
def fill_noise(
    SQ: np.ndarray,
    x: np.ndarray,
    R_bi: np.ndarray,
    q: np.ndarray,
    rt: float,
    qw: float,
    correlated: bool,
    J: np.ndarray,
) -> None:
    """The 15 rows of a noise factor SQ [n,nq] about the state x [n] and R_bi [9]: q [15] times rt [sqrt(s)] on the diagonal, qw
    [m/s] of the wind and, if that is correlated with the air state, through J [3,3] <- -eps^-1 R_BI."""
    air_jacobian(x[X_V], x[X_BETA], x[X_ALPHA], R_bi, J)
    if correlated:
        for i in range(3):
            for j in range(3):
                SQ[X_V + i, N_WN + j] = J[i, j] * qw
    for i in range(NX):
        SQ[i, i] = q[i] * rt
    SQ[X_WN, N_WN] = SQ[X_WE, N_WE] = SQ[X_WD, N_WD] = qw


@jit
def sane(x: np.ndarray, S: np.ndarray) -> bool:
    """Whether a filter's state x [n] and factor S [n,n] are finite and its airspeed is one a wing flies at."""
    total = 0.0
    for i in range(x.shape[0]):
        total += x[i]
        for j in range(S.shape[1]):
            total += S[i, j]
    finite = total - total == 0.0  # a sum is finite only where every term is
    return finite and 20.0 < x[X_V] < 400.0 and abs(x[X_ALPHA]) < 0.6 and abs(x[X_BETA]) < 0.6


_HEALTH_TO_UPDATE = (
    (HF_AIR, UPD_AIR),
    (HF_ATT, UPD_ATT),
    (HF_GNSS, UPD_GNSS),
    (HF_IMU, UPD_IMU),
    (HF_REL, UPD_REL),
    (HF_PEER, UPD_PEER),
)


def failed_bits(h: Health) -> int:
    """Sensor update bits that health has ruled out."""
    bits = 0
    if h.failed:
        for flag, upd in _HEALTH_TO_UPDATE:
            if h.failed & flag:
                bits |= upd
    return bits
