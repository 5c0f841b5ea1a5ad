"""What a view is: all that the ground knows of one mission. Figures, picture, words for the monitor, commands.

Shared parts of the ground ask every view that finds its messages in a log, and name none. Views are found by the entry points
`wakefield.views` (name = "package.module:VIEW"), those of this project like anybody's (ground.views.registry).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from ground.columns import Columns
from ground.link.packets import Fields

if TYPE_CHECKING:  # rerun is slow to import: only where something is drawn
    from ground.rrd.layout import Layout, Look
    from ground.rrd.series import Sink
    from ground.run import Run
    from ground.signals import Signal

Figure = float | int | str | bool | None
Figures = dict[str, Figure]
Mask = NDArray[np.bool_]
NOT_VALID, NOT_CURRENT = "not valid", "no report"  # words of the monitor that are shown as bad


@dataclass(frozen=True)
class Words:
    """A line of the monitor: what it is called, the message it rests on (it says nothing once that is old), text; bad: in red."""

    label: str
    source: str
    text: str
    bad: bool = False


class Heard(Protocol):
    """What the monitor has heard of one aircraft."""

    @property
    def t_us(self) -> int:
        """The aircraft's time [us]."""

    def get(self, name: str) -> Fields | None:
        """Newest of a message, None if there was none."""

    def age_s(self, name: str) -> float:
        """How far its sample lies behind the aircraft's time [s]; infinite if there was none."""

    def alarm(self, name: str) -> tuple[str, int] | None:
        """Words and time [us] of the last alarm in a message named in View.alarms, None if there was none."""


@dataclass(frozen=True)
class Value:
    """The number a command takes. at: index of the parameter it goes to; choices: value -> word, empty: a quantity greater than 0
    in `unit`; example: one of them."""

    at: int
    example: float
    unit: str = ""
    choices: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Command:
    """A word of `ground send`: MAV_CMD with param1..param7, of which `value`, if any, is given with it.

    missions: those that take it, words of WKF_MISSION, the first the one to name it by. to: the usual system id, None: it must be
    given. Two views may offer the same word: what the aircraft flies decides.
    """

    word: str
    command: int
    missions: tuple[str, ...]
    to: int | None = None
    params: tuple[float, ...] = (0.0,) * 7
    value: Value | None = None


class View(ABC):
    """One mission on the ground. Everything but `finds` may be left as it is here: nothing to say."""

    # usual system ids, for logs and links without a scenario
    aircraft: Mapping[int, str] = {}
    # messages stamped with a sample that may be long past, not with the tick of sending
    own_time: frozenset[str] = frozenset()
    # message -> words of an alarm in it ("" none), kept by the monitor after it is over
    alarms: Mapping[str, Callable[[Fields], str]] = {}
    commands: tuple[Command, ...] = ()
    # tab of its layout a picture shows; "": the first of all
    tab: str = ""
    # of a run that goes on: how much of its past what is drawn now depends on [s]
    memory_s: float = 5.0

    @abstractmethod
    def finds(self, tlm: Columns) -> bool:
        """Whether this telemetry has the mission's messages."""

    def counts(self, tlm: Columns, sysid: int, t_us: NDArray[np.int64]) -> Mask | None:
        """At which times t_us [us] the errors of an aircraft's estimates count; None: it is not for this view to say."""
        return None

    def judges(self, tlm: Columns) -> frozenset[int]:
        """System ids of aircraft whose estimates its own figures judge, in place of the common ones of wind and pose."""
        return frozenset()

    def figures(self, run: Run) -> Figures:
        """Figures for summary.json: flat dotted keys, SI unless the key ends in another unit; without samples None."""
        return {}

    def signals(self, run: Run) -> list[Signal]:
        """What only this mission has, as arrays: paths `<group>/<aircraft>/...`. They stand: a common signal of that path is not
        made again."""
        return []

    def moment(self, run: Run) -> float | None:
        """A time [s] worth a picture; None: any."""
        return None

    def layout(self, run: Run, look: Look) -> Layout | None:
        """What the viewer shows of it; None: nothing."""
        return None

    def draw(self, sink: Sink, run: Run) -> None:  # noqa: B027 -- nothing to draw is allowed
        """Send its entities. What a view has drawn stands: the common part does not draw that path again."""

    def words(self, heard: Heard) -> list[Words]:
        """Lines of the monitor on one aircraft; [] if it has sent nothing of this mission."""
        return []
