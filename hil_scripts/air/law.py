"""Closed forms of gusts in isotropic turbulence, one-sided in angular frequency, to compare what the plant draws with.

Spectra: MIL-F-8785C 3.7. Spectra across two lines: transform of the correlation along them (Houbolt and Sen, NASA CR-2011, 1972);
for Dryden by modified Bessel functions, for von Karman by quadrature. docs/air.md 3 to 5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import gamma, k0, k1, kv

Arr = NDArray[np.float64]
KARMAN = 1.339


def spectrum(law: str, axis: int, om: Arr, sigma: float, L: float, V: float) -> Arr:
    """PSD [(m/s)^2 s/rad] of u, v or w (axis 0, 1, 2) at om [rad/s]; sigma, V [m/s], L [m]."""
    x = om * L / V
    c = sigma**2 * L / (np.pi * V)
    if law == "dryden":
        return 2.0 * c / (1.0 + x**2) if axis == 0 else c * (1.0 + 3.0 * x**2) / (1.0 + x**2) ** 2
    a = (KARMAN * x) ** 2
    if axis == 0:
        return np.asarray(2.0 * c / (1.0 + a) ** (5.0 / 6.0))
    return np.asarray(c * (1.0 + 8.0 / 3.0 * a) / (1.0 + a) ** (11.0 / 6.0))


def roll(om: Arr, sigma: float, L: float, V: float, b: float) -> Arr:
    """PSD of p [(rad/s)^2 s/rad] over a span b [m]."""
    return np.asarray(
        sigma**2 / (V * L) * 0.8 * np.cbrt(np.pi * L / (4.0 * b)) / (1.0 + (4.0 * b * om / (np.pi * V)) ** 2)
    )


def turning(law: str, axis: int, om: Arr, sigma: float, L: float, V: float, b: float) -> Arr:
    """PSD of q (axis 2, of w) or r (axis 1, of v) [(rad/s)^2 s/rad]."""
    lag = (4.0 if axis == 2 else 3.0) * b / (np.pi * V)
    return np.asarray((om / V) ** 2 / (1.0 + (lag * om) ** 2) * spectrum(law, axis, om, sigma, L, V))


def coherence(law: str, axis: int, om: Arr, y: float, L: float, V: float) -> Arr:
    """Cross spectrum over spectrum [-] (real) of one component on two lines y [m] apart, side by side."""
    return _across(law, axis, om / V, y, L) / spectrum(law, axis, om / V, 1.0, L, 1.0)


def _across(law: str, axis: int, k: Arr, y: float, L: float) -> Arr:
    """2/pi times the integral over x > 0 of R(x, y) cos(k x), variance 1."""
    if law == "dryden":
        s = np.sqrt(k**2 + 1.0 / L**2)
        z = y * s
        plain = 2.0 * y / (L * s) * k1(z)  # of exp(-r/L)
        by_r = 2.0 * k0(z)  # of exp(-r/L)/r
        q = 1.0 / L  # r exp(-r/L): minus the derivative of the first by it
        far = -(2.0 * y * k1(z) / s - 2.0 * y * q * (q / s) * ((y * k0(z) + k1(z) / s) / s + k1(z) / s**2))
        g = plain - far / (2.0 * L)
        side = y * y / (2.0 * L) * by_r  # of (f - g) y^2/r^2
        share = (far / (2.0 * L) - side, side, 0.0)[axis]
        return np.asarray((g + share) / np.pi)
    x = np.concatenate([np.linspace(0.0, 20.0 * y, 8001)[:-1], np.geomspace(20.0 * y, 30.0 * L, 8001)])
    r = np.hypot(x, y)
    z = r / (KARMAN * L)
    c = 2.0 ** (2.0 / 3.0) / gamma(1.0 / 3.0) * np.cbrt(z)
    f, fall = c * kv(1.0 / 3.0, z), 0.5 * c * z * kv(2.0 / 3.0, z)
    R = f - fall + fall * ((x / r) ** 2, (y / r) ** 2, 0.0)[axis]
    return np.array([2.0 / np.pi * np.trapezoid(R * np.cos(o * x), x) for o in k.tolist()])
