"""Where each quantity lies in the vectors of a rigid aircraft's models and estimators.

Integers, because compiled kernels take them as constants; slices for what is moved as a whole.
"""

from __future__ import annotations

# state; in brackets where that of a receiver relative to its tanker differs
X_V, X_BETA, X_ALPHA = 0, 1, 2  # [m/s], [rad], [rad]
X_P, X_Q, X_R = 3, 4, 5  # [rad/s] body rates (less the tanker's, own axes)
X_PSI, X_THETA, X_PHI = 6, 7, 8  # [rad] 3-2-1 angles, NED to body (tanker body to own body)
X_X, X_Y, X_Z = 9, 10, 11  # [m] position NED (xi, tanker body axes)
X_WN, X_WE, X_WD = 12, 13, 14  # [m/s] wind NED
NX = 15
X_PE, X_QE, X_RE = 15, 16, 17  # [rad/s] effective rotational wind, own body axes; a receiver's, where it is asked for
NX_ROT = 18
AIR = slice(X_V, X_ALPHA + 1)
RATE = slice(X_P, X_R + 1)
EULER = slice(X_PSI, X_PHI + 1)
POS = slice(X_X, X_Z + 1)
WIND = slice(X_WN, X_WD + 1)
ROT = slice(X_PE, X_RE + 1)

# columns of a noise factor SQ: one a state, then the wind's increments; a state from X_PE on has the column BEYOND after its own
N_WN, N_WE, N_WD = 15, 16, 17  # [m/s] per step
N_WIND = slice(N_WN, N_WD + 1)
BEYOND = 3

# measurement codes; 0..11 read what the state holds there (of a receiver: inertial body rates, the rest relative to the tanker)
M_V, M_BETA, M_ALPHA = 0, 1, 2  # [m/s], [rad], [rad]
M_RATE = 3  # .. 5 [rad/s]
M_EULER = 6  # .. 8 [rad]
M_POS = 9  # .. 11 [m]
M_VEL = 12  # .. 14 [m/s] inertial velocity NED (d(xi)/dt, tanker body axes)
M_WIND = 15  # .. 17 [m/s] of a free aircraft: wind NED, calculated
M_OWN_VEL = 15  # .. 17 [m/s] of a receiver: own inertial velocity NED
FREE_CHANNELS, RELATIVE_CHANNELS = 15, 18  # codes of readings, as against what is calculated from several

# one stage of the tanker, known from its data link
TK_P, TK_Q, TK_R = 9, 10, 11  # [rad/s] body rates
TK_PD, TK_QD, TK_RD = 12, 13, 14  # [rad/s^2] their derivatives
TK_VN, TK_VE, TK_VD = 15, 16, 17  # [m/s] inertial velocity NED
TK = 18
TK_DCM = slice(0, TK_P)  # [-] NED to body, row by row
TK_RATE = slice(TK_P, TK_R + 1)
TK_RATE_DOT = slice(TK_PD, TK_RD + 1)
TK_VEL = slice(TK_VN, TK_VD + 1)
TK_START, TK_MIDDLE, TK_END = 0, 1, 2  # stages of a step
