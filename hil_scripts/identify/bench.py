"""The airframe of a JSBSim model on a bench: put into any state, its aerodynamic coefficients are read. Nothing moves."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from sim_plant.aircraft.jsbsim.motion import FT, LBF
from sim_plant.aircraft.jsbsim.start import stock_motion, trim_motion
from sim_plant.aircraft.jsbsim.stock import Stock
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.kernels import layout as n
from sim_plant.kernels.air import air
from sim_plant.kernels.rot import quat_dcm, quat_from_euler

Arr = NDArray[np.float64]
FORCES = ("forces/fwx-aero-lbs", "forces/fwy-aero-lbs", "forces/fwz-aero-lbs")  # + drag, right, lift
MOMENTS = (
    "moments/l-aero-lbsft",
    "moments/m-aero-lbsft",
    "moments/n-aero-lbsft",
)  # about the centre of gravity, body axes
SLUG_FT2 = LBF * FT  # [kg m^2]
FREE_RAD = 1.5  # travel of a surface while a trim is looked for


@dataclass(frozen=True)
class Condition:
    """Where an aircraft is identified: height [m], airspeed [m/s], fuel [kg]."""

    height_m: float
    V_mps: float
    fuel_kg: float


@dataclass(frozen=True)
class Point:
    """A state of the flow: airspeed [m/s], alpha, beta [rad], body rates p, q, r [rad/s], aileron, elevator, rudder [rad], and
    the attitude theta, phi [rad], by which gravity changes the rate of incidence and nothing else."""

    V: float
    alpha: float
    beta: float = 0.0
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0)
    surfaces: tuple[float, float, float] = (0.0, 0.0, 0.0)
    attitude: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Read:
    """Coefficients at a point: CD, CY, CL along the wind axes, Cl, Cm, Cn in stability axes; rates made dimensionless, p b/2V and
    r b/2V in stability axes, q c/2V, alphadot c/2V; Mach number."""

    CD: float
    CY: float
    CL: float
    Cl: float
    Cm: float
    Cn: float
    p: float
    q: float
    r: float
    alphadot: float
    mach: float


class Bench:
    """A stock model over a flat earth in still standard air at one mass."""

    def __init__(self, stock: Stock, like: Aircraft, c: Condition) -> None:
        """like: whose servos and engine stand in `par` until there are others. Raises ConfigError."""
        self.stock, self.c = stock, c
        self.par = parameter_vector(like)
        self.par[n.P_EMPTY] = stock.empty_kg
        self.par[n.P_LO : n.P_LO + 3], self.par[n.P_HI : n.P_HI + 3] = -FREE_RAD, FREE_RAD
        self.mass_kg = stock.empty_kg + c.fuel_kg
        self.motion = stock_motion(stock, self.par, c.height_m, 0.01)
        self.motion.weigh(c.fuel_kg, [0.0])
        fdm = self.motion.fdm
        self.S_m2, self.b_m, self.c_m = (
            fdm["metrics/Sw-sqft"] * FT**2, fdm["metrics/bw-ft"] * FT, fdm["metrics/cbarw-ft"] * FT,
        )  # fmt: skip
        self.par[n.P_S], self.par[n.P_B], self.par[n.P_C] = self.S_m2, self.b_m, self.c_m
        _, _, self.rho, self.sound_mps = air(c.height_m, self.par)

    def state(self, x: Point) -> Arr:
        """State [NS] of a point."""
        s = np.zeros(n.NS)
        s[0:4] = quat_from_euler(0.0, *x.attitude)
        flow = (math.cos(x.alpha) * math.cos(x.beta), math.sin(x.beta), math.sin(x.alpha) * math.cos(x.beta))
        C_nb = np.array(quat_dcm(*s[0:4])).reshape(3, 3)
        s[n.S_V : n.S_V + 3] = x.V * (C_nb * flow).sum(axis=1)
        s[n.S_W : n.S_W + 3], s[n.S_SURF : n.S_SURF + 3] = x.rates, x.surfaces
        s[n.S_P + 2], s[n.S_FUEL] = -self.c.height_m, self.c.fuel_kg
        return s

    def read(self, x: Point) -> Read:
        """Coefficients at a point."""
        m, fdm = self.motion, self.motion.fdm
        m.begin(self.state(x), np.zeros(n.NW))
        qs = 0.5 * self.rho * x.V * x.V * self.S_m2
        drag, side, lift = (fdm[k] * LBF / qs for k in FORCES)
        roll, pitch, yaw = (fdm[k] * LBF * FT / qs for k in MOMENTS)
        ca, sa = math.cos(x.alpha), math.sin(x.alpha)
        hb, hc = 0.5 * self.b_m / x.V, 0.5 * self.c_m / x.V
        p, q, r = x.rates
        return Read(
            drag, side, lift, (roll * ca + yaw * sa) / self.b_m, pitch / self.c_m, (yaw * ca - roll * sa) / self.b_m,
            (p * ca + r * sa) * hb, q * hc, (r * ca - p * sa) * hb, fdm["aero/function/alphadot-air"] * hc, x.V / self.sound_mps,
        )  # fmt: skip

    def trim(self) -> tuple[Point, float]:
        """Straight level flight at the condition, and its thrust [N]. Raises ConfigError where there is none."""
        guess = dataclasses.replace(Point(self.c.V_mps, 0.04), attitude=(0.04, 0.0))
        s = self.state(guess)
        s[n.S_T] = 0.07 * self.mass_kg * n.G0
        t = trim_motion(
            self.motion, s, np.zeros(n.NW), f"{self.stock.name} at {self.c.V_mps:g} m/s, {self.c.height_m:g} m"
        )
        v = np.array(quat_dcm(*t[0:4])).reshape(3, 3).T @ t[n.S_V : n.S_V + 3]
        alpha = math.atan2(v[2], v[0])
        a, e, r = (float(x) for x in t[n.S_SURF : n.S_SURF + 3])
        return Point(self.c.V_mps, alpha, surfaces=(a, e, r), attitude=(alpha, 0.0)), float(t[n.S_T])

    def inertia(self, fuel_kg: float) -> tuple[float, float, float, float]:
        """Ixx, Iyy, Izz, Ixz [kg m^2] with this fuel."""
        self.motion.weigh(fuel_kg, [0.0])
        self.motion.look(self.c.height_m, np.zeros(n.NW))
        fdm = self.motion.fdm
        xx, yy, zz, xz = (fdm[f"inertia/{k}-slugs_ft2"] * SLUG_FT2 for k in ("ixx", "iyy", "izz", "ixz"))
        self.motion.weigh(self.c.fuel_kg, [0.0])
        return xx, yy, zz, -xz  # its product is of the other sign

    def centre_m(self, fuel_kg: float) -> tuple[float, float, float]:
        """Centre of gravity with this fuel, structural axes [m]."""
        self.motion.weigh(fuel_kg, [0.0])
        self.motion.look(self.c.height_m, np.zeros(n.NW))
        x, y, z = (self.motion.fdm[f"inertia/cg-{k}-in"] * 0.0254 for k in "xyz")
        self.motion.weigh(self.c.fuel_kg, [0.0])
        return x, y, z
