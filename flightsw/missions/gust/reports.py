"""What the gust mission has to say on the wire: the wind felt, and what is done against it."""

from __future__ import annotations

from dataclasses import dataclass

from flightsw.missions.base import Packets, report
from flightsw.missions.gust.servo_bank.params import ServosFound

Nine = tuple[float, float, float, float, float, float, float, float, float]


@dataclass(slots=True)
class GustState:
    """Wind felt as incidence and speed, and what is done against it (small UAV). Deviations from trim, SI, in the order of
    dynamics.py: x1, alpha_W, V_W, q, alpha_K, V_K, Theta, H, vane bias."""

    t_us: int = 0
    valid: bool = False
    reason: str = "not started"
    x: Nine = (0.0,) * 9
    sigma: Nine = (0.0,) * 9  # 1-sigma; NaN: the estimator has none
    nis: float = 0.0  # normalised innovation squared of the step
    channels: int = 0  # readings it was made of
    scale: float = 0.0  # turbulence intensity relative to the one expected
    weights: tuple[float, ...] = ()  # of the bank's filters, ascending intensity
    a_z: float = 0.0  # [m/s^2] upward specific force less g, as measured
    a_z_model: float = 0.0  # [m/s^2] as the estimate has it; 0 with the hold
    elevator: float = 0.0  # [rad] command
    flap: float = 0.0  # [rad] command
    estimator: int = 0  # index in estimators.ESTIMATORS
    law: int = 0  # index in laws.LAWS, or laws.OTHER


def gust_values(g: GustState) -> Packets:
    """Fields of GUST_STATE."""
    weights = (g.weights + (0.0,) * 4)[:4]
    yield (
        g.t_us, *g.x, *g.sigma, g.nis, g.scale, *weights, g.a_z, g.a_z_model, g.elevator, g.flap, g.channels, g.estimator,
        g.law, 1 if g.valid else 0,
    )  # fmt: skip


@dataclass(slots=True)
class GustModel:
    """What the bank of servo models has found out about the aircraft, and whether the estimate steers."""

    t_us: int = 0
    wn_radps: float = 0.0  # servos believed
    late: int = 0  # samples from a command to its servo
    lead: float = 0.0  # log-likelihood by which they lead the next best
    lift: float = 0.0  # scale of lift less one, and its 1-sigma
    lift_sigma: float = 0.0
    V_bias: float = 0.0  # [m/s] of the airspeed sensor, and its 1-sigma
    V_bias_sigma: float = 0.0
    load_ratio: float = 0.0  # load measured over that of the hold in the same air; NaN: none yet
    settled: bool = False
    doubt: int = 0  # WKF_GUST_DOUBT


def model_of(t_us: int, b: ServosFound, load_ratio: float, doubt: int) -> GustModel:
    """The record of what was found at a sample."""
    return GustModel(
        t_us, b.wn_radps, b.late, b.lead, b.lift, b.lift_sigma, b.V_bias, b.V_bias_sigma, load_ratio, b.settled, doubt
    )


def model_values(g: GustModel) -> Packets:
    """Fields of GUST_MODEL."""
    yield (
        g.t_us, g.wn_radps, g.lead, g.lift, g.lift_sigma, g.V_bias, g.V_bias_sigma, g.load_ratio, g.late, 1 if g.settled else 0,
        g.doubt,
    )  # fmt: skip


REPORTS = (
    report("GUST_STATE", GustState, gust_values, rate_hz=50.0),  # every sample
    report("GUST_MODEL", GustModel, model_values, rate_hz=10.0, offset=3),
)
