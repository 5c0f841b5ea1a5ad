"""Time stamps of a link: which are believed. Pure: time is what the tick's HIL_SENSOR says, never a clock.

A frame (HIL_SENSOR) opens a tick; every other message is a sample, judged against the frame it came with. One bad stamp,
whatever it says, costs its own message only: a sample far ahead is refused and leaves no mark; a frame far off opens no tick,
and one near enough to be believed does not lock out those after it. Frames that go on agreeing with each other are believed
in the end: the plant has been restarted, or many of its datagrams were lost.
"""

from __future__ import annotations

from flightsw.icd.wire import Counters

EPOCH_US = 1_700_000_000_000_000  # [us] unix time of sample time 0; a multiple of 4
AHEAD_US = 50_000  # [us] a sample may be ahead of its tick: another aircraft's clock in real time
STALE_US = 10_000_000  # [us] older samples are refused; twice the longest latency a scenario may ask for
JUMP_US = 100_000  # [us] a single frame may be ahead of, or behind, the last
AGREE = 5  # [frame] in a row that make a new time, none of the old one among them
LIMIT_US = 2**63 // 1000  # [us] TIMESYNC carries nanoseconds in 64 bits; unix time fits until 2262
MS = 1 << 32  # time_boot_ms goes round after 49.7 days


def boot_ms(t_us: int) -> int:
    """Time [us] as time_boot_ms, which goes round after 2^32 ms."""
    return t_us // 1000 % MS


def from_boot_ms(ms: int, now_us: int) -> int:
    """Time [us] of a time_boot_ms: of all the times it may stand for, the one nearest to `now_us`."""
    now = now_us // 1000
    return (now + (ms - now + MS // 2) % MS - MS // 2) * 1000


class Samples:
    """Stamps of the samples of a link, each kind in order; `count` gets what is refused."""

    def __init__(self, count: Counters) -> None:
        self.count = count
        self._old: dict[int, int] = {}  # kind -> time up to which stamps are old

    def take(self, kind: int, t_us: int, now_us: int) -> bool:
        """Whether a sample of `kind` stamped `t_us` is to be used in the tick at `now_us` [us]."""
        if t_us > now_us + AHEAD_US:
            self.count.ahead += 1
            return False
        if t_us < now_us - STALE_US:
            self.count.stale += 1
            return False
        if t_us <= self._old.get(kind, -1):
            self.count.out_of_order += 1
            return False
        # a stamp ahead of the tick may be wrong: what comes in time afterwards is still new
        self._old[kind] = t_us if t_us < now_us else now_us
        return True


class Frames:
    """Stamps of HIL_SENSOR. `raw` is the plant's time of the last frame taken (-1: none); onboard time is raw + `offset`, and
    never runs back: after a restart of the plant the offset lets it go on.
    """

    def __init__(self, count: Counters) -> None:
        self.count = count
        self.raw = -1
        self.offset = 0
        self._before = -1  # frame taken before the last one that moved time on
        self._rival = -1
        self._votes = 0

    def take(self, t_us: int, onboard_us: int) -> bool:
        """Whether a frame stamped `t_us`, not equal to `raw`, opens a tick; onboard_us [us]: time of the last tick."""
        if t_us >= LIMIT_US:
            self.count.ahead += 1
            return False
        if self.raw < 0 or (t_us > self._before and -JUMP_US <= t_us - self.raw <= JUMP_US):
            if t_us > self.raw:
                self._before = self.raw
            self.raw, self._votes = t_us, 0
            return True
        if t_us > self.raw:
            self.count.ahead += 1
        else:
            self.count.out_of_order += 1
        step = t_us - self._rival
        self._votes = self._votes + 1 if self._votes and 0 <= step <= JUMP_US else 1
        self._rival = t_us
        if self._votes < AGREE:
            return False
        if t_us + self.offset <= onboard_us:
            self.offset = onboard_us + step - t_us
        self.raw, self._before, self._votes = t_us, t_us - step - 1, 0
        return True
