"""Deterministic order for packets of several senders: by (stamp, sysid, arrival order within the sysid).

Two onboard processes send to one socket, so arrival order depends on the scheduler. A packet is held back until the
newest stamp is `window_us` ahead of it; by then every sender's packets of that time have arrived, because in lockstep
the senders differ by a tick or two. The bytes of the log then depend on what was sent only.
"""

from __future__ import annotations

import heapq

WINDOW_US = 2_000_000  # [us] sample time; senders differ by 2 ticks at most in lockstep
MAX_JUMP_US = 3_600_000_000  # [us] a stamp further ahead than this is rubbish, not time


class Merger:
    """Reorders (stamp, sysid, packet); `late` counts packets that came after their place had been written."""

    def __init__(self, window_us: int = WINDOW_US) -> None:
        self.window_us = window_us
        self.late = 0
        self.rejected = 0
        self.newest_us = -1
        self._written_us = -1
        self._count = 0
        self._heap: list[tuple[int, int, int, tuple[bytes, ...]]] = []

    def push(self, t_us: int, sysid: int, *packets: bytes) -> bool:
        """Take packets with sample time [us]; False (and counted) if the time is out of the question."""
        if t_us < 0 or (t_us > self.newest_us + MAX_JUMP_US):
            self.rejected += len(packets)
            return False
        if t_us <= self._written_us:
            self.late += len(packets)
        if t_us > self.newest_us:
            self.newest_us = t_us
        self._count += 1
        heapq.heappush(self._heap, (t_us, sysid, self._count, packets))
        return True

    def ready(self) -> list[tuple[int, bytes]]:
        """(t_us, packet) whose turn has come, in order."""
        return self._pop(self.newest_us - self.window_us)

    def flush(self) -> list[tuple[int, bytes]]:
        """Everything still held, in order: call once at the end."""
        return self._pop(self.newest_us + 1)

    def _pop(self, below_us: int) -> list[tuple[int, bytes]]:
        heap, out = self._heap, []
        while heap and heap[0][0] < below_us:
            t_us, _, _, packets = heapq.heappop(heap)
            out += [(t_us, packet) for packet in packets]
        if out:
            self._written_us = max(self._written_us, out[-1][0])
        return out


class SequenceGaps:
    """Packets missing per sysid, by the 8-bit sequence number of each (sysid, compid)."""

    def __init__(self) -> None:
        self.dropped: dict[int, int] = {}
        self._last: dict[int, int] = {}

    def see(self, sysid: int, compid: int, seq: int) -> None:
        """Account for one packet. A repeat or a step back (jump of 128 or more) is reordering, not loss."""
        key = sysid << 8 | compid
        last = self._last.get(key)
        if last is None:
            self.dropped.setdefault(sysid, 0)
        else:
            jump = (seq - last - 1) & 255
            if jump >= 128:
                return
            self.dropped[sysid] += jump
        self._last[key] = seq
