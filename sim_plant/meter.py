"""What a line to an external aircraft does to the replies: how long they take, how much that varies, which come late and which
never. A reply names the tick it answers by its stamp, so a late one and a lost one are told apart."""

from __future__ import annotations

from array import array

GIVEN_UP_US = 1_000_000  # [us] of simulated time after which a reply that has not come is lost
KEPT = 1_000_000  # latencies that are kept: three hours at 100 Hz
SMOOTH = 16  # of the jitter, as in RFC 3550 6.4.1


class LineMeter:
    """Accounts of one line. Times are wall seconds from an arbitrary start, stamps are simulated microseconds."""

    def __init__(self) -> None:
        self._open: dict[int, float] = {}  # stamp -> when it was first sent
        self._latencies = array("d")  # [s]
        self._last_s = -1.0
        self.jitter_s = 0.0  # smoothed difference of successive latencies
        self.on_time = self.late = self.unanswered = self.again = 0
        self.passed_over = 0  # as the other end says: a newer tick had come by then
        self.latest_ticks = 0  # most ticks a late reply was behind

    def sent(self, t_us: int, now_s: float) -> None:
        """The tick stamped `t_us` has gone out, for the first time or again."""
        if not t_us:  # the first is repeated until somebody has started
            return
        if t_us in self._open:
            self.again += 1
        else:
            self._open[t_us] = now_s

    def replied(self, t_us: int, now_s: float, present_us: int, period_us: int) -> None:
        """The reply to `t_us` has come while `present_us` is the open tick."""
        began = self._open.pop(t_us, None)
        if began is None:  # its repeat, or one that was given up
            return
        latency = now_s - began
        if self._last_s >= 0.0:
            self.jitter_s += (abs(latency - self._last_s) - self.jitter_s) / SMOOTH
        self._last_s = latency
        if len(self._latencies) < KEPT:
            self._latencies.append(latency)
        behind = (present_us - t_us) // period_us
        self.latest_ticks = max(self.latest_ticks, behind)
        if behind:
            self.late += 1
        else:
            self.on_time += 1

    def close(self, present_us: int) -> None:
        """The tick `present_us` is over: what has been open too long is lost."""
        while self._open:
            first = next(iter(self._open))
            if present_us - first <= GIVEN_UP_US:
                return
            del self._open[first]
            self.unanswered += 1

    @property
    def lost(self) -> int:
        """Ticks or replies that the line has lost."""
        return max(self.unanswered - self.passed_over, 0)

    def latency_ms(self, share: float) -> float:
        """Quantile [ms] of the latency, `share` of 0..1; 0 without any."""
        ordered = sorted(self._latencies)
        return 1e3 * ordered[min(int(share * len(ordered)), len(ordered) - 1)] if ordered else 0.0

    def accounts(self, name: str) -> dict[str, int | float]:
        """For the summary of a run."""
        return {
            f"latency_p50_ms.{name}": round(self.latency_ms(0.5), 3),
            f"latency_p99_ms.{name}": round(self.latency_ms(0.99), 3),
            f"latency_p999_ms.{name}": round(self.latency_ms(0.999), 3),
            f"latency_max_ms.{name}": round(self.latency_ms(1.0), 3),
            f"jitter_ms.{name}": round(1e3 * self.jitter_s, 3),
            f"replies_on_time.{name}": self.on_time,
            f"replies_late.{name}": self.late,
            f"replies_latest_ticks.{name}": self.latest_ticks,
            f"replies_lost.{name}": self.lost,
            f"ticks_passed_over.{name}": self.passed_over,
            f"ticks_sent_again.{name}": self.again,
        }

    def words(self) -> str:
        """How it is now, for a person."""
        return (
            f"{1e3 * max(self._last_s, 0.0):.1f} ms, jitter {1e3 * self.jitter_s:.1f} ms, "
            f"{self.late} late, {self.lost} lost"
        )
