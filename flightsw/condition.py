"""What the aircraft says of itself beside its inputs: navigation in doubt, a command at its limit, fuel. Flags and texts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from flightsw.strict import IN_FLIGHT, ConfigError, Range
from flightsw.types import HF_FUEL, HF_NAV, HF_SAT, UPD_FUEL, NavState, SensorFrame, Text

CLEAR_S = 1.0  # [s] good again before a flag goes
TWICE = 2  # readings in a row that say the same
STEP_KGPS = 40.0  # [kg/s] fastest a tank fills (boom transfer of a KC-135: 900 US gal/min, ATP-56(B), is 45) or empties
Time = Annotated[float, Range(0.0, 60.0), IN_FLIGHT]


@dataclass(frozen=True)
class ConditionParams:
    """[condition] of a flight file."""

    saturated_s: Time = 2.0  # a command at its limit for this long is reported
    fuel_low_frac: Annotated[float, Range(0.0, 1.0), IN_FLIGHT] = 0.10  # [-] of the tanks' capacity
    fuel_empty_kg: Annotated[float, Range(0.0)] = 35.0  # gauge at dry tanks: three times its error of 11 kg
    fuel_age_s: Annotated[float, Range(0.1, 600.0), IN_FLIGHT] = 5.0  # gauge silent for longer counts as lost
    fuel_jump_kg: Annotated[float, Range(0.1)] = (
        60.0  # beside what may have flowed; beyond, one reading is not believed
    )


def refuse_without_tanks(p: ConditionParams, capacity_kg: float) -> None:
    """Raise ConfigError for a limit of the fuel gauge on an aircraft whose tanks hold `capacity_kg` = 0: it has none to judge."""
    for key in ("fuel_low_frac", "fuel_empty_kg", "fuel_age_s", "fuel_jump_kg"):
        if capacity_kg <= 0.0 and getattr(p, key) != getattr(ConditionParams, key):
            raise ConfigError(f"condition.{key} = {getattr(p, key):g}: nothing obeys it on an aircraft without tanks")


class Condition:
    """Flags HF_NAV, HF_SAT, HF_FUEL. `intake` each tick, `step` after each mission step; `flags` and `texts` are the result."""

    def __init__(self, p: ConditionParams, capacity_kg: float) -> None:
        """capacity_kg: of the tanks; 0: the aircraft has none that are measured."""
        self.p = p
        self.capacity_kg = capacity_kg
        self.flags = 0
        self.texts: list[Text] = []
        self._was_valid = False
        self._good_s = self._bad_s = self._free_s = 0.0
        self._fuel_kg = -1.0  # last believed
        self._fuel_us = self._odd = 0
        self._doubted = False  # the gauge's last reading was not believed
        self._level = ""
        self._same = 0

    def intake(self, f: SensorFrame) -> tuple[SensorFrame, int]:
        """Judge the fuel gauge; returns the frame, in it the last believed reading for one that is not, and how many were not.

        `f` itself stays as it came.
        """
        refused = 0
        if self.capacity_kg > 0.0:
            if f.updated & UPD_FUEL:
                refused = self._gauge(f)
            elif self._fuel_us and f.t_us - self._fuel_us > self.p.fuel_age_s * 1e6:
                self._fuel(HF_FUEL, "lost", Text(4, "fuel gauge lost"))
        if self._doubted:
            f = replace(f, updated=f.updated & ~UPD_FUEL if refused else f.updated, fuel_kg=max(self._fuel_kg, 0.0))
        return f, refused

    def _gauge(self, f: SensorFrame) -> int:
        p, kg = self.p, f.fuel_kg
        known = self._fuel_kg >= 0.0
        jump = p.fuel_jump_kg + STEP_KGPS * (f.t_us - self._fuel_us) * 1e-6
        odd = kg > self.capacity_kg + p.fuel_jump_kg or (known and abs(kg - self._fuel_kg) > jump)
        self._odd = self._odd + 1 if odd else 0
        if odd and (self._odd <= TWICE or kg > self.capacity_kg + p.fuel_jump_kg):
            self._doubted = True
            return 1
        self._fuel_kg, self._fuel_us, self._odd, self._doubted = kg, f.t_us, 0, False
        level = "exhausted" if kg <= p.fuel_empty_kg else "low" if kg < p.fuel_low_frac * self.capacity_kg else ""
        self._same = self._same + 1 if level != self._level else 0
        if self._same < TWICE and self._level != "lost":
            return 0
        texts = {
            "exhausted": Text(2, "fuel exhausted"),
            "low": Text(4, f"fuel low: {kg:.0f} kg"),
            "": Text(5, "fuel good"),
        }
        self._fuel(HF_FUEL if level else 0, level, texts[level])
        return 0

    def _fuel(self, flag: int, level: str, text: Text) -> None:
        if level != self._level:
            self.texts.append(text)
        self._level, self._same = level, 0
        self.flags = (self.flags & ~HF_FUEL) | flag

    def step(self, nav: NavState, saturated: bool, dt: float) -> None:
        """After a mission step of dt [s]: its navigation, and whether one of its commands is at its limit."""
        self._navigation(nav, dt)
        self._bad_s, self._free_s = (self._bad_s + dt, 0.0) if saturated else (0.0, self._free_s + dt)
        if self._bad_s >= self.p.saturated_s and not self.flags & HF_SAT:
            if saturated:
                self.flags |= HF_SAT
                self.texts.append(Text(4, f"a command has been at its limit for {self._bad_s:.0f} s"))
        elif self.flags & HF_SAT and self._free_s >= CLEAR_S:
            self.flags &= ~HF_SAT

    def _navigation(self, nav: NavState, dt: float) -> None:
        """Not valid after it has been, or valid and in doubt."""
        why = nav.trouble if nav.valid else nav.reason if self._was_valid else ""
        self._was_valid = self._was_valid or nav.valid
        if why or (self._was_valid and not nav.valid):
            self._good_s = 0.0
            if not self.flags & HF_NAV:
                self.flags |= HF_NAV
                self.texts.append(Text(3, f"navigation: {why}"[:50]))
        elif self.flags & HF_NAV:
            self._good_s += dt
            if self._good_s >= CLEAR_S:
                self.flags &= ~HF_NAV
                self.texts.append(Text(5, "navigation good again"))
