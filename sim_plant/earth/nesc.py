"""Columns of NASA/TM-2015-218675's tables: names, units, and the quantity of body.fly each one is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FT = 0.3048  # [m]
SLUG = 14.593902937  # [kg]
LBF = SLUG * FT  # [N]
NMI_H = 1852.0 / 3600.0  # [m/s]

# column: (quantity, what one unit of the column is in SI or degrees)
COLUMNS = {
    "time": ("time_s", 1.0),
    "feVelocity_ft_s_X": ("v_north_mps", FT),
    "feVelocity_ft_s_Y": ("v_east_mps", FT),
    "feVelocity_ft_s_Z": ("v_down_mps", FT),
    "altitudeMsl_ft": ("height_m", FT),
    "longitude_deg": ("lon_deg", 1.0),
    "latitude_deg": ("lat_deg", 1.0),
    "localGravity_ft_s2": ("gravitation_mps2", FT),
    "eulerAngle_deg_Yaw": ("psi_deg", 1.0),
    "eulerAngle_deg_Pitch": ("theta_deg", 1.0),
    "eulerAngle_deg_Roll": ("phi_deg", 1.0),
    "bodyAngularRateWrtEi_deg_s_Roll": ("p_degps", 1.0),
    "bodyAngularRateWrtEi_deg_s_Pitch": ("q_degps", 1.0),
    "bodyAngularRateWrtEi_deg_s_Yaw": ("r_degps", 1.0),
    "altitudeRateWrtMsl_ft_min": ("v_down_mps", -FT / 60.0),
    "airDensity_slug_ft3": ("density_kgpm3", SLUG / FT**3),
    "ambientPressure_lbf_ft2": ("pressure_pa", LBF / FT**2),
    "ambientTemperature_dgR": ("temperature_K", 5.0 / 9.0),
    "aero_bodyForce_lbf_X": ("Fx_N", LBF),
    "aero_bodyForce_lbf_Y": ("Fy_N", LBF),
    "aero_bodyForce_lbf_Z": ("Fz_N", LBF),
    "aero_bodyMoment_ftlbf_L": ("L_Nm", LBF * FT),
    "aero_bodyMoment_ftlbf_M": ("M_Nm", LBF * FT),
    "aero_bodyMoment_ftlbf_N": ("N_Nm", LBF * FT),
    "mach": ("mach", 1.0),
    "trueAirspeed_nmi_h": ("airspeed_mps", NMI_H),
}


def table(flown: dict[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    """The report's columns of what body.fly gave."""
    return {name: flown[quantity] / unit for name, (quantity, unit) in COLUMNS.items()}
