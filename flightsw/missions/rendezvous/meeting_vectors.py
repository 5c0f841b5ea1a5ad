"""What stands where in the vectors of the meeting (missions/rendezvous/meeting.py), and what is announced."""

from __future__ import annotations

LEG = 4  # phase after roll-out, besides those of the turn law

# parameters mp
(
    MP_SIDES,  # 1: the turn may be flown from either side
    MP_BOX_X,  # [m] half sizes of the box a rendezvous ends in
    MP_BOX_Y,
    MP_EDGE,  # share of the box beyond which a miss is announced
    MP_AHEAD,  # [s] before the turn from which on its end is judged
    MP_LEG,  # [s] longest leg; 0: none
    MP_LEG_ANGLE,  # [rad] to the track
    MP_LEG_GAIN,  # [rad/m] heading per distance from the track
    MP_LEG_TAU,  # [s] over which a miss along track is flown off
    MP_LEG_FROM,  # share of the box from which on a leg is flown
    MP_LEG_TO,  # share of the box that ends it
    MP_SPEED,  # [m/s] beyond the trim at which the receiver's speed is announced
    MP_SURE,  # sigma of the estimate by which a predicted miss lies outside to be announced
    MP_HOLD,  # [s] before the turn from which on the heading is held, so that it begins with wings level
    MP_STRAIGHT,  # 1: a late turn, and a leg that is behind, go straight to the place ahead of the receiver
    MP_DOUBT,  # 1: what is announced of a receiver off its plan allows for its course and for the mirror image of ranges
    MP_LEG_SIDED,  # [s] longest leg where the side is known and the place is met by then; no more than MP_LEG: no longer
    MP_SPEED_SURE,  # sigma of the receiver's speed that count in place of MP_SPEED where the side is known; 0: MP_SPEED
    MP_LEG_SHARE,  # of MP_LEG_FROM and MP_LEG_TO that counts for such a leg
    MP_AGAIN,  # 1: the last arc of a late turn may be broken off
    MP_WIND,  # [m/s] sigma of the own wind, per axis: counted beside the receiver's speed (MP_SPEED_SURE)
    MP_N,
) = range(22)
# state ms: side (0 not chosen, 1 as printed, -1 mirrored), whole turns added to the heading [rad], rotation of the axes [rad],
# start of the leg [s], announcements, predicted misses at the roll-out [m], 1 while turning towards the receiver first, 1
# while a leg leads away from the track, way of a late turn (WIDE, STRAIGHT, LAST)
M_SIDE, M_TURNS, M_CHI, M_SINCE, M_SAID, M_XP, M_YP, M_AWAY, M_OUT, M_WAY, M_N = range(11)
WIDE, STRAIGHT, LAST = 0, 1, 2  # arcs as planned; on the course to the place; the arc from it onto the track
# announcements, added up
SAY_LEG = 1  # the turn ends beside the track, a leg follows
SAY_FAR = 2  # neither turn nor leg reaches the box
SAY_SPEED = 4  # the receiver flies faster or slower than the tanker can
SAY_MISSED = 8  # over, and outside the box
