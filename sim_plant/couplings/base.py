"""What a coupling between aircraft is to the world."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim_plant.truth import Truth


class Coupling:
    """Base of what acts between the members of a world. The world calls, in the order of all couplings, three times a tick:
    place(), then wind and observation of every member, act(), then sensors and commands, advance() with the members' own."""

    def place(self) -> None:
        """By the states alone, before the air: who is where."""

    def act(self) -> None:
        """By what all have observed: what they do to each other during this tick, and what their sensors will see of it."""

    def advance(self) -> None:
        """Fly on what the coupling itself moves."""

    def others(self, own: Truth) -> list[tuple[int, Truth]]:
        """(sysid, truth) of what flies without being a member; own: truth of the first member now."""
        return []
