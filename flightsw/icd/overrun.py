"""Datagrams the kernel threw away because a socket's receive buffer was full: the loss no program sees itself."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Protocol

TABLE = Path("/proc/net/udp")


class Waitable(Protocol):
    """A socket, or what stands for one."""

    def fileno(self) -> int:
        """Its number in this process."""


def overrun(sock: Waitable, table: Path = TABLE) -> int:
    """Datagrams dropped at `sock` so far; 0 where the system does not tell, and of what is no socket."""
    try:
        inode = str(os.fstat(sock.fileno()).st_ino)
        lines = table.read_text().splitlines()
    except OSError:
        return 0
    for line in lines[1:]:
        cells = line.split()
        if len(cells) > 12 and cells[9] == inode:
            return int(cells[12])
    return 0
