"""Sources of relative position, and where each error lies in the state of the bank's filters."""

from __future__ import annotations

# sources, in the order of INTEGRITY_SOURCE
REL, GNSS, BOOM, WAKE = range(4)
SOURCES = 4
NAMES = ("relative sensor", "GNSS", "boom", "wake position")

# state, tanker body axes unless said
B_D, B_U = 0, 3  # NED: [m] receiver's centre of gravity from the tanker's, [m/s] its velocity less the tanker's
B_RS, B_RC, B_RV = 6, 9, 12  # relative sensor: slow error [m], constant error [m], slow error of its velocity [m/s]
B_G, B_GV = 15, 18  # GNSS difference NED: slow error [m], of its velocity [m/s]
B_AT = 21  # [rad] error of the tanker's attitude, a small turn
B_OB = 24  # [m] boom's fixed error at contact
B_AB = 27  # [m/s^2] NED: slow error of the relative acceleration
NB = 30  # of the sources without WAKE, which has two of each of its own:
B_OW, B_FW = 30, 32  # [m] lasting and passing error of the wake position's rows
NB_WAKE = 34
D, U = slice(B_D, B_D + 3), slice(B_U, B_U + 3)
RS, RC, RV = slice(B_RS, B_RS + 3), slice(B_RC, B_RC + 3), slice(B_RV, B_RV + 3)
G, GV, AT = slice(B_G, B_G + 3), slice(B_GV, B_GV + 3), slice(B_AT, B_AT + 3)
OB, AB = slice(B_OB, B_OB + 3), slice(B_AB, B_AB + 3)
OW, FW = slice(B_OW, B_OW + 2), slice(B_FW, B_FW + 2)
# errors that grow when a source may be wrong: of its position, of its rate
POSITION = (RS, G, OB, OW)
RATE = (RV, GV, slice(0, 0), slice(0, 0))
OWN = (slice(B_RS, B_G), slice(B_G, B_AT), slice(B_OB, B_AB), slice(B_OW, NB_WAKE))  # all errors of a source
SLOW = (RS, RC, G, OB, OW)  # errors that last

# rows of one source: so many at most
ROWS = 6
