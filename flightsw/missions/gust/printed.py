"""Numbers printed by Hoffmann and Luckner (2010), as printed, and what their corrections are: data only.

State order x1, alpha_W, V_W, q, alpha_K, V_K, Theta, H, alpha_b; outputs q, alpha, V_A, Theta, H. SI and radians.
"""

from __future__ import annotations

import math

import numpy as np

DEG = math.pi / 180.0

# seed, appendix: Kalman gain. Equation (1) says H = -Sigma C' Theta^-1, the numbers are those of the positive sign.
H_PRINTED = np.array(
    [
        [0.034, -0.22, 0.0005, -0.1383, 0.0029],
        [35.43, -105.67, -0.0507, 12.41, -0.0186],
        [-1.16, 2.2, -3.05, -9.26, -0.0468],
        [33.8, -30.9, -0.0069, 7.88, -0.0004],
        [10.22, -6.68, -0.0473, 11.06, -0.0186],
        [-8.9, 6.37, 0.078, -17.85, -0.0242],
        [0.8759, 0.006, -0.0009, 2.97, -0.0005],
        [-3.811, -1.41, 0.1841, -38.44, 1.3],
        [3.75, 1.86, -0.0009, 1.385, -0.0001],
    ]
)
# unit of the last printed digit of every entry above: what rounding alone may change
H_DIGIT = np.array(
    [
        [1e-3, 1e-2, 1e-4, 1e-4, 1e-4],
        [1e-2, 1e-2, 1e-4, 1e-2, 1e-4],
        [1e-2, 1e-1, 1e-2, 1e-2, 1e-4],
        [1e-1, 1e-1, 1e-4, 1e-2, 1e-4],
        [1e-2, 1e-2, 1e-4, 1e-2, 1e-4],
        [1e-1, 1e-2, 1e-3, 1e-2, 1e-4],
        [1e-4, 1e-3, 1e-4, 1e-2, 1e-4],
        [1e-3, 1e-2, 1e-4, 1e-2, 1e-1],
        [1e-2, 1e-2, 1e-4, 1e-3, 1e-4],
    ]
)

# seed, appendix: error covariance
SIGMA_PRINTED = np.array(
    [
        [0.024, -0.0001, 0.0003, 0.00, -0.0002, 0.0004, -0.00, 0.003, 0.00],
        [-0.0001, 0.0109, 0.0064, 0.0039, 0.0024, -0.0002, 0.0002, -0.0186, 0.0004],
        [0.0003, 0.0064, 0.6793, -0.0001, 0.0066, 0.3058, -0.0001, -0.046, -0.00],
        [0.00, 0.0039, -0.0001, 0.0037, 0.0011, -0.001, -0.0001, -0.0004, 0.0004],
        [-0.0002, 0.0024, 0.0066, 0.0011, 0.0018, -0.0008, 0.0001, -0.0186, 0.0001],
        [0.0004, 0.0002, 0.3058, -0.001, -0.0008, 0.3154, -0.0002, -0.024, -0.0001],
        [-0.00, 0.0002, -0.0001, 0.0001, 0.0001, -0.002, 0.000, -0.0005, 0.00],
        [0.003, -0.0186, -0.0468, -0.0004, -0.0186, -0.024, -0.005, 1.3, -0.0001],
        [0.00, 0.0004, -0.00, 0.0004, 0.0001, -0.0001, 0.00, -0.0001, 0.0004],
    ]
)
# misprints of Sigma (row, column) -> value to the digits of the print; found by the Riccati solution behind the gain
SIGMA_MISPRINTS = {
    (0, 0): 0.0023, (1, 5): 0.0002, (4, 5): 0.0008, (5, 4): 0.0008, (6, 5): -0.0002, (7, 6): -0.0005,
    (3, 6): 0.0001,
}  # fmt: skip

# Theta: sensor variances q, alpha, V_A, Theta, H (used there as spectral densities)
THETA = np.diag([(0.6 * DEG) ** 2, (0.5 * DEG) ** 2, 0.35**2, (0.2 * DEG) ** 2, 1.0])
# Xi as printed, in the order of the state; (0.35)^2 of the bias has no unit conversion there
XI_PRINTED = np.diag(
    [
        (0.1 * DEG) ** 2, (0.5 * DEG) ** 2 + 1.0, 0.35**2 + 1.0, (0.6 * DEG) ** 2, (0.5 * DEG) ** 2, 0.35**2,
        (0.2 * DEG) ** 2, 1.0, 0.35**2,
    ]
)  # fmt: skip
# the diagonal that gives the printed gain: x1, q, alpha_K and Theta are not determined by it (effectively zero)
XI_BACK_FITTED = np.diag([3e-8, 1.00, 1.365, 1e-7, 2e-8, 1.82e-3, 6e-7, 0.99, 1.83e-3])
E_VK_ALPHAW_PRINTED = 10.36  # [m/s^2 per rad] printed sign; -10.36 is right

SEED_SIGMA_W, SEED_SIGMA_U = 3.5, 5.0  # [m/s] "medium" turbulence
SEED_STEP_S = 0.02
