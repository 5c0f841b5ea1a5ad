"""Link log: every byte into and out of one flightsw, under the sample time of the tick that dealt with it.

Sound packets are stored as they are. What is no sound packet (rubbish, a packet cut short) goes in wrapped as
RAW_BYTES, so the file stays a `.tlog` and replay still meets it. In real time a TICK record opens each tick and carries
its time step. What was dropped unread is only counted (UNREAD).
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from flightsw.icd.tlog import GROUND_OUT, LINK_IN, LINK_OUT, TlogError, TlogWriter
from flightsw.icd.wire import BY_NAME, Sender
from flightsw.types import Settled

CHUNK = 240  # [byte] of RAW_BYTES.data
HEAD = (
    "# Parameters changed in flight, in force from the tick at t_s on. What the flight began with: flight_<name>.toml."
)
U32 = 0xFFFFFFFF
Heard = tuple[int, bool, bytes]  # link number, sound, datagram


class LinkRecorder:
    """Writer of link_<name>.tlog, and of params_<name>.toml beside it if a parameter is changed in flight. Raises TlogError
    naming the file if folder or disk refuse."""

    def __init__(self, path: str | Path, sysid: int) -> None:
        self.log = TlogWriter(path)
        # a writer of its own: record-only packets must not take sequence numbers of the link
        self._send = Sender(sysid, 0)
        self._unread = (0, 0)
        self._refused: tuple[int, ...] = ()
        path = Path(path)
        self.journal = path.with_name(f"params_{path.stem.removeprefix('link_')}.toml")
        self._changed = False

    def tick(self, t_us: int, dt_us: int, slips: int) -> None:
        """Open a real-time tick."""
        self.log.write(t_us, self._send.pack(BY_NAME["TICK"], t_us, dt_us, slips), LINK_IN)

    def unread(self, t_us: int, plant: int, ground: int) -> None:
        """Note how many datagrams of each link were dropped unread so far, if a number has changed."""
        if (plant, ground) != self._unread:
            self._unread = plant, ground
            self.log.write(t_us, self._send.pack(BY_NAME["UNREAD"], t_us, plant & U32, ground & U32), LINK_IN)

    def refused(self, t_us: int, counts: tuple[int, ...]) -> None:
        """Note how many packets signing has refused so far, by reason, if a number has changed."""
        if counts != self._refused and any(counts):
            self._refused = counts
            self.log.write(t_us, self._send.pack(BY_NAME["REFUSED"], t_us, *(n & U32 for n in counts)), LINK_IN)

    def inbound(self, t_us: int, heard: Iterable[Heard]) -> None:
        """Store what was received for tick `t_us` [us], in order."""
        for link, sound, datagram in heard:
            if sound:
                self.log.write_datagram(t_us, datagram, link)
            else:
                self._raw(t_us, datagram, link)

    def outbound(self, t_us: int, reply: bytes, telemetry: Iterable[bytes]) -> None:
        """Store the reply and the telemetry of tick `t_us` [us]."""
        if reply:
            self.log.write_datagram(t_us, reply, LINK_OUT)
        for d in telemetry:
            self.log.write_datagram(t_us, d, GROUND_OUT)

    def settled(self, changes: Iterable[tuple[int, Settled]]) -> None:
        """Write down parameters that came in force, each with its time [us] and who asked; at once: a killed run has them."""
        for t_us, done in changes:
            s = done.setting
            value = json.dumps(s.value)  # as in TOML
            entry = f"[[set]]\nt_s = {t_us / 1e6:.6f}\nkey = {json.dumps(s.key)}\nvalue = {value}\n"
            entry += f"system = {s.src_system}\ncomponent = {s.src_component}\n\n"
            try:
                with self.journal.open("a" if self._changed else "w", encoding="utf-8") as f:
                    f.write(entry if self._changed else f"{HEAD}\n\n{entry}")
            except OSError as e:
                raise TlogError(f"{self.journal}: cannot be written: {e.strerror}") from None
            self._changed = True

    def _raw(self, t_us: int, datagram: bytes, link: int) -> None:
        raw = BY_NAME["RAW_BYTES"]
        for at in range(0, max(len(datagram), 1), CHUNK):
            part = datagram[at : at + CHUNK]
            more = 1 if at + CHUNK < len(datagram) else 0
            values = raw.from_dict({"count": len(part), "more": more, "data": part.ljust(CHUNK, b"\0")})
            self.log.write(t_us, self._send.pack(raw, *values), link)

    def flush(self) -> None:
        """Hand everything to the operating system."""
        self.log.flush()

    def close(self) -> None:
        """Flush and close."""
        self.log.close()
