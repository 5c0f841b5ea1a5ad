"""What a program that must keep pace asks of the system: with the wall clock, or with the peers it answers in lockstep."""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
from collections.abc import Callable

SOON_US = 200  # [us] in which a peer in lockstep is expected to answer
TAKEN_US = 2000  # [us] gone by while the core was given away: somebody else needs it
REST, REST_MOST = (
    200,
    25_600,
)  # waits after that in which the core is left alone: twice as many each time somebody still needs it


def realtime_priority(priority: int = 20) -> str:
    """Try for SCHED_FIFO and locked memory. Returns one line that says what was granted; never raises."""
    said = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        said.append(f"SCHED_FIFO {priority}")
    except (OSError, AttributeError) as e:
        said.append(f"no SCHED_FIFO ({e})")
    try:
        libc = ctypes.CDLL(None, use_errno=True)
        mcl_current, mcl_future = 1, 2
        if libc.mlockall(mcl_current | mcl_future) == 0:
            said.append("memory locked")
        else:
            said.append(f"memory not locked ({os.strerror(ctypes.get_errno())})")
    except (OSError, AttributeError) as e:
        said.append(f"memory not locked ({e})")
    return ", ".join(said)


def take_turns() -> None:
    """Ask for SCHED_BATCH, where the system has it: woken, this program does not take the core from the one that woke it. In
    lockstep that is the plant, which has others to wake. Never raises."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


class Eager:
    """Waits for what a peer sends soon. To wake an idle core of a virtual machine takes up to 50 us, longer than a small tick:
    the core is kept awake for SOON_US, but given away again and again to whoever wants it, and left alone for REST waits and more
    once somebody does: who gives it away to one that computes on and on falls behind by all of its turn."""

    def __init__(self, poll: select.poll, now_us: Callable[[], int]) -> None:
        """poll: what is waited for; now_us: wall clock [us]."""
        self._poll, self._now_us = poll, now_us
        self._yield = getattr(os, "sched_yield", None)  # a system that has none is left to wake the core
        self._rest, self._next = 0, REST

    def soon(self) -> list[tuple[int, int]]:
        """What can be read, as `poll` tells it; [] if nothing came within SOON_US, or the core is left alone: now sleep."""
        ask, give, now_us = self._poll.poll, self._yield, self._now_us
        if (came := ask(0)) or give is None:
            return came
        if self._rest:
            self._rest -= 1
            return came
        last = now_us()
        end = last + SOON_US
        while not came and last < end:
            give()
            came, now = ask(0), now_us()
            if now - last > TAKEN_US:
                self._rest, self._next = self._next, min(2 * self._next, REST_MOST)
                return came
            last = now
        self._next = REST
        return came
