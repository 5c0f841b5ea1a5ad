"""Refuelling contact: when the boom couples, when it lets go, and how much fuel flows."""

from __future__ import annotations

import math

from flightsw.strict import ConfigError
from sim_plant.aircraft.base import Member
from sim_plant.couplings.base import Coupling
from sim_plant.kernels import layout as n
from sim_plant.scenario import Refuel


class BoomCoupling(Coupling):
    """The coupling between the boom of `giver` and the receptacle of `taker`.

    Contact is made when the receptacle has stayed inside the envelope, latched by the receiver and slower than the
    capture speed relative to the tanker for the capture time. It breaks when the receptacle leaves the envelope, the
    latch is released, or the boom is driven in or out faster than its radial limit (aircraft-data.md section 3).
    Raises ConfigError for aircraft that have neither.
    """

    def __init__(self, giver: Member, taker: Member, cfg: Refuel, dt_s: float) -> None:
        self.giver, self.taker = giver, taker
        boom, tanks = giver.boom, taker.tanks
        at = f"aircraft.{taker.cfg.name}.boom_to = {giver.cfg.name!r}"
        if tanks is None:
            raise ConfigError(f"{at}: model = {taker.cfg.model!r} has no tanks")
        self._tanks = tanks
        if boom is None or taker.receptacle is None:
            raise ConfigError(f"{at}: that aircraft's file needs a [boom] and this one's a [receptacle]")
        d = math.radians
        # the envelope
        self.el = (d(boom.elevation_deg[0]), d(boom.elevation_deg[1]))
        self.az = (d(boom.azimuth_deg[0]), d(boom.azimuth_deg[1]))
        self.ext = boom.extension_m
        self._rate = boom.radial_rate_max_mps
        self._cfg = cfg
        self._need = max(1, round(cfg.capture_s / dt_s))
        self._count = 0
        self._acted = False
        self.inside = False
        self.contact = False
        self.reason = ""  # why the last contact ended

    @property
    def idle(self) -> bool:
        """Whether it has acted, and would do nothing new until the receptacle is inside the envelope."""
        return self._acted and not (self.contact or self.inside)

    def act(self) -> None:
        """Contact and flow as of now, into the views of both."""
        lead, r = self.giver.view, self.taker.view
        lead.boom = rel = r.boom
        el, az, ext = rel[n.R_EL], rel[n.R_AZ], rel[n.R_EXT]
        inside = self.el[0] <= el <= self.el[1] and self.az[0] <= az <= self.az[1] and self.ext[0] <= ext <= self.ext[1]
        self.see(inside, rel[n.R_EXTDOT], rel[n.R_SPEED], lead.s[n.S_FUEL], r.s[n.S_FUEL], r.o[n.O_MASS])

    def see(
        self,
        inside: bool,
        radial_mps: float,
        speed_mps: float,
        giver_fuel_kg: float,
        taker_fuel_kg: float,
        taker_mass_kg: float,
    ) -> None:
        """`act` by whoever has it at hand: whether the receptacle is inside the envelope, its speed [m/s] along the boom and in
        all, and what is in the tanks."""
        self._acted, self.inside = True, inside
        self._judge(self.taker.path.latch, radial_mps, speed_mps)
        lead, r = self.giver.view, self.taker.view
        lead.contact = r.contact = self.contact
        lead.inside = r.inside = inside
        flow = self.flow_kgps(giver_fuel_kg, taker_fuel_kg, taker_mass_kg) if self.contact else 0.0
        r.transfer_kgps, lead.transfer_kgps = flow, -flow

    def _judge(self, latch: bool, radial_mps: float, speed_mps: float) -> None:
        if self.contact:
            if not latch:
                self._release("latch released")
            elif not self.inside:
                self._release("outside the envelope")
            elif abs(radial_mps) > self._rate:
                self._release("radial rate over the limit")
            return
        ready = self.inside and latch and speed_mps < self._cfg.capture_speed_mps
        self._count = self._count + 1 if ready else 0
        if self._count >= self._need:
            self.contact, self.reason = True, ""

    def _release(self, why: str) -> None:
        self.contact, self.reason, self._count = False, why, 0

    def flow_kgps(self, giver_fuel_kg: float, taker_fuel_kg: float, taker_mass_kg: float) -> float:
        """Fuel flow [kg/s] to the receiver now: the set rate while in contact, none when the tanker is dry, the receiver's
        tanks are full or its mass is at its maximum."""
        full = taker_fuel_kg >= self._tanks.capacity_kg or taker_mass_kg >= self._tanks.mass_max_kg
        if not self.contact or giver_fuel_kg <= 0.0 or full:
            return 0.0
        return self._cfg.transfer_kgps
