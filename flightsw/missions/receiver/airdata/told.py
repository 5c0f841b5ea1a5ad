"""What the air data say in words: channels that go and come back, a position found or lost."""

from __future__ import annotations

from flightsw.types import Text


class Told:
    """What was said last."""

    def __init__(self, patience: int = 0) -> None:
        """patience: so many steps in a row must disagree with what was said of the position before it is said anew."""
        self.excluded, self.valid = 0, False
        self._patience, self._other = patience, 0

    def changes(self, excluded: int, valid: bool, reason: str, at_once: bool = False) -> list[Text]:
        """Texts on what is another now: excluded, 9-bit mask of channels; whether the position is valid, and why not; at_once:
        without patience."""
        out = []
        if excluded != self.excluded:
            for c in range(9):
                if (excluded ^ self.excluded) >> c & 1:
                    name = f"{('V', 'beta', 'alpha')[c // 3]} of probe {c % 3 + 1}"
                    gone = bool(excluded >> c & 1)
                    out.append(Text(4 if gone else 5, f"air data: {name} {'excluded' if gone else 'back'}"))
            self.excluded = excluded
        self._other = self._other + 1 if valid != self.valid else 0
        if self._other > (0 if at_once else self._patience):
            out.append(Text(6 if valid else 5, f"wake position {'valid' if valid else f'lost: {reason}'}"[:50]))
            self.valid, self._other = valid, 0
        return out
