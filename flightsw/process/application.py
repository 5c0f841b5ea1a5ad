"""What a node runs: the application as it asks for it, and how the real one is made of a configuration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from flightsw.process.config import FlightConfig
from flightsw.strict import ConfigError
from flightsw.terms import Laws
from flightsw.types import HF_GNSS, HF_PEER, ActuatorCmd, SensorFrame, Snapshot, Vec3

if TYPE_CHECKING:
    from flightsw.missions.base import Report


class App(Protocol):
    """What the node asks of the application."""

    @property
    def commands(self) -> frozenset[int]:
        """MAV_CMD the mission takes; any other is answered by the services."""

    @property
    def reports(self) -> tuple[Report, ...]:
        """Messages only this mission sends."""

    @property
    def sends_relative(self) -> bool:
        """Whether it follows another aircraft and says where that is."""

    @property
    def laws(self) -> Laws:
        """Records of its control laws, as every snapshot has them."""

    @property
    def records(self) -> tuple[tuple[str, object], ...]:
        """Parameters in force: records by the name of their table, "" for the mission's own."""

    @property
    def phases(self) -> tuple[int, ...]:
        """WKF_PHASE it may be in; none: it does not say."""

    @property
    def fuel_capacity_kg(self) -> float:
        """What the tanks hold [kg]; 0: none that is measured."""

    def route(self) -> tuple[Vec3, ...]:
        """Places [m, NED] it flies by next; none: it does not fly by any."""

    def tick(self, frame: SensorFrame, dt_s: float) -> tuple[ActuatorCmd, Snapshot]:
        """One base tick."""


def make_app(cfg: FlightConfig) -> App:
    """The real application of a configuration. Raises ConfigError and the design errors of the control law."""
    from flightsw.app import FlightApp  # slow to import (numba, scipy): not before it is needed

    app = FlightApp(
        cfg.app.mission,
        cfg.app.aircraft,
        cfg.tables,
        base_rate_hz=cfg.app.base_rate_hz,
        mission_rate_hz=cfg.app.mission_rate_hz,
        link_delay_ticks=cfg.link.delay_ticks,
        where=f"flight configuration {cfg.app.name!r}",
    )
    if cfg.link.peer_sysid and not app.mission.may_watch & HF_PEER:
        raise ConfigError(
            f"link.peer_sysid = {cfg.link.peer_sysid}: mission {cfg.app.mission!r} listens to no other aircraft"
        )
    if cfg.link.raw_fix and not app.mission.may_watch & HF_GNSS:
        raise ConfigError(f"link.raw_fix = true: mission {cfg.app.mission!r} depends on no GNSS")
    return app
