"""A rigid-body aircraft in the plant's world: its arrays (layout.py), its start, its flight."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.strict import ConfigError
from sim_plant.aircraft.base import MAG_N, Arr, Member, Tanks
from sim_plant.aircraft.kind import Setup
from sim_plant.aircraft.sixdof.eom import fly
from sim_plant.aircraft.sixdof.observe import look
from sim_plant.aircraft.sixdof.params import mistaken, parameter_vector, perturb
from sim_plant.aircraft.sixdof.together_kernel import (
    B_BOUNDS,
    B_C,
    B_CALM,
    B_FREE,
    B_HELD,
    B_OBS,
    B_PAR,
    B_PROBE_WAKE,
    B_PROBES,
    B_S,
    B_WIND,
)
from sim_plant.aircraft.sixdof.trim import throttle_for, trim
from sim_plant.kernels import layout as n
from sim_plant.kernels.air import air
from sim_plant.kernels.rot import quat_dcm, quat_from_euler
from sim_plant.wind.config import Bow, Wake
from sim_plant.wind.field import AirMass
from sim_plant.wind.wake import airframe_points, bow_vector, source_vector
from sim_plant.wind.warmth import warmed, warmth

if TYPE_CHECKING:
    from sim_plant.scenario import Upset


class SixDofMember(Member):
    """One aircraft of six degrees of freedom, from trimmed flight."""

    def __init__(self, setup: Setup) -> None:
        """Raises ConfigError for more fuel than tanks and mass allow."""
        super().__init__(setup)
        cfg, ac = self.cfg, setup.record(Aircraft)
        self._record = ac
        par = parameter_vector(ac, setup.sc.earth, setup.sc.origin.lat_deg, cfg.airframe == "full")
        self.par = mistaken(perturb(par, cfg.aero_error_frac, setup.seed, cfg.name), cfg.mismatch)
        if setup.sc.wind.density == "sounding":
            self.par = warmed(self.par, warmth(setup.sc.wind.sounding))
        self.engines = len(ac.engine.y_m)
        self.c = np.zeros(n.NC)
        self._scratch = np.zeros((4, n.NS))
        self._held = np.zeros(n.NS)
        self._work = np.zeros(n.N_RIGID)
        self.boom, self.receptacle = ac.boom, ac.receptacle
        self.tanks = Tanks(ac.mass.fuel_capacity_kg, ac.mass.max_kg)
        self.exposure = airframe_points(ac, self.probes)
        fuel = cfg.fuel_kg if cfg.fuel_kg >= 0.0 else ac.mass.default_fuel_kg
        most = min(ac.mass.fuel_capacity_kg, ac.mass.max_kg - ac.mass.empty_kg)
        if fuel > most:
            raise ConfigError(
                f"aircraft.{cfg.name}.fuel_kg = {fuel:g}: allowed by {cfg.file!r}: up to {most:g} kg of tanks and mass"
            )
        self.s[n.S_FUEL] = fuel

    @property
    def height_m(self) -> float:
        """Height [m]."""
        return -self.s.item(n.S_P + 2)

    def track(self) -> tuple[float, float]:
        """The horizontal air-relative track, in the wind of the last tick."""
        vn, ve = self.s.item(n.S_V) - self.wind.item(0), self.s.item(n.S_V + 1) - self.wind.item(1)
        h = math.sqrt(vn * vn + ve * ve)
        return vn / h, ve / h

    def air(self, height_m: float) -> tuple[float, float, float, float]:
        """See Member; with the ascent's temperature if the scenario has one."""
        return air(height_m, self.par)

    def wake_source(self, wake: Wake) -> Arr | None:
        """The wake of wing and tail."""
        return source_vector(self._record, wake.core_wing_m, wake.core_tail_m, wake.nu_m2ps, wake.tail_lift_frac)

    def bow_source(self, bow: Bow) -> Arr | None:
        """Its wing and fuselage. Raises ConfigError for a radius its file does not allow."""
        try:
            return bow_vector(self._record, bow.core_m, bow.radius_m)
        except ValueError as e:
            raise ConfigError(f"wind.bow.radius_m = {bow.radius_m:g}: {self.cfg.file!r}: {e}") from None

    def start(self, air: AirMass, other: Member | None) -> None:
        """Trimmed flight in the mean wind, wake included. Raises ConfigError where there is no trim."""
        self._trimmed(air, other)
        if self.cfg.start.upset is not None:
            self._upset(self.cfg.start.upset)
        self.observe()

    def trim_at(self, pos: Arr, vel: Arr, fuel: float) -> Arr:
        """State [NS] of steady flight at position [m] and inertial velocity [m/s] with fuel [kg], in the wind of now. Raises
        ConfigError where there is none."""
        return trim(pos, vel, self.wind, fuel, self.par)

    def _trimmed(self, air: AirMass, other: Member | None) -> None:
        """Into the trim, with the command that holds it."""
        st, s = self.cfg.start, self.s
        if other is None:
            pos = np.array(st.pos_n_m)
            s[n.S_P : n.S_P + 3] = pos
            air.mean(self)
            psi = math.radians(st.psi_deg)
            vel = self.free + st.V_mps * np.array([math.cos(psi), math.sin(psi), 0.0])
            vel[2] = 0.0
        else:
            q = other.s
            C_nb = np.array(quat_dcm(q[0], q[1], q[2], q[3])).reshape(3, 3)
            pos = q[n.S_P : n.S_P + 3] + (C_nb * st.xi_m).sum(axis=1)
            vel = q[n.S_V : n.S_V + 3].copy()
            s[0:4] = q[0:4]
        fuel = float(s[n.S_FUEL])
        s[n.S_P : n.S_P + 3], s[n.S_V : n.S_V + 3] = pos, vel
        for _ in range(3):  # attitude and wake depend on each other a little
            air.mean(self)
            s[:] = self.trim_at(pos, vel, fuel)
        a, e, r = (float(x) for x in s[n.S_SURF : n.S_SURF + 3])
        self.hold((a, e, r, throttle_for(s, self.wind, self.par), False, 0.0))

    def _upset(self, u: Upset) -> None:
        """Out of the trim: attitude, rates and flow as the scenario has them, in the wind where it is."""
        s = self.s
        V = u.V_mps or math.dist(s[n.S_V : n.S_V + 3], self.wind[:3])
        q = quat_from_euler(*(math.radians(x) for x in u.attitude_deg))
        alpha, beta = math.radians(u.alpha_deg), math.radians(u.beta_deg)
        flow = (math.cos(alpha) * math.cos(beta), math.sin(beta), math.sin(alpha) * math.cos(beta))
        C_nb = np.array(quat_dcm(*q)).reshape(3, 3)
        s[0:4], s[n.S_W : n.S_W + 3] = q, np.radians(u.rates_degps)
        s[n.S_V : n.S_V + 3] = self.wind[:3] + V * (C_nb * flow).sum(axis=1)

    def observe(self) -> None:
        self.well = look(
            self.s, self.wind, self.free, self.par, MAG_N, self.probes, self.probe_wake, self._work, self.obs, self.bounds,
            self._held,
        )  # fmt: skip
        self.view.see(self._held, self.obs)

    def to_row(self, lay: Callable[[int, Arr], Arr]) -> None:
        """Be views on a row of together_kernel.py from now on; lay(at, x): the part of it at `at`, with the values of x."""
        self.s, self.obs, self._held = lay(B_S, self.s), lay(B_OBS, self.obs), lay(B_HELD, self._held)
        self.wind, self.free, self.calm = lay(B_WIND, self.wind), lay(B_FREE, self.free), lay(B_CALM, self.calm)
        self.probe_wake, self.probes = lay(B_PROBE_WAKE, self.probe_wake), lay(B_PROBES, self.probes)
        self.bounds, self.par, self.c = lay(B_BOUNDS, self.bounds), lay(B_PAR, self.par), lay(B_C, self.c)
        self.view.see(self._held, self.obs)

    def set_power(self, share: list[float]) -> None:
        y = self._record.engine.y_m
        self.par[n.P_POWER] = sum(share) / len(y)
        self.par[n.P_ARM] = -sum(a * b for a, b in zip(y, share, strict=True)) / len(y)

    def advance(self, jam: list[float]) -> None:
        a, e, r, t, _, _ = self.path.current
        flow = self.view.transfer_kgps - self.leak_kgps
        fly(
            self.s, a, e, r, t, jam[0], jam[1], jam[2], flow, self.c, self.wind, self.par, self.dt_s, self._scratch
        )  # fmt: skip
