"""Downbursts by the numbers a report gives: radius, largest outflow and its height."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_plant.wind import microburst_kernel as km

LAYERS = 12.5  # [-] ratio of the two heights of the profile; NASA TM-100632
HEIGHT = math.log(LAYERS) / (LAYERS - 1.0)  # [-] height of the largest outflow over the outflow height


@dataclass(frozen=True)
class Microburst:
    """Axisymmetric downburst. outflow_mps: largest horizontal wind; outflow_height_m: where it is; x_m: axis along the track."""

    outflow_mps: float = 21.0
    radius_m: float = 915.0
    outflow_height_m: float = 46.0
    x_m: float = 0.0
    offset_m: float = 0.0  # of the axis from the flight plane

    def __post_init__(self) -> None:
        for name in ("radius_m", "outflow_height_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"microburst {name} = {getattr(self, name)}; allowed > 0")
        if not 0.0 <= self.outflow_mps <= 100.0:
            raise ValueError(f"microburst outflow_mps = {self.outflow_mps}; allowed 0 to 100")

    def vector(self) -> NDArray[np.float64]:
        """Parameter vector [NM] of the kernel."""
        m = np.zeros(km.NM)
        m[km.M_X], m[km.M_Y], m[km.M_R] = self.x_m, self.offset_m, self.radius_m
        m[km.M_OUT] = self.outflow_height_m / HEIGHT
        m[km.M_LAYER] = m[km.M_OUT] / LAYERS
        # largest r/R (1 - exp(-r^2/R^2))/(r/R)^2 / 2 and largest difference of the two exponentials
        radial = _largest_radial()
        vertical = math.exp(-HEIGHT) - math.exp(-HEIGHT * LAYERS)
        m[km.M_RATE] = self.outflow_mps / (self.radius_m * radial * vertical)
        return m


def _largest_radial() -> float:
    """Maximum over a of (1 - exp(-a^2))/(2a); the condition 2a^2 + 1 = exp(a^2) is solved by Newton's rule."""
    a = 1.12
    for _ in range(20):
        e = math.exp(a * a)
        a -= (2.0 * a * a + 1.0 - e) / (4.0 * a - 2.0 * a * e)
    return (1.0 - math.exp(-a * a)) / (2.0 * a)


MICROBURSTS = {"none": Microburst(0.0), "seed": Microburst(21.0), "severe": Microburst(26.5)}
