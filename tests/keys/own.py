"""Parts that are not ours, for the keys that name one: each flies a little otherwise than what it stands for."""

from __future__ import annotations

from dataclasses import replace

from flightsw.aircraft import Aircraft, TwinJet
from flightsw.missions.gust.law import GustAlleviation
from flightsw.missions.gust.laws import GustCtrlTable
from flightsw.missions.gust.model import GustAircraft, Turbulence
from flightsw.missions.receiver.boom import Surroundings
from flightsw.missions.receiver.joinup import JoinUpGuidance, JoinUpParams
from flightsw.missions.receiver.refuel import RefuelGuidance, RefuelParams
from flightsw.missions.receiver.station_keeping import ReceiverControl, ReceiverCtrlParams
from flightsw.missions.tanker.racetrack import RacetrackGuidance, RacetrackParams
from flightsw.missions.windshear.control import NidParams, WindshearControl
from flightsw.missions.windshear.guidance import WindshearGuidance, WindshearGuidanceParams
from flightsw.sixdof.autopilot import TankerControl, TankerCtrlParams


class Autopilot(TankerControl):
    """Softer in altitude."""

    def __init__(self, ac: Aircraft, p: TankerCtrlParams, dt_s: float) -> None:
        super().__init__(ac, replace(p, w_alt_m=2.0 * p.w_alt_m), dt_s)


class StationKeeping(ReceiverControl):
    """Softer in place."""

    def __init__(self, ac: Aircraft, tanker: Aircraft, p: ReceiverCtrlParams, dt_s: float) -> None:
        super().__init__(ac, tanker, replace(p, w_pos_m=(1.0, 1.0, 1.0)), dt_s)


class Feedback(GustAlleviation):
    """Less flap."""

    def __init__(self, p: GustCtrlTable, ac: GustAircraft, t: Turbulence, dt: float, late_steps: int) -> None:
        super().__init__(replace(p.alleviation, late_steps=late_steps, flap=0.1), ac, t, dt, "less_flap")


class Inversion(WindshearControl):
    """Softer in speed."""

    def __init__(self, p: NidParams, ac: TwinJet) -> None:
        super().__init__(replace(p, k_speed_1ps=0.5 * p.k_speed_1ps), ac)


class Path(RacetrackGuidance):
    """Slower."""

    def __init__(self, p: RacetrackParams) -> None:
        super().__init__(replace(p, V_mps=p.V_mps - 5.0))


class Refuelling(RefuelGuidance):
    """Quicker to its place."""

    def __init__(self, p: RefuelParams, around: Surroundings | None = None) -> None:
        super().__init__(replace(p, v_join_mps=2.0 * p.v_join_mps), around)


class Joining(JoinUpGuidance):
    """Slower on its way."""

    def __init__(self, p: JoinUpParams) -> None:
        super().__init__(replace(p, V_mps=p.V_mps - 5.0))


class Shear(WindshearGuidance):
    """Another speed over ground."""

    def __init__(self, p: WindshearGuidanceParams) -> None:
        super().__init__(replace(p, approach=replace(p.approach, gain_1ps=0.5 * p.approach.gain_1ps, ground_mps=80.0)))
