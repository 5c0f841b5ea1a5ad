"""An aircraft as a line, from the side and from above, for views in a plane. By eye: nose at 0.5, tail at -0.5 of a length."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# forward, up
_TOP = [
    (0.5, 0.0),
    (0.44, 0.05),
    (0.34, 0.075),
    (-0.2, 0.075),
    (-0.34, 0.08),
    (-0.45, 0.24),
    (-0.5, 0.24),
    (-0.46, 0.05),
]
_BELLY = [(-0.3, -0.02), (-0.08, -0.06), (0.02, -0.075), (0.34, -0.06), (0.46, -0.04), (0.5, 0.0)]
SIDE = np.array(_TOP + _BELLY)
# forward, right
_HALF = [
    (0.5, 0.0),
    (0.42, 0.045),
    (0.14, 0.05),
    (-0.06, 0.5),
    (-0.14, 0.5),
    (-0.06, 0.05),
    (-0.36, 0.035),
    (-0.46, 0.18),
]
_HALF += [(-0.5, 0.18), (-0.47, 0.02)]
ABOVE = np.array([*_HALF, *((x, -y) for x, y in reversed(_HALF))])


def placed(outline: Array, at: Array, angle: Array, size: float, stretch: float = 1.0) -> NDArray[np.float32]:
    """An outline (m,2) at each of n points of a 2-D view: (n,m,2). at (n,2): x right, y down. angle (n,) [rad]: of the nose, from
    x towards the view's up. size: its length; stretch: of what is up, as the view's heights are drawn."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = size * outline.T
    return np.stack([at[:, :1] + c * x - s * y, at[:, 1:] - stretch * (s * x + c * y)], axis=-1).astype(np.float32)
