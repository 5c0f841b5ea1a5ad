"""What a flight log holds: columns with their units and bounds, and the log as arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

Array = np.ndarray


class LogError(ValueError):
    """The log cannot be used. The text names file, line, column, value and what is allowed."""


@dataclass(frozen=True)
class Column:
    """Name, largest believable magnitude and what a larger one suggests."""

    name: str
    limit: float
    hint: str
    lowest: float = -math.inf


def _group(names: str, limit: float, hint: str) -> tuple[Column, ...]:
    return tuple(Column(n, limit, hint) for n in names.split())


ANGLE = 2.0 * math.pi + 0.01
TIME = Column("t_s", 1e6, "seconds from the start of the log are expected, this looks like milliseconds or a date")
VEL = _group("vel_n_mps vel_e_mps vel_d_mps", 400.0, "m/s expected, this looks like cm/s or km/h")
# a heading that counts its turns has no limit: logcheck tells it from degrees
YAW = Column("yaw_rad", math.inf, "")
ATT = (YAW, *_group("pitch_rad roll_rad", ANGLE, "rad expected, this looks like degrees"))
RATE = _group("p_radps q_radps r_radps", 12.0, "rad/s expected, this looks like deg/s")
SPEED = Column("airspeed_mps", 400.0, "m/s expected, this looks like cm/s or km/h", 0.0)
VANES = _group("beta_rad alpha_rad", 1.2, "rad expected, this looks like degrees")
WIND = _group("wind_n_mps wind_e_mps wind_d_mps", 120.0, "m/s expected, this looks like cm/s or km/h")
POS = _group(
    "pos_n_m pos_e_m pos_d_m", 1e6, "metres from a local origin expected, this looks like an earth-fixed frame"
)
REQUIRED = (TIME, *VEL, *ATT, *RATE, SPEED)
OPTIONAL = (*((v,) for v in VANES), WIND, POS)
SENSORS = ("attitude", "rates", "velocity", "airspeed", "beta", "alpha")


@dataclass(frozen=True)
class Frozen:
    """A stretch in which a sensor repeats one reading although it did not before."""

    sensor: str
    start_s: float
    end_s: float
    samples: int


@dataclass(frozen=True)
class FlightLog:
    """n samples. t [n] s; euler [n,3] (psi, theta, phi) rad; w_b [n,3] rad/s; vel_n [n,3] m/s NED; air [n,3] (V m/s, beta,
    alpha rad), an angle the log does not have is 0; wind_n [n,3] m/s NED as estimated onboard, pos_n [n,3] m NED, both None
    where the log has none. vanes: whether the log has beta and alpha. stale: per entry of SENSORS, the samples [n] at which it
    is frozen. skipped: what was wrong with the rows left out.
    """

    name: str
    t: Array
    euler: Array
    w_b: Array
    vel_n: Array
    air: Array
    wind_n: Array | None
    pos_n: Array | None
    vanes: tuple[bool, bool] = (True, True)
    stale: dict[str, Array] = field(default_factory=dict)
    frozen: tuple[Frozen, ...] = ()
    skipped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.t)

    def fresh(self, sensor: str) -> Array:
        """Samples [n] at which a sensor's reading may be used."""
        none = np.zeros(len(self), dtype=bool)
        return ~self.stale.get(sensor, none)
