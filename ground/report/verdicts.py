"""Judging acceptance figures, alike in every report: of several values the worst; what has no value has not passed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ground.report import page as p
from ground.report.load import Stat


@dataclass(frozen=True)
class Target:
    """An acceptance figure: every value of `values` in `case` must be `sense` limit ("within": limit +- tolerance)."""

    what: str
    case: str
    values: tuple[str, ...]
    sense: str
    limit: float
    tolerance: float = 0.0

    def met(self, value: float) -> bool:
        """Whether a value meets it."""
        if self.sense == "within":
            return abs(value - self.limit) <= self.tolerance
        return (
            value <= self.limit
            if self.sense == "<="
            else value < self.limit
            if self.sense == "<"
            else value >= self.limit
        )

    @property
    def text(self) -> str:
        """The demand in words."""
        if self.sense == "within":
            return f"{self.limit:g} ± {self.tolerance:g}"
        return f"{({'<=': '≤', '>=': '≥'}).get(self.sense, self.sense)} {self.limit:g}"

    def worse(self, a: float, b: float) -> bool:
        """Whether a is further from being met than b."""
        if self.sense == "within":
            return abs(a - self.limit) > abs(b - self.limit)
        return a < b if self.sense == ">=" else a > b


def worst(stats: Sequence[Stat], target: Target, scale: float = 1.0) -> Stat | None:
    """The value (in units of `scale`) furthest from being met, before all one that no run has although the study asks for it
    (its `why` says so); None where no campaign has any."""
    lacking = next((s for s in stats if s.value is None and s.why), None)
    if lacking is not None:
        return lacking
    out: Stat | None = None
    for s in stats:
        if s.value is not None and (
            out is None or out.value is None or target.worse(s.value / scale, out.value / scale)
        ):
            out = s
    return out


def met(stat: Stat, target: Target, scale: float = 1.0) -> bool:
    """Whether it has a value and that meets the target."""
    return stat.value is not None and target.met(stat.value / scale)


def css(stat: Stat, good: bool) -> str:
    """Colour of a verdict; none where there is no value to see."""
    return "" if stat.value is None else "good" if good else "bad"


def verdict(stat: Stat, good: bool) -> str:
    """Cell of a verdict."""
    return p.text("no figure" if stat.value is None else "met" if good else "not met", css(stat, good))


def card(verdicts: Sequence[bool]) -> list[str]:
    """Headline card of the verdicts; empty without any."""
    if not verdicts:
        return []
    text = f"{sum(verdicts)} of {len(verdicts)}"
    return [p.card(text, "acceptance figures met", "good" if all(verdicts) else "bad")]
