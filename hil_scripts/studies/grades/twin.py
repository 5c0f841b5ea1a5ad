"""How well the wind can be known with sensors of a grade: the onboard wind filter once more, told the very sizes the plant draws
the sensors' errors by (on board they are a tenth to a fifth larger), fed with what that is fed, and flown by by nobody.

It is linear but for the wind it is linearised at, so its covariance is the posterior Cramer-Rao bound of these sensors and of
what the filter takes the air to be; that is the flight file's, and the gusts are learnt.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

from flightsw.aircraft import Aircraft
from flightsw.icd.port import D
from flightsw.process.node import Node
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.windcal.feed import WindCalibration
from flightsw.sixdof.windcal.layout import N_FREE
from flightsw.sixdof.windcal.params import WindCalParams
from flightsw.sixdof.windcal.record import WindReport
from flightsw.types import Health, NavState, SensorFrame, Text, Vec3
from sim_plant.sensors.terms import group_terms

KEPT = 20  # steps


def exact(believed: WindCalParams, grade: str) -> WindCalParams:
    """What is believed of the air, and of the sensors what the plant draws their errors by; not of paper. Raises ConfigError."""
    found = [group_terms(k, grade, {}, "") for k in ("air", "att", "gnss")]
    air, att, gnss = (g.columns for g in found if g is not None)
    speed, vane, fix = air["V"], air["alpha"], gnss["vel_h"]

    def axes(term: str) -> float:
        """RMS over the three axes of the attitude reference, of which the filter knows one size."""
        tilt, heading = getattr(att["tilt"], term), getattr(att["heading"], term)
        return math.sqrt((2.0 * tilt * tilt + heading * heading) / 3.0)

    return replace(
        believed, V_white_mps=speed.white, V_gm_mps=speed.gm, V_gm_tau_s=speed.tau_s, V_offset_mps=speed.constant,
        V_scale=speed.scale, vane_white=vane.white, vane_gm=vane.gm, vane_gm_tau_s=vane.tau_s, vane_offset=vane.constant,
        vane_scale=vane.scale, att_white=axes("white"), att_gm=axes("gm"), att_gm_tau_s=att["tilt"].tau_s,
        att_constant=axes("constant"), vel_mps=math.hypot(fix.gm, fix.constant), vel_tau_s=fix.tau_s, vel_white_mps=fix.white,
    )  # fmt: skip


class Twin(WindCalibration):
    """Stands in an aircraft's mission for its wind filter `flown`, hands everything on to it, and says what it could know."""

    def __init__(self, flown: WindCalibration, ac: Aircraft, grade: str, behind: bool) -> None:
        super().__init__(ac, exact(flown.p, grade), behind)
        self.flown = flown
        self._said: deque[tuple[int, Vec3]] = deque(maxlen=KEPT)
        self._nav = NavState()

    def feed(self, f: SensorFrame, updated: int, health: Health, core: TrustedCore) -> None:
        """See WindCalibration: both are fed."""
        self.flown.feed(f, updated, health, core)
        super().feed(f, updated, health, core)

    def publish(self, nav: NavState) -> None:
        """The flown filter's wind into nav [m/s, NED]; the twin's sigma is kept for `sigma`."""
        self.flown.publish(nav)
        self._nav.t_us, self._nav.valid = nav.t_us, nav.valid
        super().publish(self._nav)
        self._said.append((nav.t_us, self._nav.wind_sigma if self._nav.wind_valid else (math.nan,) * 3))

    def tell(self) -> list[Text]:
        """The flown filter's texts."""
        self.texts.clear()
        return self.flown.tell()

    def report(self) -> WindReport:
        """The flown filter's."""
        return self.flown.report()

    def sigma(self, t_us: int) -> Vec3:
        """1-sigma [m/s] NED of the wind at t_us, a step of late; not a number where there is none."""
        return next((s for t, s in self._said if t == t_us), (math.nan,) * 3)


def attach(node: Node[D], grade: str) -> Twin | None:
    """Let a twin fly with an aircraft that has a wind filter and sensors of a grade; None: it has none."""
    mission = node.app.mission  # type: ignore[attr-defined]
    if mission.wind is None:
        return None
    ac = node.app.ac  # type: ignore[attr-defined]
    mission.wind = Twin(mission.wind, ac, grade, len(mission.wind.x) > N_FREE)
    return mission.wind
