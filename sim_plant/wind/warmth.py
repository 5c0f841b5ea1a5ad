"""How much warmer than the standard an ascent is, for the density aircraft meet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.wind.prevailing import read_sounding

Arr = NDArray[np.float64]


def warmth(name: str) -> Arr:
    """Rows (height [m], degrees [K] above the standard's) of an ascent. Raises ConfigError for one without temperatures."""
    air = read_sounding(name).air
    if len(air) < 2:
        raise ConfigError(
            f"wind.sounding = {name!r}: {len(air)} levels with a temperature; wind.density needs at least 2"
        )
    return np.array([(h, t - isa(h)[0]) for h, _, t in air.tolist()])


def warmed(par: Arr, table: Arr) -> Arr:
    """Parameter vector (kernels/layout.py) with an ascent's temperature, `table` as of `warmth`."""
    out = np.concatenate([par, table[:, 0], table[:, 1]])
    out[n.P_WARM], out[n.P_WARM_AT] = len(table), len(par)
    return out
