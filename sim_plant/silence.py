"""What the plant does about an aircraft it does not hear: end the run, let time stand still, or fly on by the servo unit."""

from __future__ import annotations

from collections.abc import Callable, Sequence

END, WAIT, FLY = RULES = ("end", "wait", "fly")


class Silence:
    """Who is silent now, and since when [s, wall]. `note` hears a line when somebody falls silent and when he is back."""

    def __init__(self, rule: str, end_s: float, names: Sequence[str], note: Callable[[str], None]) -> None:
        self.rule, self.end_s = rule, end_s
        self._names, self._note = names, note
        self.since: dict[int, float] = {}
        self.times = [0] * len(names)  # how often each fell silent

    def falls(self, i: int, since_s: float, now_s: float, t_us: int) -> None:
        """Aircraft i has not been heard since `since_s`; told once."""
        if i in self.since:
            return
        self.since[i] = since_s
        self.times[i] += 1
        what = "time stands still" if self.rule == WAIT else "its servo unit has it"
        self._note(
            f"{self._names[i]}: silent for {now_s - since_s:.1f} s at t = {t_us / 1e6:.2f} s: {what}, for at most "
            f"{self.end_s:g} s (clock.silence_end_s)"
        )

    def over(self, now_s: float) -> float:
        """Longest present silence [s] if that ends the run, else 0."""
        longest = max((now_s - s for s in self.since.values()), default=0.0)
        return longest if longest > self.end_s else 0.0

    def heard(self, i: int, now_s: float, t_us: int) -> bool:
        """Aircraft i has said something; True if it was silent."""
        since = self.since.pop(i, None)
        if since is None:
            return False
        self._note(f"{self._names[i]}: heard again after {now_s - since:.1f} s, at t = {t_us / 1e6:.2f} s")
        return True
