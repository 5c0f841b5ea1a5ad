"""Plans, logs and files as a ground station asks for them: the route as it is flown, read-only; no fence, no rally points, no
logs to fetch, no files. Everything has the own answer of its protocol, so that nobody waits (mavlink.io: mission, log, file
transfer).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from flightsw.icd.dialect import VALUES
from flightsw.icd.geo import WireMap
from flightsw.icd.wire import Sender
from flightsw.types import Vec3

ROUTE = VALUES["MAV_MISSION_TYPE_MISSION"]
UNSUPPORTED, NO_SUCH = VALUES["MAV_MISSION_UNSUPPORTED"], VALUES["MAV_MISSION_INVALID_SEQUENCE"]
FRAME, WAYPOINT = VALUES["MAV_FRAME_GLOBAL_RELATIVE_ALT_INT"], VALUES["MAV_CMD_NAV_WAYPOINT"]
READ = ("MISSION_REQUEST_LIST", "MISSION_REQUEST_INT", "MISSION_REQUEST")
# what would change a plan; a MISSION_COUNT from the ground is an upload, a MISSION_ACK the end of a download
WRITE = (
    "MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_REQUEST_PARTIAL_LIST",
)  # fmt: skip
LOGS = ("LOG_REQUEST_LIST", "LOG_REQUEST_DATA")
FILES = "FILE_TRANSFER_PROTOCOL"
MESSAGES = (*READ, *WRITE, "MISSION_ACK", *LOGS, FILES)
# file transfer: places in the header, operations and errors
SEQ, SESSION, OPCODE, SIZE, ASKED = 0, 2, 3, 4, 5
TERMINATE, RESET, LIST, OPEN, READ_FILE, OPEN_WRITE, CRC32, BURST = 1, 2, 3, 4, 5, 11, 14, 15
ACK, NAK = 128, 129
NO_SESSION, UNKNOWN, PROTECTED, NOT_FOUND = 4, 7, 9, 10

Maker = Callable[[], bytes]


class Plans:
    """Answers of one aircraft. `route` gives the places [m, NED] it flies by, `queue` takes what makes an answer."""

    def __init__(
        self, send: Sender, geo: WireMap, route: Callable[[], tuple[Vec3, ...]], queue: Callable[[Maker], None]
    ) -> None:
        self.send, self.geo, self._route, self._queue = send, geo, route, queue
        self._plan: tuple[Vec3, ...] | None = None  # as listed last: it stays the same while its items are fetched

    def handle(self, kind: str, f: dict[str, Any], sender: tuple[int, int]) -> None:
        """One of MESSAGES with fields `f`."""
        to = {"target_system": sender[0], "target_component": sender[1]}
        if kind in READ:
            self._read(kind, f, to)
        elif kind in WRITE:
            self._say("MISSION_ACK", type=UNSUPPORTED, mission_type=f.get("mission_type", ROUTE), **to)
        elif kind == "LOG_REQUEST_LIST":
            self._say("LOG_ENTRY")
        elif kind == "LOG_REQUEST_DATA":
            self._say("LOG_DATA", id=f["id"], ofs=f["ofs"])
        elif kind == FILES:
            self._say(FILES, payload=refusal(bytes(f["payload"])), **to)

    def _say(self, name: str, **fields: Any) -> None:
        self._queue(partial(self.send.named, name, **fields))

    def _read(self, kind: str, f: dict[str, Any], to: dict[str, int]) -> None:
        plan = f["mission_type"]
        if kind == "MISSION_REQUEST_LIST":
            count = 0
            if plan == ROUTE:
                self._plan = self._route()
                count = len(self._plan)
            self._say("MISSION_COUNT", count=count, mission_type=plan, **to)
            return
        if plan == ROUTE and self._plan is None:
            self._plan = self._route()
        items, seq = self._plan if plan == ROUTE and self._plan is not None else (), f["seq"]
        if seq >= len(items):
            self._say("MISSION_ACK", type=NO_SUCH, mission_type=plan, **to)
            return
        lat, lon, alt = self.geo.encode(items[seq])
        self._say(
            "MISSION_ITEM_INT", seq=seq, frame=FRAME, command=WAYPOINT, autocontinue=1, x=lat, y=lon,
            z=alt - self.geo.alt0, mission_type=plan, **to,
        )  # fmt: skip


def refusal(asked: bytes) -> list[int]:
    """Payload [251] of the answer to a file transfer request: there are no files. Ending sessions of which there are none is
    granted."""
    op = asked[OPCODE]
    if op in (TERMINATE, RESET):
        error = 0
    elif op in (LIST, OPEN, CRC32):
        error = NOT_FOUND
    elif op in (READ_FILE, BURST):
        error = NO_SESSION
    else:
        error = PROTECTED if TERMINATE < op < BURST else UNKNOWN
    out = bytearray(251)
    out[SEQ : SEQ + 2] = ((int.from_bytes(asked[SEQ : SEQ + 2], "little") + 1) & 0xFFFF).to_bytes(2, "little")
    out[SESSION], out[OPCODE], out[ASKED] = asked[SESSION], NAK if error else ACK, op
    if error:
        out[SIZE], out[12] = 1, error
    return list(out)
