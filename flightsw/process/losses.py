"""What an onboard process has lost or refused since it last said so, in words."""

from __future__ import annotations

from flightsw.icd.signing import REASONS
from flightsw.types import Text

WARNING = 4  # MAV_SEVERITY
KINDS = ("refused for their time stamp", "dropped unread", "of no operator refused")


class Losses:
    """Counts as last told. Asked once a second, so that a warning cannot flood."""

    def __init__(self) -> None:
        self._told: tuple[int, ...] = (0,) * len(KINDS)
        self._told_refused: tuple[int, ...] = (0,) * len(REASONS)

    def tell(self, slips: int, lost: tuple[int, int, int], refused: tuple[int, ...]) -> list[Text]:
        """Texts for loop periods slipped since the last call, and for packets lost so far per KINDS, and refused by signing per
        REASONS, that are more than were told."""
        texts = [Text(WARNING, f"loop slipped {slips} periods")] if slips else []
        for words, n, before in zip(KINDS, lost, self._told, strict=True):
            if n != before:
                texts.append(Text(WARNING, f"{n - before} packets {words}"))
        self._told = lost
        if refused != self._told_refused:
            more = [f"{n - b} {r}" for r, n, b in zip(REASONS, refused, self._told_refused, strict=True) if n != b]
            texts.append(Text(WARNING, f"signing: refused {', '.join(more)}"))
            self._told_refused = refused
        return texts
