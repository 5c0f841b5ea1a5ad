"""What a receiver flight file says of its air data: [airdata]."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from flightsw.missions.receiver.aids import AidParams
from flightsw.missions.receiver.airdata.fdi.monitor import FdiParams
from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.wake_model import WakeParams
from flightsw.strict import Range

Pos = Annotated[float, Range(1e-9)]
NonNeg = Annotated[float, Range(0.0)]


@dataclass(frozen=True)
class AirDataParams:
    """[airdata] of a receiver flight file."""

    on: bool | None = None  # left out: off, and nothing else here may be set; false: off, whatever else is set
    fuse: bool = True  # the wake position corrects the relative estimator, and may hold a station
    seed_sigma_m: Pos = 3.0  # [m] of a start from the relative estimator
    rel_sigma_m: Pos = 0.5  # [m] of the relative sensor, from which circulations and offsets are learnt
    drift_V: NonNeg = (
        0.0  # [m/s2] a reading may walk off by and nobody sees it while nothing else knows the position, 1 sigma
    )
    drift_flow: NonNeg = 0.0  # [rad/s]
    stray_m: Pos = 3.0  # [m] beside 4 sigma: a wake position farther from the relative sensor's is begun anew
    sigma_x_m: Pos = 0.3  # [m] least 1-sigma of the given x
    common_V: Pos = 0.39  # [m/s] 1-sigma of the virtual sensor: what the wind estimate leaves unknown
    common_flow: Pos = 0.0026  # [rad] (0.15 deg)
    rate_sigma: Pos = 0.004  # [rad/s] of the body rates taken for a reading, over the monitor's window
    # [s] over which turbulence, and what of it each probe has for itself, is learnt; 0: it is position.gust_sigma, alike for all
    gusts_s: NonNeg = 10.0
    wake_alpha: Annotated[float, Range(-0.3, 0.3)] = (
        0.0  # [rad] the tanker's, at which the wing_m and tail_m of `wake` hold
    )
    wake: WakeParams = field(default_factory=WakeParams)
    position: WakePositionParams = field(default_factory=WakePositionParams)
    fdi: FdiParams = field(default_factory=FdiParams)
    aid: AidParams = field(default_factory=AidParams)
