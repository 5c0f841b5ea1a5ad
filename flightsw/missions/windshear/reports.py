"""What the windshear mission has to say on the wire: the wind, the hazard in it, and what is done about it."""

from __future__ import annotations

from dataclasses import dataclass

from flightsw.missions.base import Packets, report

WORDS = {
    "approach": "on the slope",
    "caution": "wind shear caution",
    "escape": "wind shear: escape",
    "clear": "shear behind, climbing away",
}


@dataclass(slots=True)
class WindshearState:
    """Wind on the jet transport's approach, the hazard in it, and what is done about it. Estimate in SI and kN, in the order of
    dynamics.py: x, h, airspeed, air-path angle, incidence, pitch rate, thrust, wind along and up, their first
    and second rates, scales of lift and drag."""

    t_us: int = 0
    valid: bool = False
    reason: str = "not started"
    x: tuple[float, ...] = (0.0,) * 15
    sigma: tuple[float, ...] = (0.0,) * 15
    F: float = 0.0  # [-] hazard index as the alerting takes it
    quick: float = 0.0  # [-] its low-pass for the caution
    slow: float = 0.0  # [-] and for the abort
    F_states: float = 0.0  # [-] hazard index with the wind's rates of the estimate
    F_monitor: float = 0.0  # [-] the same of the kinematic monitor; NaN: it does not run
    wind_monitor: tuple[float, float] = (0.0, 0.0)  # [m/s] its wind along and up
    nis: float = 0.0  # normalised innovation squared of the step
    channels: int = 0  # readings it was made of
    states: int = 15  # estimated: 13, 15 or 26
    turbulence: float = 0.0  # [m/s/sqrt(s)] white steps of the wind
    climb: float = 0.0  # [m/s] demanded
    speed: float = 0.0  # [m/s] demanded airspeed (approach)
    pitch: float = 0.0  # [rad] demanded (pitch law)
    mode: int = 0  # index in model.MODES
    thrust_kN: float = 0.0  # command
    elevator: float = 0.0  # [rad] command
    estimator: int = 0  # index in mission.ESTIMATORS
    law: int = 0  # index in guidance.LAWS
    phase: int = 0  # index in guidance.PHASES
    caution: bool = False
    abort: bool = False
    accused: bool = False  # the monitor has disagreed with the estimate for long


@dataclass(slots=True)
class WindshearErrors:
    """What the filter with error states has learnt of instruments and aircraft, in the order of dynamics.py from B_AX to K_R:
    offsets of the accelerations along and up [m/s^2], of incidence [rad], climb rate [m/s], barometer [m]; factors of thrust and
    of the moment; factor of the radio altimeter less one. `left_out`: bits of readings kept from the filter by their
    witnesses."""

    t_us: int = 0
    est: tuple[float, ...] = (0.0,) * 8
    sigma: tuple[float, ...] = (0.0,) * 8
    engine_out: bool = False
    distrusted: bool = False
    left_out: int = 0
    valid: bool = False


def windshear_values(w: WindshearState) -> Packets:
    """Fields of WINDSHEAR_STATE."""
    alert = w.caution | w.abort << 1 | w.accused << 2
    yield (
        w.t_us, *w.x, *w.sigma, w.F, w.quick, w.slow, w.F_states, w.F_monitor, *w.wind_monitor, w.nis, w.turbulence, w.climb,
        w.speed, w.pitch, w.thrust_kN, w.elevator, w.channels, w.states, w.estimator, w.law, w.mode, alert,
        1 if w.valid else 0,
    )  # fmt: skip


def error_values(e: WindshearErrors) -> Packets:
    """Fields of WINDSHEAR_ERRORS."""
    flags = e.engine_out | e.distrusted << 1
    yield (e.t_us, *e.est, *e.sigma, e.left_out, flags, 1 if e.valid else 0)


REPORTS = (
    report("WINDSHEAR_STATE", WindshearState, windshear_values, rate_hz=50.0),  # every sample
    report("WINDSHEAR_ERRORS", WindshearErrors, error_values, rate_hz=5.0),
)
