"""What the receiver's missions ask of their guidances: the places and phases of the refuelling, the way to the tanker.

Ours, or anybody's by `package.module:Class` (`guid.path`, `join.guid.path`).
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from flightsw.missions.receiver.boom import Surroundings
from flightsw.missions.receiver.joinup import JoinUpGuidance, JoinUpParams, Sight
from flightsw.missions.receiver.refuel import RefuelGuidance, RefuelParams
from flightsw.plugins import made, refuse_ignored
from flightsw.terms import LawTerms
from flightsw.types import GuidanceCmd, NavState, SensorFrame, Text, Vec3


@runtime_checkable
class RefuelPath(Protocol):
    """Where the receiver is to be behind the tanker. A pure step, as all algorithms. `phase`: one of refuel.NAMES, 0 until
    navigation has been valid; `texts`: messages, which the mission takes away."""

    phase: int
    texts: list[Text]

    @property
    def obeys(self) -> tuple[str, ...]:
        """Keys of the table it reads, EVERY_KEY all; any other is refused unless it is as by default."""

    @property
    def at_rest(self) -> bool:
        """Whether the path of the phase has been flown to its end."""

    def step(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        """Place and speed to hold relative to the tanker, boom latch, phase, dt [s] after the last."""

    def command(self, action: int) -> tuple[bool, str]:
        """One of refuel.ACTIONS: accepted?, reason if not."""

    def recapture(self, nav: NavState, why: str = "navigation restarted") -> None:
        """The aircraft is not where it was to be, because navigation was lost or recovery had it: leave from where it is."""

    def use(self, p: RefuelParams) -> None:
        """Fly by these parameters from now on."""

    def places(self) -> tuple[Vec3, ...]:
        """Way-points [m, tanker body axes] to contact; none: it has none."""


@runtime_checkable
class JoinPath(Protocol):
    """What brings the receiver to the tanker by airspeed, altitude and turn rate. A pure step, as all algorithms. `phase`: one of
    joinup.NAMES; `ready`: station keeping may take over; `texts`: messages, which the mission takes away."""

    phase: int
    ready: bool
    texts: list[Text]

    @property
    def obeys(self) -> tuple[str, ...]:
        """Keys of the table it reads, EVERY_KEY all; any other is refused unless it is as by default."""

    @property
    def terms(self) -> LawTerms:
        """What the last command is made of."""

    def step(self, t_us: int, nav: NavState, s: Sight, dt: float) -> GuidanceCmd:
        """The command at t_us [us] with the tanker as seen, dt [s] after the last."""


REFUEL = {"refuelling": RefuelGuidance}
JOIN = {"join_up": JoinUpGuidance}
BESIDE = ("V_mps", "alt_m", "track_point_m")  # keys the mission on its way to the tanker reads itself


def make_refuel_path(p: RefuelParams, around: Surroundings | None) -> RefuelPath:
    """The guidance p.path names. Raises ConfigError, for way-points that cannot be flown too."""
    path = made(REFUEL, RefuelPath, p.path, "guid.path", p, around)  # type: ignore[type-abstract]
    refuse_ignored("guid.path", p.path, path.obeys, p)
    return path


def use_refuel_path(path: RefuelPath, p: RefuelParams) -> None:
    """Fly by these parameters from now on. Raises ConfigError for a key the path does not obey."""
    refuse_ignored("guid.path", p.path, path.obeys, p)
    path.use(p)


def make_join_path(p: JoinUpParams) -> JoinPath:
    """The guidance p.path names. Raises ConfigError."""
    path = made(JOIN, JoinPath, p.path, "join.guid.path", p)  # type: ignore[type-abstract]
    refuse_ignored("join.guid.path", p.path, (*BESIDE, *path.obeys), p)
    return path
