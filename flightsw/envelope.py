"""The limits of an aircraft file as the guidance keeps them: what a flight file or a command asks for beyond them is refused."""

from __future__ import annotations

import math

from flightsw.aircraft import Airframe
from flightsw.strict import ConfigError

G0 = 9.80665  # [m/s^2]


class Envelope:
    """Airspeed, bank and incidence an aircraft may be asked for. The checks raise ConfigError naming key, value and limit."""

    def __init__(self, ac: Airframe) -> None:
        self.limits, self._who = ac.limits, ac.meta.name

    def speed(self, key: str, V: float) -> None:
        """Airspeed V [m/s] of a flight file's key."""
        lo, hi = self.limits.V_min_mps, self.limits.V_max_mps
        if not lo <= V <= hi:
            raise ConfigError(f"{key} = {V:g}: allowed for {self._who}: {lo:g} to {hi:g} m/s")

    def bank(self, key: str, deg: float) -> None:
        """Bank [deg] of a flight file's key."""
        if not abs(deg) <= self.limits.bank_max_deg:
            raise ConfigError(
                f"{key} = {deg:g}: allowed for {self._who}: up to {self.limits.bank_max_deg:g} deg of bank"
            )

    def turn(self, key: str, rate_degps: float, V: float) -> None:
        """Turn rate [deg/s] of a flight file's key, flown level at V [m/s]."""
        bank = math.degrees(math.atan(V * math.radians(abs(rate_degps)) / G0))
        if not bank <= self.limits.bank_max_deg:
            raise ConfigError(
                f"{key} = {rate_degps:g}: {bank:.1f} deg of bank at {V:g} m/s; allowed for {self._who}: up to "
                f"{self.limits.bank_max_deg:g} deg"
            )

    def incidence(self, key: str, rad: float) -> None:
        """Incidence [rad] of a flight file's key."""
        top = math.radians(self.limits.alpha_max_deg)
        if not rad <= top:
            raise ConfigError(f"{key} = {rad:g}: allowed for {self._who}: up to {top:.4g} rad")

    def fastest(self, rate_degps: float) -> float:
        """Largest airspeed [m/s]: that of the file, or at which level turns at this rate [deg/s] take the largest bank."""
        rate = math.radians(abs(rate_degps))
        by_bank = G0 * math.tan(math.radians(self.limits.bank_max_deg)) / rate if rate > 0.0 else math.inf
        return min(self.limits.V_max_mps, by_bank)
