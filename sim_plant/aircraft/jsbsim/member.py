"""An aircraft of the plant's world whose motion JSBSim integrates."""

from __future__ import annotations

import math

from flightsw.strict import ConfigError
from sim_plant.aircraft.base import MAG_N, Arr, Member
from sim_plant.aircraft.jsbsim.model import CONTROLS, model_xml, point_weights
from sim_plant.aircraft.jsbsim.motion import Motion, library, load
from sim_plant.aircraft.jsbsim.start import stock_motion, trim_motion
from sim_plant.aircraft.jsbsim.stock import Stock, read
from sim_plant.aircraft.jsbsim.table import OWN_FILE, JsbsimTable
from sim_plant.aircraft.kind import Setup
from sim_plant.aircraft.sixdof.member import SixDofMember
from sim_plant.aircraft.sixdof.observe import seen
from sim_plant.aircraft.sixdof.propulsion import thrust_available
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.kernels.earth import air_height, rigid_rates
from sim_plant.kernels.servo import servo_step
from sim_plant.wind.field import AirMass

EARTHS = ("flat", "wgs84")  # the plant's names of those JSBSim is given


class JsbsimMember(SixDofMember):
    """Motion by JSBSim; servos, engine, fuel, start and what instruments see as with six degrees of freedom."""

    def __init__(self, setup: Setup) -> None:
        """Raises ConfigError if JSBSim is not installed or refuses the model, or for an earth it does not know."""
        library()
        if setup.sc.earth not in EARTHS:
            at = f"aircraft.{setup.cfg.name}.model = {setup.cfg.model!r}"
            raise ConfigError(f"earth = {setup.sc.earth!r}: allowed with {at}: {', '.join(EARTHS)}")
        super().__init__(setup)
        self.table = setup.table(JsbsimTable)
        self._step_s = self.dt_s / self.table.substeps
        self._base = 0.0  # [kg] mass the model was made for
        self.stock: Stock | None = None
        if self.table.source != OWN_FILE:
            self.stock = read(self.table.source)
            self._check_stock(self.stock)

    def _check_stock(self, stock: Stock) -> None:
        """Raises ConfigError for what of the scenario somebody else's airframe does not obey."""
        at, cfg = f"aircraft.{self.cfg.name}", self.cfg
        source = f"with plant.source = {stock.name!r}, whose airframe is its own"
        if cfg.aero_error_frac:
            raise ConfigError(f"{at}.aero_error_frac = {cfg.aero_error_frac:g}: nothing obeys it {source}; allowed: 0")
        if cfg.mismatch.inertia != 1.0:
            raise ConfigError(
                f"{at}.mismatch.inertia = {cfg.mismatch.inertia:g}: nothing obeys it {source}; allowed: 1"
            )

    def _load(self, height_m: float) -> Motion:
        """JSBSim with the model of this aircraft, over a flat earth at a height [m], or over the round one."""
        flat = None if self.par[n.P_ROUND] > 0.5 else height_m
        if self.stock is not None:
            return stock_motion(self.stock, self.par, flat, self._step_s)
        xml = model_xml(self._record.meta.name, self.par, self._base, flat)
        return Motion(load(xml, self._record.meta.name, self._step_s), self.par, CONTROLS, [], 0)

    def trim_at(self, pos: Arr, vel: Arr, fuel: float) -> Arr:
        """The plant's own trim by the aircraft file; of somebody else's model, JSBSim's from there."""
        s = super().trim_at(pos, vel, fuel)
        if self.stock is None:
            return s
        motion = self._load(-float(pos[2]))
        motion.weigh(fuel, self._weights(fuel))
        return trim_motion(motion, s, self.wind, f"aircraft.{self.cfg.name}")

    def start(self, air: AirMass, other: Member | None) -> None:
        """See SixDofMember."""
        self._base = float(self.par[n.P_EMPTY] + self.s[n.S_FUEL])
        self._trimmed(air, other)
        self.motion = self._load(self.height_m)
        self._weigh()
        self.motion.begin(self.s, self.wind)
        self.observe()

    def _weights(self, fuel: float) -> list[float]:
        """Masses [kg] of the plant's points in the model: what makes mass and inertia the plant's, of a stock model the mass."""
        mass = float(self.par[n.P_EMPTY]) + fuel
        if self.stock is None:
            return point_weights(mass, self._base, self.par)
        return [mass - self.stock.empty_kg - fuel]

    def _weigh(self) -> None:
        fuel = self.s.item(n.S_FUEL)
        self.motion.weigh(fuel, self._weights(fuel))

    def observe(self) -> None:
        """Forces in the wind of now from JSBSim, what motion alone shows from the plant."""
        s, o, k, h = self.s, self.obs, self._work, self.height_m
        mass = float(self.par[n.P_EMPTY]) + s.item(n.S_FUEL)
        self.motion.look(h, self.wind)
        force, turning, flow = self.motion.felt()
        _, _, rho, a = self.air(air_height(h, self.par))
        for i in range(3):
            o[n.O_F + i], o[n.O_WDOT + i] = force[i] / mass, turning[i]
        o[n.O_V], o[n.O_BETA], o[n.O_ALPHA], o[n.O_LIFT], o[n.O_DRAG] = flow
        o[n.O_RHO], o[n.O_MASS] = rho, mass
        _, o[n.O_PRESS], _, _ = isa(air_height(h, self.par))
        o[n.O_AVAIL] = thrust_available(air_height(h, self.par), flow[0] / a, rho, self.par)
        fx, fy, fz = force
        rigid_rates(s, fx, fy, fz, 0.0, 0.0, 0.0, mass, 1.0, 1.0, 1.0, 0.0, self.par, k)
        o[n.O_ACC : n.O_ACC + 3] = k[n.S_V : n.S_V + 3]
        seen(s, self.free, MAG_N, self.probes, self.probe_wake, o)
        self.show()

    def advance(self, jam: list[float]) -> None:
        """Servos and engine by the plant, in JSBSim's steps; the motion between by JSBSim."""
        s, par, m = self.s, self.par, self.motion
        a, e, r, t, _, _ = self.path.current
        self.c[:] = (a, e, r, t, jam[0], jam[1], jam[2], self.view.transfer_kgps - self.leak_kgps)
        asked = 0.0
        if s.item(n.S_FUEL) > 0.0:
            asked = max(min(1.0, max(0.0, t)), float(par[n.P_IDLE])) * self.obs.item(n.O_AVAIL)
        h = self._step_s
        near = -math.expm1(-h / float(par[n.P_TAU]))
        wanted = (float(par[n.P_POWER]) * asked, float(par[n.P_ARM]) * asked)
        for _ in range(self.table.substeps):
            servo_step(s, self.c, par, h)
            fuel = s.item(n.S_FUEL) + (self.c.item(n.C_TRANSFER) - float(par[n.P_TSFC]) * s.item(n.S_T)) * h
            s[n.S_FUEL] = min(float(par[n.P_FUEL_CAP]), max(0.0, fuel))
            s[n.S_T] += near * (wanted[0] - s.item(n.S_T))
            s[n.S_YAW] += near * (wanted[1] - s.item(n.S_YAW))
            m.breathe(m.height_m)
            m.run(s)
        self._weigh()
        m.state(s)
