"""What the bank believes of its sources, and what is asked of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from flightsw.strict import Range

Pos = Annotated[float, Range(1e-9)]
Risk = Annotated[float, Range(0.1, 10.0)]
Limit = Annotated[float, Range(0.01, 1e4)]
Axes = tuple[float, float, float]


@dataclass(frozen=True)
class IntegrityParams:
    """[integrity] of a receiver flight file. Errors are 1 sigma, of tactical sensors (docs/grades.md), with a margin on
    the slow ones; `_tau` their correlation times."""

    on: bool | None = None  # left out: off, and nothing else here may be set; false: off, whatever else is set
    # relative sensor: noise, slow and constant error, boresight, share of the range; its velocity
    rel_pos_m: Pos = 0.1
    rel_slow_m: Pos = 0.22
    rel_tau_s: Pos = 60.0
    rel_const_m: Pos = 0.12
    rel_boresight_rad: Pos = 0.003
    rel_scale: Pos = 0.0055
    rel_vel_mps: Pos = 0.07
    rel_vel_slow_mps: Pos = 0.025
    # one GNSS receiver's own errors (what both have in common cancels): across and down
    gnss_pos_m: Pos = 0.1
    gnss_slow_m: tuple[float, float] = (0.22, 0.33)
    gnss_tau_s: Pos = 60.0
    gnss_vel_mps: Pos = 0.03
    gnss_vel_slow_mps: Pos = 0.006
    gnss_blocked: Annotated[float, Range(1.0)] = 1.3  # own errors grow so much below the tanker
    # the tanker's attitude as transmitted, each axis
    att_rad: Pos = 0.003
    att_tau_s: Pos = 30.0
    rate_radps: Pos = 0.0015  # and its rates, each axis
    # boom: noise and constant of its angles and extension
    boom_angle_rad: Pos = 0.002
    boom_ext_m: Pos = 0.02
    boom_angle_const_rad: Pos = 0.0039
    boom_ext_const_m: Pos = 0.055
    boom_walk: Pos = 1e-3  # [m/sqrt(s)]
    # the wake position: passing error of its rows and how long it lasts, walk of the lasting one
    wake: bool | None = None  # it is a source; left out: where there are air data to tell it
    wake_fast_m: Pos = 0.15
    wake_fast_tau_s: Pos = 2.7
    wake_walk: Pos = 0.02  # [m/sqrt(s)]
    lag_s: Annotated[float, Range(0.0, 1.0)] = (
        0.15  # the bank is so long behind, where the tanker's accelerometers are known
    )
    # [m/s^2 per sqrt(Hz)] what is not known of the relative acceleration where both aircraft have measured theirs (learnt, from
    # `accel` to `accel_most`), from there to now by the own and the tanker's last, and where not
    accel: Pos = 0.1
    accel_start: Pos = 0.3
    accel_most: Pos = 3.0
    accel_slow: Pos = 0.1  # [m/s^2] its lasting error, attitudes' and accelerometers'
    accel_tau_s: Pos = 60.0
    accel_ahead: Pos = 0.3
    accel_blind: Pos = 0.7
    # bounds (Gaussian quantiles): nothing wrong; one source wrong
    k_fault_free: Risk = 5.33
    k_missed: Risk = 3.1
    k_once: Risk = 5.6  # separation in its sigmas that is an alarm at once, and
    k_alarm: Risk = 5.0  # one that is when it lasts for `alarm_steps` steps
    alarm_steps: Annotated[int, Range(1, 100)] = 4
    llr_alarm: Pos = 16.0  # [-] log-likelihood by which "this source is wrong" must beat "none is"
    llr_ahead: Pos = 7.0  # [-] and every other source's
    fork_s: tuple[float, float] = (3.0, 15.0)
    gate: Risk = 6.0  # [-] sigmas of an innovation beyond which a single reading is a spike
    spikes: Annotated[int, Range(1, 100)] = 2  # so many in a row
    # a source left out is taken again when it has agreed with the others to `again_sigma` for so long, once
    again_s: Annotated[float, Range(1.0, 600.0)] = 30.0
    again_sigma: Risk = 2.0
    # alert limits [m] and how long a bound may be beyond them
    al_observation_m: Limit = 10.0
    al_closing_m: Limit = 3.0
    al_latched_m: Limit = 2.0
    over_s: Annotated[float, Range(0.0, 60.0)] = 0.5
    settle_s: Annotated[float, Range(0.0, 60.0)] = 5.0  # from the first phase to the bank's start
    live_s: Annotated[float, Range(0.05, 10.0)] = 0.5  # a source not heard for so long is not there
    coast_s: Annotated[float, Range(0.0, 60.0)] = (
        10.0  # longest time the bank's position is carried on without any source
    )
    stand_in_s: Annotated[float, Range(0.05, 10.0)] = (
        0.2  # age of the relative sensor beyond which the bank stands in for it
    )
