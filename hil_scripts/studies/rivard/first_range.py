"""What a turn that begins with the first range can announce: `python -m hil_scripts.studies.rivard.first_range`.

From 15 and 17 NM the turn starts at once, and all that is known is one range. The miss predicted from it orders the ranges, so
a threshold on it is the best test there is of one distance against the other (Neyman and Pearson's lemma: their likelihood
ratio is monotone). Printed: share told before the turn at 15 NM, and at 17 NM, and how many of all meetings there are told
although the roll-out lies inside 0.7 of the box.
"""

from __future__ import annotations

import numpy as np

from hil_scripts.campaign.study import run_seed
from hil_scripts.studies.rivard import geometry_kernel as gk
from hil_scripts.studies.rivard.geometry import BATCH, PLAIN, SETTINGS, outside
from hil_scripts.studies.rivard.geometry_mc import run_geometry

Array = np.ndarray
TOLD = (0.995, 0.99, 0.95, 0.90, 0.80)  # of the meetings from 15 NM


def meetings(name: str, master: int, runs: int) -> tuple[Array, Array]:
    """Predicted miss along track [m] and whether the roll-out lies inside 0.7 of the box, of the campaign's meetings."""
    rows = np.vstack(
        [run_geometry(SETTINGS[name][1], BATCH, run_seed(master, "rivard_geometry", i)) for i in range(runs)]
    )
    return rows[:, gk.R_XP], ~outside(rows[:, [gk.R_XR, gk.R_YR]].T, PLAIN)


def trade(near: tuple[Array, Array], far: tuple[Array, Array], told: float) -> tuple[float, float, float]:
    """(false at the nearer, told and false at the farther distance) of the threshold that tells `told` at the nearer.

    near, far: as `meetings` returns them. Shares of all meetings.
    """
    limit = np.quantile(near[0], told)
    false_near = float(np.mean((near[0] <= limit) & near[1]))
    said = far[0] <= limit
    return false_near, float(np.mean(said)), float(np.mean(said & far[1]))


def main() -> None:
    """Print the trade on master seed 1."""
    near, far = (meetings(name, 1, 4) for name in ("close_15", "close_17"))
    for told in TOLD:
        a, b, c = trade(near, far, told)
        print(f"15 NM: told {told:.1%}, false {a:.2%}; 17 NM: told {b:.1%}, false {c:.2%}")


if __name__ == "__main__":
    main()
