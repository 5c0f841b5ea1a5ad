"""What the integrity of the relative position has to say on the wire: the bound on the error, and which sources it rests on."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from flightsw.missions.base import Packets, report
from flightsw.types import ZERO3, Vec3

NONE = 1e9  # on the wire: no such number
INF3: Vec3 = (math.inf, math.inf, math.inf)


@dataclass(slots=True)
class IntegrityReport:
    """Protection level of the relative position and the sources it rests on. Axes: the tanker's body x, y, z. A mask has one bit
    for each source (INTEGRITY_SOURCE), and `ratio` one entry, in the same order."""

    t_us: int = 0
    pl: Vec3 = INF3  # [m] protection level; inf: none
    al: Vec3 = INF3  # [m] alert limit of the phase; inf: none
    sigma: Vec3 = INF3  # [m] of pos; inf: none
    pos: Vec3 = ZERO3  # [m] own position xi as the bank has it
    used: int = 0
    excluded: int = 0
    undecided: int = 0
    ratio: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # [-] largest statistic / threshold; 0: not live
    turbulence: float = 0.0  # [m/s] 1 sigma learnt; 0: not yet
    turbulence_max: float = math.inf  # [m/s] refuelling bears; inf: no limit


def integrity_values(r: IntegrityReport) -> Packets:
    """Fields of INTEGRITY_STATUS."""
    numbers = (_said(v) for v in (r.pl, r.al, r.sigma, r.pos, r.ratio))
    air = _said((r.turbulence, r.turbulence_max))
    yield (r.t_us, *(x for v in numbers for x in v), r.used, r.excluded, r.undecided, *air)


def _said(v: Iterable[float]) -> tuple[float, ...]:
    """Values as the wire has them: NONE for what is infinite or no number."""
    return tuple(x if -NONE < x < NONE else NONE for x in v)


REPORTS = (report("INTEGRITY_STATUS", IntegrityReport, integrity_values, rate_hz=5.0),)
