"""What the receiver says of itself in a flight without a fault: sources it doubts, warnings, and why it leaves."""

from __future__ import annotations

from hil_scripts.studies.integrity.flight import TEXT, WARNING
from hil_scripts.studies.integrity.snapshot import INTEGRITY, STATUS, phase_in, said

KINDS = {  # what a text is of: the first whose words are in it
    "attitude": ("gyro", "attitude reference"),
    "limits": ("at its limit", "held back"),
    "bound": ("position bound", "no bound"),
    "sources": ("disagree", "left out", "of position agree", "taken again"),
    "air": ("turbulence", "calm"),
    "boom": ("boom", "contact made"),
    "station": ("station error",),
    "recovery": ("recover", "envelope", "velocity"),
    "order": ("only allowed", " breakaway"),
    "navigation": ("navigation", "sensor", "estimate", "refused", "silent", "contradict"),
}
OTHER = "other"
SAID = (*KINDS, OTHER)


def kind_of(text: str) -> str:
    """Which of SAID a text is."""
    low = text.lower()
    return next((k for k, words in KINDS.items() if any(w in low for w in words)), OTHER)


class Words:
    """Of the receiver, from the start of a flight on; `hear` every tick."""

    def __init__(self) -> None:
        self.alerts = 0  # sources newly left out or in dispute
        self.breakaways = 0
        self.kinds: set[str] = set()
        self._doubted, self._phase = 0, ""

    def hear(self, datagrams: list[bytes]) -> None:
        """Take in its telemetry of a tick."""
        for kind, m in said(datagrams):
            if kind == INTEGRITY:
                doubted = m["excluded"] | m["undecided"]
                self.alerts += (doubted & ~self._doubted).bit_count()
                self._doubted = doubted
            elif kind == TEXT and m["severity"] <= WARNING:
                self.kinds.add(kind_of(m["text"]))
            elif kind == STATUS:
                phase = phase_in(m)
                if phase == "breakaway" != self._phase:
                    self.breakaways += 1
                    self.kinds.add(kind_of(m["reason"]))
                self._phase = phase

    def figures(self) -> dict[str, float]:
        """Counts, and 0 or 1 for each of SAID."""
        out = {"alerts": float(self.alerts), "breakaways": float(self.breakaways)}
        return out | {f"says.{k}": float(k in self.kinds) for k in SAID}
