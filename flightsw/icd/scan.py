"""The one reader of recorded bytes: every record of a `.tlog` that can be trusted, and a count of what cannot.

A packet of the dialect counts only if its CRC is right. After damage the search goes on with the next sound packet. A packet
of an unknown message is kept where the chain of lengths is unbroken on both sides of it. The stamp has no CRC: one that is
more than `STAMP_SLACK_US` off the packet's own time, as its kind has it, or (without one) out of its sender's order is
damaged and its packet left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsw.icd.framing import CRC, EXTRA, HEAD, SIGNATURE, SIGNED, TIME, V1, V2, check, crc, length, next_sound

STAMP = 8  # [byte] before each packet: big-endian microseconds
STAMP_SLACK_US = 1_000_000  # [us] a sender's stamps may step back this far (packets overtaking each other)
EDGE_US = 3_600_000_000  # [us] first and last stamp may stand apart this far from the others
FEW = 3  # damaged stamps of a sender in a row
NEAR_BYTES = 1 << 16  # [byte] after damage a packet with a fitting stamp is looked for this far before any is taken
LONGEST = 300  # [byte] no record is longer
MOST = 0.5  # [-] junk from which a file is no log
_FIRST, _LARGEST = 64, 1 << 16  # records walked before their CRCs are compared in one go

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Records:
    """Sound records of a log, one row each, in file order. `raw`: the file."""

    raw: bytes
    stamp: Ints  # [us] as recorded, link number in the low two bits
    head: Ints  # offset of the magic byte
    size: Ints  # [byte] of the packet
    v1: NDArray[np.bool_]
    seq: Ints
    sysid: Ints
    compid: Ints
    msgid: Ints
    payload: Ints  # offset
    length: Ints  # [byte] of the payload as sent
    known: NDArray[np.bool_]  # message of the dialect, CRC right
    junk_bytes: int = 0  # belong to no record
    junk_places: int = 0  # runs of such bytes
    bad_stamps: int = 0  # sound packets left out for their stamp
    cut_bytes: int = 0  # of junk_bytes: an unfinished last record

    def __len__(self) -> int:
        return len(self.stamp)

    @property
    def damage(self) -> str:
        """What was left out, in words; "" if nothing."""
        size = len(self.raw)
        cut, inner = self.cut_bytes, self.junk_bytes - self.cut_bytes
        words = []
        if inner:
            places = self.junk_places - (cut > 0)
            words.append(f"{inner} of {size} bytes are damaged, in {places} place{'s' * (places > 1)}")
        if self.bad_stamps:
            words.append(f"{self.bad_stamps} time stamp{'s' * (self.bad_stamps > 1)} damaged")
        if cut:
            words.append(f"the last record is cut off ({cut} bytes)")
        return ", ".join(words)

    @property
    def mostly_junk(self) -> bool:
        """Whether more than half of the bytes belong to no record, or there are bytes and no record."""
        return bool(self.junk_bytes) and (self.junk_bytes > MOST * len(self.raw) or not len(self))


def _walk(raw: bytes, pos: int, limit: int, heads: list[int], sums: list[int]) -> int:
    """Append magic offset and CRC (without CRC_EXTRA) of up to `limit` records chained from `pos` by length; where it ended."""
    end = len(raw)
    last = end - STAMP - HEAD[V1] - CRC
    add, add_sum, mcrf = heads.append, sums.append, crc
    while pos <= last and limit:
        head = pos + STAMP
        magic = raw[head]
        if magic == V2:
            flags = raw[head + 2]
            stop = body = head + 10 + raw[head + 1]
            stop += CRC if not flags else CRC + SIGNATURE
            if flags & ~SIGNED:
                break
        elif magic == V1:
            body = head + 6 + raw[head + 1]
            stop = body + CRC
        else:
            break
        if stop > end:
            break
        add(head)
        add_sum(mcrf(raw[head + 1 : body]))
        pos = stop
        limit -= 1
    return pos


_EXTRA_IDS = np.array(sorted(EXTRA), dtype=np.int64)
_EXTRA_OF = np.array([EXTRA[i][0] for i in sorted(EXTRA)], dtype=np.int64)


def _step_crc(sums: Ints, byte: Ints) -> Ints:
    """CRC-16/MCRF4XX after one more byte."""
    t = (byte ^ sums) & 0xFF
    t = (t ^ t << 4) & 0xFF
    return sums >> 8 ^ t << 8 ^ t << 3 ^ t >> 4


def _columns(raw: bytes, heads: Ints) -> dict[str, NDArray]:
    """Header fields of the packets at `heads`."""
    buf = np.frombuffer(raw, dtype=np.uint8)

    def at(offset: Ints | int) -> Ints:
        return buf[heads + offset].astype(np.int64)

    v1 = at(0) == V1
    n = at(1)
    size = np.where(v1, 8 + n, 12 + n + SIGNATURE * (at(2) & 1 & ~v1))
    long = np.where(v1, 0, at(np.where(v1, 5, 8)) << 8 | at(np.where(v1, 5, 9)) << 16)
    msgid = at(np.where(v1, 5, 7)) | long
    stamp = np.zeros(len(heads), dtype=np.int64)
    for k in range(STAMP):
        stamp = stamp << 8 | at(k - STAMP)
    stamp = np.where(stamp >> 62, 1 << 62, stamp)  # rubbish as a time; so that differences fit
    return {
        "stamp": stamp, "head": heads, "size": size, "v1": v1, "seq": at(np.where(v1, 2, 4)), "sysid": at(np.where(v1, 3, 5)),
        "compid": at(np.where(v1, 4, 6)), "msgid": msgid, "payload": heads + np.where(v1, 6, 10), "length": n,
    }  # fmt: skip


def _sound(raw: bytes, c: dict[str, NDArray], sums: Ints) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(CRC right, message known) of the packets with header fields `c`, whose CRC without CRC_EXTRA is `sums`."""
    buf = np.frombuffer(raw, dtype=np.uint8)
    i = np.minimum(np.searchsorted(_EXTRA_IDS, c["msgid"]), len(_EXTRA_IDS) - 1)
    known = _EXTRA_IDS[i] == c["msgid"]
    end = c["payload"] + c["length"]
    sent = buf[end].astype(np.int64) | buf[end + 1].astype(np.int64) << 8
    return known & (_step_crc(sums, _EXTRA_OF[i]) == sent), known


def _starts_record(raw: bytes, pos: int) -> bool:
    """Whether the file ends at `pos` or the header of a whole packet follows the stamp there."""
    size = length(raw, pos + STAMP)
    return pos == len(raw) or (bool(size) and pos + STAMP + size <= len(raw))


def _after_damage(raw: bytes, pos: int, stamps: list[int]) -> int:
    """Start of the next record after the damaged one at `pos`; `stamps` [us]: of the last good ones. len(raw): none."""
    size, end = length(raw, pos + STAMP), len(raw)
    stop = pos + STAMP + size
    chained = size and (stop == end or (stop + STAMP < end and not check(raw, stop + STAMP)[0]))  # its length is right
    if chained and stop < end:
        stamps = [*stamps, int.from_bytes(raw[stop : stop + STAMP], "big")]
    first = head = next_sound(raw, pos + STAMP + 1)
    while head < (stop if chained else min(first + NEAR_BYTES, end)):
        if _fits(raw, head, stamps):
            return head - STAMP
        head = next_sound(raw, head + 1)  # that one may lie inside another's payload
    if chained:
        return stop
    return end if end - pos <= LONGEST else first - STAMP * (first < end)


def _fits(raw: bytes, head: int, stamps: list[int]) -> bool:
    """Whether the sound packet at `head` has a stamp near one of `stamps` [us] or near that of a sound packet behind it."""
    after = head + length(raw, head) + STAMP
    if after < len(raw) and not check(raw, after)[0]:
        stamps = [*stamps, int.from_bytes(raw[after - STAMP : after], "big")]
    stamp = int.from_bytes(raw[head - STAMP : head], "big")
    return any(abs(stamp - s) <= EDGE_US for s in stamps)


def _bad_stamps(raw: bytes, c: dict[str, NDArray]) -> NDArray[np.bool_]:
    """Stamps that are damaged: far from what the packet's own time says by the rule of its kind; for packets without a time,
    outside those before and behind them. At most `FEW` in a row: more are a clock that was set."""
    bad = np.zeros(len(c["stamp"]), dtype=bool)
    for s in np.unique(c["sysid"]):
        rows = np.flatnonzero(c["sysid"] == s)
        if (np.abs(np.diff(c["stamp"][rows])) > STAMP_SLACK_US).any():
            bad[rows] = _bad_of_sender(raw, {k: v[rows] for k, v in c.items()})
    return bad


def _bad_of_sender(raw: bytes, c: dict[str, NDArray]) -> NDArray[np.bool_]:
    t, n = c["stamp"], len(c["stamp"])
    bad, judged = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    usual: list[float] = []  # [us] a stamp's lead over its packet's own time, by kind
    kinds = [(int(i), np.flatnonzero(c["msgid"] == i)) for i in np.unique(c["msgid"]) if int(i) in TIME]
    for i, kind in sorted(kinds, key=lambda k: -len(k[1])):
        lead = t[kind] - _own_time(raw, c["payload"][kind], c["length"][kind], *TIME[i])
        if len(kind) > 2:
            usual.append(float(np.median(lead)))
            off = np.abs(lead - usual[-1]) > STAMP_SLACK_US
            few = _run_length(off) <= FEW
            bad[kind], judged[kind] = off & few, ~off | few
        else:  # too few to have a rule of their own
            judged[kind] = [any(abs(x - u) <= STAMP_SLACK_US for u in usual) for x in lead]
    good = judged & ~bad
    anchors = np.flatnonzero(good if good.sum() > 2 else ~bad)
    open_ = np.flatnonzero(~judged)
    if len(anchors) < 3 or not len(open_):
        return bad
    at = np.searchsorted(anchors, open_)
    left = anchors[np.maximum(at - 1, 0)]
    right = anchors[np.minimum(at + (anchors[np.minimum(at, len(anchors) - 1)] == open_), len(anchors) - 1)]
    low, high = np.minimum(t[left], t[right]), np.maximum(t[left], t[right])
    off = (t[open_] < low - np.where(left < open_, STAMP_SLACK_US, EDGE_US)) | (
        t[open_] > high + np.where(right > open_, STAMP_SLACK_US, EDGE_US)
    )
    bad[open_] = off & (high - low <= EDGE_US) & (_run_length(off) <= FEW)
    return bad


def _own_time(raw: bytes, payload: Ints, length: Ints, offset: int, size: int, factor: int) -> Ints:
    """Time [us] the packets carry themselves; cut zeros come back."""
    buf = np.frombuffer(raw, dtype=np.uint8)
    out = np.zeros(len(payload), dtype=np.int64)
    for k in reversed(range(size)):
        there = offset + k < length
        out = out << 8 | np.where(there, buf[payload + np.where(there, offset + k, 0)], 0)
    return factor * out


def _run_length(mask: NDArray[np.bool_]) -> Ints:
    """For each row the length of the run of equal values it is in."""
    edge = np.flatnonzero(np.diff(mask)) + 1
    size = np.diff(np.concatenate([[0], edge, [len(mask)]]))
    return np.repeat(size, size)


def scan(raw: bytes) -> Records:
    """All records of a file that can be trusted. Never raises, whatever the bytes."""
    kept = [_columns(bytes(16), np.empty(0, dtype=np.int64)) | {"known": np.empty(0, dtype=bool)}]
    pos, end, block = 0, len(raw), _FIRST
    junk = places = cut = 0
    last: list[int] = []  # stamps
    while pos < end:
        heads_list: list[int] = []
        sums: list[int] = []
        stop = _walk(raw, pos, block, heads_list, sums)
        heads = np.array(heads_list, dtype=np.int64)
        if len(heads):
            fields = _columns(raw, heads)
            right, of_dialect = _sound(raw, fields, np.array(sums, dtype=np.int64))
            fine = right | ~of_dialect
            good = len(heads) if fine.all() else int(np.argmin(fine))
            # an unknown packet at the end of the chain must be followed by a record
            while good and not of_dialect[good - 1]:
                if _starts_record(raw, stop if good == len(heads) else heads_list[good] - STAMP):
                    break
                good -= 1
            kept.append({k: v[:good] for k, v in (fields | {"known": of_dialect}).items()})
            last = fields["stamp"][max(good - 3, 0) : good].tolist() or last
            if good == len(heads) and len(heads) == block:
                pos, block = stop, min(2 * block, _LARGEST)
                continue
            pos = stop if good == len(heads) else heads_list[good] - STAMP
            if pos == end:
                break
        block = _FIRST
        resume = _after_damage(raw, pos, last)
        junk, places = junk + resume - pos, places + 1
        if resume == end and _is_cut(raw, pos):
            cut = end - pos
        pos = resume
    columns = {k: np.concatenate([part[k] for part in kept]) for k in kept[0]}
    bad = _bad_stamps(raw, columns)
    if bad.any():
        columns = {k: v[~bad] for k, v in columns.items()}
    return Records(raw, **columns, junk_bytes=junk, junk_places=places, bad_stamps=int(bad.sum()), cut_bytes=cut)


def _is_cut(raw: bytes, pos: int) -> bool:
    """Whether what is left from `pos` is the beginning of one record."""
    if len(raw) - pos < STAMP + 3:
        return True
    size = length(raw, pos + STAMP)
    return bool(size) and pos + STAMP + size > len(raw)
