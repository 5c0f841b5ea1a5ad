"""STATUSTEXT of any length, and answers to commands that name the text with their reason.

MAVLink's own scheme (mavlink.io, STATUSTEXT): chunks of 50 bytes under one id, the last one shorter, if need be empty.
"""

from __future__ import annotations

from flightsw.icd.port import D, Sends
from flightsw.icd.wire import BY_NAME
from flightsw.types import Ack

CHUNK = 50  # [byte]
LONGEST = 10 * CHUNK  # [byte] longer texts are cut
OPEN_MAX = 16  # texts under way a Joiner keeps
WARNING = 4  # MAV_SEVERITY
_TEXT, _ACK = BY_NAME["STATUSTEXT"], BY_NAME["COMMAND_ACK"]


def text(send: Sends[D], severity: int, words: str) -> D:
    """STATUSTEXT packets of a line: one with id 0 if it fits, else chunks."""
    data = words.encode("ascii", "replace")
    if len(data) <= CHUNK:
        return send.pack(_TEXT, severity & 7, data, 0, 0)
    return _chunks(send, severity, data, send.new_ident())


def _chunks(send: Sends[D], severity: int, data: bytes, ident: int) -> D:
    data = data[: LONGEST - 1]
    parts = [data[i : i + CHUNK] for i in range(0, len(data) + 1, CHUNK)]  # full chunks are followed by an empty one
    return send.join([send.pack(_TEXT, severity & 7, part, ident, k) for k, part in enumerate(parts)])


def answer(send: Sends[D], a: Ack) -> D:
    """COMMAND_ACK; where there is a reason, its STATUSTEXT first and that text's id in result_param2."""
    parts, ident = [], 0
    if a.reason:
        ident = send.new_ident()
        parts.append(_chunks(send, WARNING, a.reason.encode("ascii", "replace"), ident))
    parts.append(send.pack(_ACK, a.command, a.result, 0, ident, a.target_system, a.target_component))
    return send.join(parts)


class Joiner:
    """Puts chunks together again. Chunks that never came leave " ... " in the line."""

    def __init__(self) -> None:
        self._open: dict[tuple[int, int, int], dict[int, str]] = {}

    def take(self, sysid: int, compid: int, words: str, ident: int, seq: int) -> str | None:
        """A STATUSTEXT of system and component `sysid`, `compid`: the whole line once it is complete, else None."""
        if not ident:
            return words
        key = (sysid, compid, ident)
        if key not in self._open and len(self._open) >= OPEN_MAX:
            del self._open[next(iter(self._open))]
        parts = self._open.setdefault(key, {})
        parts[seq] = words
        if len(words.encode()) >= CHUNK:
            return None
        del self._open[key]
        return "".join(parts.get(k, " ... ") for k in range(seq + 1))
