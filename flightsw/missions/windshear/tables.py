"""The tables of a windshear flight file."""

from __future__ import annotations

from dataclasses import dataclass, field

from flightsw.missions.windshear.control import NidParams
from flightsw.missions.windshear.estimator import WindshearParams
from flightsw.missions.windshear.guidance import WindshearGuidanceParams
from flightsw.missions.windshear.monitor import MonitorParams
from flightsw.missions.windshear.trust import TrustParams


@dataclass(frozen=True)
class WindshearNavTable(WindshearParams):
    """[nav] of a windshear flight file: the estimator, the model-free monitor beside it, and when neither is flown by."""

    monitor: MonitorParams = field(default_factory=MonitorParams)
    trust: TrustParams = field(default_factory=TrustParams)


@dataclass(frozen=True)
class WindshearMissionParams:
    """[nav], [guid] and [ctrl] of a windshear flight file."""

    nav: WindshearNavTable = field(default_factory=WindshearNavTable)
    guid: WindshearGuidanceParams = field(default_factory=WindshearGuidanceParams)
    ctrl: NidParams = field(default_factory=NidParams)
