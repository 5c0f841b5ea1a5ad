"""The wind estimate beside an aircraft's navigation: what it is given, and whether there is one."""

from __future__ import annotations

import numpy as np

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft
from flightsw.sixdof.estimator_core import failed_bits
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.windcal.filter import WindCalibrator
from flightsw.sixdof.windcal.params import WindCalParams
from flightsw.strict import ConfigError, changed
from flightsw.types import HF_IMU, UPD_AIR, UPD_ATT, UPD_GNSS, Health, SensorFrame

TABLE = "wind_calibration"


class WindCalibration(WindCalibrator):
    """Wind estimate of an aircraft that has one. Call `feed` after the estimator's step and `publish` before nav is given out."""

    def __init__(self, ac: Aircraft, p: WindCalParams, behind: bool) -> None:
        super().__init__(p, float(np.mean([q.position_m[0] for q in ac.probe])), behind)

    def feed(self, f: SensorFrame, updated: int, health: Health, core: TrustedCore) -> None:
        """Take in the frame `core` has just used: `updated` the union of update bits since the last step. What health has
        ruled out or core keeps out is left out."""
        updated &= ~failed_bits(health)
        out, gate = 0, core.refusals
        if gate is not None and not gate.calm:
            out = sum(1 << j for j, kind in enumerate(rd.AIR) if gate.held(kind))
            if gate.held(rd.ATT):
                updated &= ~UPD_ATT
            if gate.held(rd.GNSS_VEL):
                updated &= ~UPD_GNSS
        probes = core.take_air(f) if updated & UPD_AIR else 0
        if not f.gyro_count or health.failed & HF_IMU:
            probes = 0  # nothing carries the velocity on
        self.step(f, updated, core.air if probes else None, probes, out)


def make_wind_calibration(ac: Aircraft, p: WindCalParams, behind: bool = False) -> WindCalibration | None:
    """The wind estimate [wind_calibration] asks for; None: none. behind: the aircraft flies in another one's wake.

    Raises ConfigError for a key that nothing would obey.
    """
    if not p.on:
        if (idle := changed(p, WindCalParams())) is not None:
            raise ConfigError(f"{TABLE}.{idle[0]} = {idle[1]!r}: nothing obeys it without {TABLE}.on = true")
        return None
    if not behind:
        wake = tuple(k for k in WindCalParams.__dataclass_fields__ if not k.startswith("wake_"))
        if (idle := changed(p, WindCalParams(), wake)) is not None:
            raise ConfigError(f"{TABLE}.{idle[0]} = {idle[1]!r}: allowed for a receiver only")
    return WindCalibration(ac, p, behind)
