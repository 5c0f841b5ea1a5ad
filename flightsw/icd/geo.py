"""Local north-east-down frame against latitude and longitude: one fixed linear map, exactly invertible.

WGS-84 radii of curvature at the origin (M meridian, N prime vertical), small-area map: dlat = n / M,
dlon = e / (N cos lat0), altitude = -down. Plant, flight software and ground use the same map, so it adds nothing but
the wire's rounding (1e-7 deg, about 1 cm). Longitudes are given within [-180, 180), and read as the nearest to the origin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from flightsw.types import Vec3

WGS84_A = 6378137.0  # [m] NIMA TR8350.2
WGS84_F = 1.0 / 298.257223563  # [-] NIMA TR8350.2
TURN, HALF_TURN = 3_600_000_000, 1_800_000_000  # [1e-7 deg]


@dataclass(frozen=True)
class Origin:
    """Origin of the navigation frame. `alt_m` is added to -z (0: z = 0 is mean sea level)."""

    lat_deg: float = 35.18
    lon_deg: float = -97.44
    alt_m: float = 0.0

    @cached_property
    def scales(self) -> tuple[float, float]:
        """Metres per degree north and east here [m/deg]."""
        return scales(self)


DEFAULT_ORIGIN = Origin()


def scales(origin: Origin) -> tuple[float, float]:
    """Metres per degree north and east at the origin [m/deg]."""
    e2 = WGS84_F * (2.0 - WGS84_F)
    lat = math.radians(origin.lat_deg)
    w = math.sqrt(1.0 - e2 * math.sin(lat) ** 2)
    meridian = WGS84_A * (1.0 - e2) / w**3
    prime = WGS84_A / w
    return math.radians(meridian), math.radians(prime * math.cos(lat))


def _wrap(lon_deg: float) -> float:
    """Longitude or difference of two [deg] to [-180, 180)."""
    return lon_deg if -180.0 <= lon_deg < 180.0 else (lon_deg + 180.0) % 360.0 - 180.0


def to_geodetic(pos_n: Vec3, origin: Origin = DEFAULT_ORIGIN) -> Vec3:
    """Latitude [deg], longitude [deg], altitude [m, + up] of a local position [m, NED]."""
    kn, ke = origin.scales
    return origin.lat_deg + pos_n[0] / kn, _wrap(origin.lon_deg + pos_n[1] / ke), origin.alt_m - pos_n[2]


def to_local(lat_deg: float, lon_deg: float, alt_m: float, origin: Origin = DEFAULT_ORIGIN) -> Vec3:
    """Local position [m, NED] of latitude [deg], longitude [deg], altitude [m, + up]; inverse of `to_geodetic`."""
    kn, ke = origin.scales
    return (lat_deg - origin.lat_deg) * kn, _wrap(lon_deg - origin.lon_deg) * ke, origin.alt_m - alt_m


class WireMap:
    """The same map to and from the wire's integers, with the scales worked out once."""

    __slots__ = ("alt0", "ke", "kn", "lat0", "lon0")

    def __init__(self, origin: Origin) -> None:
        kn, ke = origin.scales
        self.kn, self.ke = kn * 1e-7, ke * 1e-7  # [m per 1e-7 deg]
        self.lat0, self.lon0 = origin.lat_deg * 1e7, origin.lon_deg * 1e7
        self.alt0 = origin.alt_m

    def encode(self, pos_n: Vec3) -> tuple[int, int, float]:
        """Latitude, longitude [1e-7 deg] and altitude [m, + up] of a local position [m, NED]."""
        lon = (round(self.lon0 + pos_n[1] / self.ke) + HALF_TURN) % TURN - HALF_TURN
        return round(self.lat0 + pos_n[0] / self.kn), lon, self.alt0 - pos_n[2]

    def decode(self, lat: int, lon: int, alt_m: float) -> Vec3:
        """Local position [m, NED] of wire latitude, longitude [1e-7 deg] and altitude [m, + up]."""
        east = lon - self.lon0
        if not -HALF_TURN <= east < HALF_TURN:
            east = (east + HALF_TURN) % TURN - HALF_TURN
        return (lat - self.lat0) * self.kn, east * self.ke, self.alt0 - alt_m
