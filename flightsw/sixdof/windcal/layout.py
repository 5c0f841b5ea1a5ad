"""Where each quantity lies in the state of the wind estimate, and in the rows of its histories."""

from __future__ import annotations

SLOW_N, SLOW_E, SLOW_D = 0, 1, 2  # [m/s] slow wind NED
GUST_N, GUST_E, GUST_D = 3, 4, 5  # [m/s] gust NED
SCALE = 6  # [-] of the airspeed readings, factor less one
OFFSET, OFFSET_GM = 7, 8  # [m/s] of the airspeed readings: constant and slowly varying part
ALPHA, BETA = 9, 10  # [rad] of the vanes, constant part
ALPHA_GM, BETA_GM = 11, 12  # [rad] slowly varying part
ATT, ATT_GM = 13, 16  # .. +2 [rad] attitude reference, rotation about each body axis: constant and slowly varying part
VEL = 19  # .. 21 [m/s] satellite velocity NED
WAKE = 22  # .. 24 [m/s] wind of a leader's wake, own body axes
N_FREE, N_BEHIND = 22, 25  # states of an aircraft alone, and of one behind another
SLOW = slice(SLOW_N, SLOW_D + 1)
GUST = slice(GUST_N, GUST_D + 1)

# readings, and rows of the measurement
Z_V, Z_BETA, Z_ALPHA = 0, 1, 2  # [m/s], [rad], [rad]

# rows of the histories; column 0 of each is time [s]
T = 0
H_VEL, H_QUAT, H_AIR = 1, 1, 1  # dead-reckoned velocity NED [m/s]; attitude quaternion; V, beta, alpha
MOTION, ATTITUDE, READINGS = 4, 5, 4  # columns
