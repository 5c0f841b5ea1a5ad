"""More than one fault in a variable, with a virtual sensor of the common value (sevil.md 9.4).

Three probes leave two parity dimensions, in which (f, f, 0) looks like (0, 0, -f). A prediction of the common value from
elsewhere (inertial velocity and wind estimate) adds the third. Hypotheses are sets s of faulty probes (3-bit masks): with the
faults on s projected out, the rest must agree within noise. The smallest set that passes is taken, and of equal ones the best.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.missions.receiver.airdata.fdi.metrics import threshold

Array = np.ndarray

SETS = (0b000, 0b001, 0b010, 0b100, 0b011, 0b101, 0b110, 0b111)  # by size
UNDECIDED = -1


def subset_statistics(r: Array, C: Array, sigma_c: float | None) -> Array:
    """gamma [N,8] of r [N,3] for each set of suspects (index = mask), chi-square with 3 - |s| degrees of freedom.

    r: readings minus expected ones minus the virtual sensor's value; C [3,3] or [N,3,3] covariance of the probes' part, e.g.
    sigma^2/n I; the common part has variance sigma_c^2 (C + sigma_c^2 1 1^T as a whole). sigma_c None: no virtual sensor,
    one degree of freedom less. Raises ValueError for sigma_c <= 0.
    """
    if sigma_c is not None and not sigma_c > 0.0:
        raise ValueError(f"sigma_c={sigma_c}; allowed > 0, or None without virtual sensor")
    r = np.asarray(r, dtype=float)
    inv_c = 0.0 if sigma_c is None else sigma_c**-2
    g = np.zeros((len(r), 8))
    for s in SETS[:-1]:
        rest = [i for i in range(3) if not (s >> i) & 1]
        W = np.linalg.inv(np.asarray(C, dtype=float)[..., rest, :][..., rest])
        x = r[:, rest]
        Wx = np.einsum("...ij,...j->...i", W, x)
        b = np.sum(Wx, axis=-1)
        g[:, s] = np.maximum(np.sum(x * Wx, axis=-1) - b * b / (W.sum(axis=(-1, -2)) + inv_c), 0.0)
    return g


def decide(r: Array, C: Array, sigma_c: float | None, p_false: float = 1e-4) -> Array:
    """Mask [N] of faulty probes (0: none), UNDECIDED where nothing fits; arguments of subset_statistics.

    Each hypothesis is tested at p_false. Without virtual sensor only none or one can be decided; with it, all three fits
    when nothing else does.
    """
    g = subset_statistics(r, C, sigma_c)
    extra = 0 if sigma_c is None else 1
    out = np.full(len(g), UNDECIDED)
    for size in range(4):
        dof = 2 - size + extra
        if dof < 1 and not (extra == 1 and size == 3):
            break
        sets = [s for s in SETS if s.bit_count() == size]
        h = threshold(p_false, dof) if dof > 0 else math.inf
        best = np.argmin(g[:, sets], axis=1)
        passes = (out == UNDECIDED) & (np.take_along_axis(g[:, sets], best[:, None], axis=1)[:, 0] <= h)
        out[passes] = np.array(sets)[best[passes]]
    return out
