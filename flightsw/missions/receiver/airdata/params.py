"""Parameters of the wake-position estimator."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from flightsw.missions.receiver.airdata.contour.params import FILTER, METHODS, ContourParams
from flightsw.missions.receiver.airdata.wake_fix import MlParams
from flightsw.strict import OneOf, Range, changed

Pos = Annotated[float, Range(1e-12)]
NonNeg = Annotated[float, Range(0.0)]


@dataclass(frozen=True)
class WakePositionParams:
    """Noise, priors, gates and restart rules. Defaults: sevil.md section 4 and 8.4, 8.5; rules are our choice."""

    # whose position is told, fused and held a station by: the filter's, or that of an algorithm of Sevil (2013), chapter 4, the
    # print's method as it stands. What the readings are expected to be, and what is learnt, is the filter's with either
    method: Annotated[str, OneOf(METHODS)] = FILTER
    sigma_V: Pos = 0.447  # [m/s] per sample and probe
    sigma_beta: Pos = 7.8e-4  # [rad]
    sigma_alpha: Pos = 7.8e-4  # [rad]
    att_sigma: NonNeg = 3.5e-4  # [rad] noise of the attitude, the same at all probes; its bias goes into the slow wind
    q_acc: Pos = 0.02  # [m/s per sqrt(s)] error of the relative acceleration
    acc_bias_sigma: NonNeg = 0.02  # [m/s^2] its bias per axis
    acc_tau_s: Pos = 300.0  # [s]
    x_tau_s: Pos = 300.0  # [s] correlation time of the error of the given x
    gust_sigma: Pos = 0.39  # [m/s] turbulence
    gust_L_m: Pos = 533.4  # [m] its scale length; correlation time L / V_T
    slow_sigma: Pos = 2.0  # [m/s] slow wind
    slow_tau_s: Pos = 300.0  # [s]
    scales: bool = True  # circulation errors of wing and tail are estimated
    scale_wing_sigma: Pos = 0.10  # [-] prior
    scale_tail_sigma: Pos = 0.50  # [-]
    q_scale_wing: NonNeg = 0.0  # [per sqrt(s)] random walk
    q_scale_tail: NonNeg = 0.0
    # height of the wing's vortices below the onboard model is estimated: without it an error of 0.5 m there is taken for a
    # tail that lifts less, and moves the position by as much; costs 1 cm where there is none
    height: bool = True
    height_sigma_m: Pos = 0.25  # [m] prior
    q_height: NonNeg = 0.0  # [m per sqrt(s)]
    # share of the height the tail's vortices take part in. With 1 the whole wake moves, which no air data can tell from own
    # height: only useful with an aiding sensor
    height_tail_share: Annotated[float, Range(0.0, 1.0)] = 0.0
    # every reading's own fixed error, estimated where the position is known from elsewhere and considered where it is not; prior
    # 1 sigma, 0: there is none
    offset_V: NonNeg = 0.0  # [m/s]
    offset_flow: NonNeg = 0.0  # [rad] of beta and alpha
    q_offset_V: NonNeg = 0.0  # [m/s per sqrt(s)] random walk
    q_offset_flow: NonNeg = 0.0  # [rad per sqrt(s)]
    lift_sigma: NonNeg = 0.0  # [-] passing error of the wing's lift as known, in turbulence of gust_sigma, and
    lift_tau_s: Pos = 1.0  # [s] its correlation time
    aid_slow_m: NonNeg = 0.0  # [m] slow error of a position sensor that aids, per axis, and
    aid_tau_s: Pos = 60.0  # [s] its correlation time
    iterations: Annotated[int, Range(1, 10)] = 3
    # [m] a smaller step is not iterated: a slope taken at the corrected state is correlated with the noise that led there, and
    # over thousands of steps that bias of the score ran to 7 % of the tail's circulation and 0.18 m in z
    iterate_m: NonNeg = 1.0
    gate: Pos = 80.0  # [-] NIS of nine readings beyond which an update is refused; in proportion for fewer
    aid_gate: Pos = 25.0  # [-] NIS of one axis of an aiding sensor
    restart_after: Annotated[int, Range(1, 10000)] = 40  # refused updates in a row
    restart_excess: Pos = 2.5  # [-] mean NIS per reading over 2.5 s
    restart_keep: Annotated[float, Range(1.0, 1e6)] = (
        3.0  # circulations and height outlive a restart at so many times their sigma
    )
    restart_keep_s: NonNeg = 30.0  # [s] if tracking had lasted so long; else their priors come back
    valid_excess: Pos = 1.5  # [-] mean NIS beyond which the fix is not valid
    valid_refused: Annotated[int, Range(1, 10000)] = 3  # refused updates in a row, likewise
    valid_sigma_m: Pos = 3.0  # [m] radial
    blind_s: NonNeg = 2.0  # [s] without an update taken
    settle_s: NonNeg = 1.0  # [s] from start to valid
    # beside the filter, the position is looked for from scratch in the mean of so long [s]: a filter that began in a wrong basin
    # fits its readings well enough never to notice. 0: not done
    watch_s: NonNeg = 5.0
    watch_cost: Pos = 9.21  # [-] by how much the other basin must fit better: chi-square, 2 dof, 1 %
    watch_min_m: Pos = 2.0  # [m] and how far away it must be, besides 4 sigma
    watch_strikes: Annotated[int, Range(1, 100)] = 3  # so often in a row
    domain_m: Pos = 300.0  # [m] |y|, |z|
    start_min_s: Pos = 1.0  # [s] mean of readings the first search uses; doubled until the result serves
    start_max_s: Pos = 10.0  # [s]
    start_sigma_m: Pos = 6.0  # [m] radial sigma a start is accepted with
    start_v_sigma: Pos = 0.5  # [m/s] per axis
    start_nodes: Annotated[int, Range(1, 100000)] = 200  # of the coarse search per step
    start: MlParams = field(
        default_factory=lambda: MlParams(scale_wing_sigma=0.1, scale_tail_sigma=0.5)
    )  # noise and priors are taken from above where scales are estimated
    contours: ContourParams = field(default_factory=ContourParams)  # of method "algorithm_11", "algorithm_15"

    def __post_init__(self) -> None:
        if self.method == FILTER and (idle := changed(self.contours, ContourParams())) is not None:
            others = " or ".join(repr(m) for m in METHODS if m != FILTER)
            raise ValueError(f"contours.{idle[0]} = {idle[1]!r}: nothing obeys it without method = {others}")
