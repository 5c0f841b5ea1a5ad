"""The receiver's way back behind the tanker while the protection has it."""

from __future__ import annotations

import math

from flightsw.kernels.rotations import less
from flightsw.sixdof.recovery.given import Rejoin
from flightsw.types import NavState, SensorFrame

FRESH_US = 500_000  # [us] age of both aircraft's velocities that can be compared
STATION_M = 300.0  # [m] beyond it the tanker's transmitted attitude swings the place it sees by metres
NEAR_M, BELOW_M, DOWN = 400.0, 60.0, math.radians(3.0)  # [m], [m] under the tanker, [rad] of path
ASIDE_M = 1.0  # [m] from the tanker's plane of symmetry, beyond which a receiver banks away from it
TURNING, BESIDE_M = math.radians(10.0), 5.0  # [rad] of the tanker's bank, [m] from its plane of symmetry
ALIKE_MPS, STRANGE_MPS = 4.0, 30.0  # [m/s] off the tanker's velocity: station keeping can go on; cannot


def behind(f: SensorFrame, nav: NavState) -> Rejoin:
    """Back to the tanker's velocity by the estimate, else by both aircraft's GNSS; down while close to it and not yet below."""
    ages = (f.t_us - f.peer.t_us, f.t_us - f.gnss_t_us)
    if f.peer.t_us <= 0 or f.gnss_t_us <= 0 or max(ages) > FRESH_US:
        return Rejoin(ready=False)
    own = nav.vel_n if nav.valid else f.gnss_vel_n
    n, e, d = less(f.peer.vel_n, own)
    seen = f.rel_valid and f.t_us - f.rel_t_us < FRESH_US
    close = seen and math.hypot(*f.rel_pos_t) < NEAR_M and f.rel_pos_t[2] < BELOW_M
    near = nav.rel_valid and math.hypot(*nav.rel_pos_t) < STATION_M
    ready = near and math.hypot(n, e) < ALIKE_MPS and abs(d) < ALIKE_MPS and not close
    off = min(math.hypot(n, e, d), math.dist(f.peer.vel_n, f.gnss_vel_n))
    strange = f"velocity {off:.0f} m/s off the tanker's" if off > STRANGE_MPS else ""
    side = _side(f, f.rel_pos_t[1] if seen else 0.0)
    return Rejoin(away=(n, e), path=-DOWN if close else 0.0, side=side, ready=ready, strange=strange)


def _side(f: SensorFrame, y: float) -> float:
    """Side to bank to, +1 right, -1 left, y [m] to the right of the tanker's plane: away from that; close to it out of its turn,
    as lift that is too much leads up to a tanker banked alike, whichever way it is tilted further into the turn."""
    if abs(y) < BESIDE_M:
        qw, qx, qy, qz = f.peer.q_nb
        # sin and cos of it, both times the cosine of the pitch
        bank = math.atan2(2.0 * (qy * qz + qw * qx), qw * qw - qx * qx - qy * qy + qz * qz)
        if abs(bank) > TURNING:
            return -math.copysign(1.0, bank)
    return math.copysign(1.0, y) if abs(y) > ASIDE_M else 1.0
