"""What a program that must keep pace with the wall clock asks of the system."""

from __future__ import annotations

import contextlib
import ctypes
import os


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
