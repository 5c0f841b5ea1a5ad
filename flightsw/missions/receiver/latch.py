"""When the receiver asks for the boom, and when its signal says that there is no contact.

The latch is closed once the receptacle has stayed well inside the boom's envelope. At the edge, where closing enters it, a gust
takes it out again and the boom lets go.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flightsw.missions.receiver.boom import Surroundings
from flightsw.types import NavState, SensorFrame

if TYPE_CHECKING:
    from flightsw.missions.receiver.refuel import RefuelParams

UNSTEADY = "not steady inside the boom's envelope"


class Latch:
    """The receptacle's latch while closing and in contact. A pure step, as all algorithms."""

    def __init__(self, around: Surroundings | None) -> None:
        """`around`: what the boom reaches; None: not known, everywhere is well inside."""
        self._around = around
        self.open()

    def open(self) -> None:
        """Neither closing nor in contact."""
        self._coupled = False  # the boom has been in since closing began
        self._signal = False  # it is heard of
        self._inside_s = self._open_s = 0.0
        self.asked = False  # the latch is closed
        self.waits = False  # it would be, if the receiver were steady

    @property
    def made(self) -> bool:
        """Whether the boom has been in, or may be where none is heard of."""
        return self._coupled if self._signal else self.asked

    def step(self, f: SensorFrame, nav: NavState, at_rest: bool, p: RefuelParams, dt: float) -> str:
        """dt [s] later, at_rest: in the contact position. Why to leave the boom, "" for none."""
        depth = math.inf if self._around is None else self._around.depth(nav.rel_pos_t, nav.rel_euler)
        self._inside_s = self._inside_s + dt if depth >= p.boom_margin_m else 0.0
        self._signal = f.boom_t_us > 0
        self._coupled |= f.boom_contact
        self.asked = self._coupled or self._inside_s >= p.boom_steady_s
        self.waits = at_rest and not self.asked
        if f.boom_contact:
            self._open_s = 0.0
        elif self._coupled or self.waits or (at_rest and self._signal):
            # before the boom has been in, time counts in the contact position only; where none is heard of not at all
            self._open_s += dt
        if self._open_s < (p.boom_open_s if self._coupled else p.boom_make_s):
            return ""
        return "boom has let go" if self._coupled else UNSTEADY if self.waits else "no contact made"
