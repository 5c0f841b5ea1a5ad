"""Index names of the plant's flat float64 vectors. Kernels take whole vectors; these names say what is where.

State `s` [NS]: attitude quaternion q_nb, body rates [rad/s], inertial velocity NED [m/s], position NED [m], thrust [N],
yawing moment of unequal thrust [N m], surface positions [rad] and rates [rad/s] in the order aileron, elevator, rudder,
fuel [kg]. Command `c` [NC]: three surface commands [rad], throttle [-], three jam flags (1 = surface frozen), fuel
transfer [kg/s]. Wind `w` [NW]: effective translational wind NED [m/s], effective rotational wind in body axes [rad/s].
"""

from __future__ import annotations

# state vector
S_Q, S_W, S_V, S_P, S_T, S_YAW, S_SURF, S_RATE, S_FUEL, NS = 0, 4, 7, 10, 13, 14, 15, 18, 21, 22
N_RIGID = 15  # part integrated by Runge-Kutta: attitude, rates, velocity, position, thrust and its moment
# command vector
C_SURF, C_THROTTLE, C_JAM, C_TRANSFER, NC = 0, 3, 4, 7, 8
# wind vector
W_N, W_ROT, NW = 0, 3, 6

# parameter vector: geometry, aerodynamic derivatives in the order of flightsw.aircraft.Aero, engine, controls, mass,
# tables
P_S, P_B, P_C = 0, 1, 2
CL0, CL_ALPHA, CL_ALPHADOT, CL_Q, CL_DE, CD0, K_POLAR = 3, 4, 5, 6, 7, 8, 9
CM0, CM_ALPHA, CM_ALPHADOT, CM_Q, CM_DE = 10, 11, 12, 13, 14
CY_BETA, CY_P, CY_R, CY_DR = 15, 16, 17, 18
CL_ROLL_BETA, CL_ROLL_P, CL_ROLL_R, CL_ROLL_DA, CL_ROLL_DR = 19, 20, 21, 22, 23
CN_BETA, CN_P, CN_R, CN_DA, CN_DR = 24, 25, 26, 27, 28
P_T0, P_LAPSE, P_IDLE, P_TAU, P_TSFC = 29, 30, 31, 32, 33
P_LO, P_HI, P_RATE, P_WN, P_ZETA = 34, 37, 40, 43, 44
P_EMPTY, P_FUEL_CAP, P_MAX = 45, 46, 47
# the earth (earth/model.py): 0 flat or 1 round, GM [m^3/s^2], equatorial radius [m], first eccentricity squared, J2, rate
# [rad/s], latitude [rad] of the map's origin, and the map: metres north and east per radian of latitude and longitude
P_ROUND, P_GM, P_RADIUS, P_ECC2, P_J2, P_OMEGA, P_LAT0, P_MAP_N, P_MAP_E = 48, 49, 50, 51, 52, 53, 54, 55, 56
# the wing beyond the straight line: incidences [rad] of its ends and width of the parabola to the top; 0 = no stall
P_STRAIGHT_HI, P_STRAIGHT_LO, P_ROUND_OFF, P_ASPECT = 57, 58, 59, 60
# compressibility: reference Mach (0 = none), cosine of the sweep, thickness, technology factor
P_MACH, P_SWEEP, P_THICK, P_TECH = 61, 62, 63, 64
# thrust line below the centre of gravity [m]; fuel ahead of it [m], at reference [kg]; spool limits [1/s]
P_BELOW, P_FUEL_X, P_FUEL_REF, P_SPOOL_0, P_SPOOL_1 = 65, 66, 67, 68, 69
# share of the thrust that the engines give [-], its arm [m]: the yawing moment of a newton commanded
P_POWER, P_ARM = 70, 71
# an ascent's temperature (kernels/air.py): levels (0 = none), where in the tables it begins
P_WARM, P_WARM_AT = 72, 73
# where coefficients of another form than the derivatives above begin; 0: none
P_SERIES = 74
P_NI, P_NM, P_NH, P_TABLES = 75, 76, 77, 78

# observation vector written by eom.observe
O_F, O_V, O_BETA, O_ALPHA, O_LIFT, O_DRAG, O_RHO, O_PRESS = 0, 3, 4, 5, 6, 7, 8, 9
O_MASS, O_MAG, O_ACC, O_WDOT, O_AVAIL, O_EULER, O_PROBE = 10, 11, 14, 17, 20, 21, 24  # probes: V, alpha, beta each
MAX_PROBES = 4
NO = O_PROBE + 3 * MAX_PROBES

# relative vector written by geometry.relative
R_XI, R_XIDOT, R_EL, R_AZ, R_EXT, R_EXTDOT, R_SPEED, NR = 0, 3, 6, 7, 8, 9, 10, 11

# bounds within which an aircraft needs no closer look at whether it is lost (lost.py): least and largest load factor [-],
# airspeed [m/s], least height [m], size of pitch, bank, incidence [rad] and rates [rad/s]
B_LOAD, B_V, B_HEIGHT, B_PITCH, B_BANK, B_ALPHA, B_RATE, NB = 0, 2, 3, 4, 5, 6, 7, 8

G0 = 9.80665  # [m/s^2] standard gravity, constant over the flat earth
