"""Readings that stand or fall together: those of one unit, and the accelerations with the pitch that turns them."""

from __future__ import annotations

from flightsw.missions.windshear import dynamics as k

INERTIAL = 1 << k.Y_Q | 1 << k.Y_XDD | 1 << k.Y_HDD
SATELLITES = 1 << k.Y_VG | 1 << k.Y_HD
TURNED = 1 << k.Y_XDD | 1 << k.Y_HDD  # by the pitch as read


def kept_out(benched: int) -> int:
    """Bits of the readings that are not to be believed because others, `benched` bits, are not. A benched one itself is not among
    them: it goes on being judged."""
    out = 0
    for unit in (INERTIAL, SATELLITES):
        if benched & unit:
            out |= unit
    if benched >> k.Y_TH & 1:
        out |= TURNED
    return out & ~benched
