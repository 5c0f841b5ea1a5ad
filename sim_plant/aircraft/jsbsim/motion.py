"""One aircraft in JSBSim: started from a state of the plant's, looked at in the wind of a tick, flown on. SI outside.

A tick: `look` (forces in this tick's wind: JSBSim runs without advancing), then `run` per step with the controls of its end.
JSBSim integrates with the accelerations of its last evaluation, then evaluates anew: a step meets the controls of its own time.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError
from sim_plant.aircraft.jsbsim.model import AIR, R_FLAT, WIND_RATES
from sim_plant.kernels import layout as n
from sim_plant.kernels.air import air
from sim_plant.kernels.earth import air_height
from sim_plant.kernels.rot import euler_from_quat, quat_dcm, quat_from_euler

Arr = NDArray[np.float64]
FT, LBF = 0.3048, 4.4482216152605  # [m], [N]
LB = LBF / n.G0  # [kg]
SLUG = LBF / FT  # [kg]
RANKINE, PSF, SLUG_FT3 = 5.0 / 9.0, LBF / FT**2, SLUG / FT**3  # [K], [Pa], [kg/m^3]
EULER, ADAMS_BASHFORTH_2 = 1, 3  # JSBSim's numbers of integrators
INTEGRATORS = tuple(f"{a}/{b}" for a in ("rate", "position") for b in ("rotational", "translational"))
WIND = tuple(f"atmosphere/wind-{k}-fps" for k in ("north", "east", "down"))
START = (
    "ic/lat-geod-rad", "ic/long-gc-rad", "ic/h-sl-ft", "ic/phi-rad", "ic/theta-rad", "ic/psi-true-rad",
    "ic/vn-fps", "ic/ve-fps", "ic/vd-fps", "ic/p-rad_sec", "ic/q-rad_sec", "ic/r-rad_sec",
)  # fmt: skip
ATTITUDE = ("attitude/psi-rad", "attitude/theta-rad", "attitude/phi-rad")
RATES = ("velocities/p-rad_sec", "velocities/q-rad_sec", "velocities/r-rad_sec")  # against the earth
INERTIAL_RATES = ("velocities/pi-rad_sec", "velocities/qi-rad_sec", "velocities/ri-rad_sec")
RATE_CHANGES = ("accelerations/pidot-rad_sec2", "accelerations/qidot-rad_sec2", "accelerations/ridot-rad_sec2")
VELOCITY = ("velocities/v-north-fps", "velocities/v-east-fps", "velocities/v-down-fps")
PLACE_FLAT = ("position/lat-gc-rad", "position/long-gc-rad", "position/h-sl-ft")
PLACE_ROUND = ("position/lat-geod-rad", "position/long-gc-rad", "position/geod-alt-ft")
FORCE = ("forces/fbx-total-lbs", "forces/fby-total-lbs", "forces/fbz-total-lbs")
FLOW = ("velocities/vt-fps", "aero/beta-rad", "aero/alpha-rad", "forces/fwz-aero-lbs", "forces/fwx-aero-lbs")
THRUST, UNEQUAL = "external_reactions/thrust/magnitude", "external_reactions/unequal/magnitude-lbsft"


def library() -> Any:
    """The module jsbsim. Raises ConfigError naming the extra that brings it."""
    try:
        import jsbsim
    except ImportError:
        raise ConfigError(
            "model = 'jsbsim': JSBSim is not installed; allowed with: pip install 'wakefield[jsbsim]'"
        ) from None
    jsbsim.FGJSBBase().debug_lvl = 0
    jsbsim.set_logger(jsbsim.DefaultLogger(jsbsim.LogLevel.ERROR))  # it prints what it takes for granted otherwise
    return jsbsim


def load(xml: str, name: str, dt_s: float) -> Any:
    """JSBSim with this model loaded, at this step [s]. Raises ConfigError with JSBSim's reason if it refuses the model."""
    jsbsim = library()
    with tempfile.TemporaryDirectory() as folder:
        (place := Path(folder, "aircraft", name)).mkdir(parents=True)
        (place / f"{name}.xml").write_text(xml)
        try:
            fdm = jsbsim.FGFDMExec(folder)
            fdm.set_debug_level(0)
            loaded = fdm.load_model(name)
        except Exception as e:  # whatever its parser makes of the file
            raise ConfigError(f"JSBSim refuses the model of {name}: {e}") from None
    if not loaded:
        raise ConfigError(f"JSBSim refuses the model of {name}")
    fdm.set_dt(dt_s)
    return fdm


class Motion:
    """Its state lives in JSBSim; `par` is the plant's parameter vector (earth, air, mass), kept by reference."""

    def __init__(self, fdm: Any, par: Arr, controls: tuple[str, ...], tanks: list[float], first_point: int) -> None:
        """controls: properties [rad] of aileron, elevator, rudder (a leading "-" writes the negative), any number in this order
        of threes; tanks: share [-] of the fuel in each; first_point: number of the first point mass that is the plant's."""
        self.fdm, self.par = fdm, par
        self.round = par[n.P_ROUND] > 0.5
        self._pm = fdm.get_property_manager()
        self._wind = [self._node(k) for k in (*WIND, *WIND_RATES)]
        self._air = [self._node(k) for k in AIR]
        self._controls = [
            (self._node(k.lstrip("-")), -1.0 if k[0] == "-" else 1.0, i % 3) for i, k in enumerate(controls)
        ]
        self._thrust, self._unequal = self._node(THRUST), self._node(UNEQUAL)
        self._attitude = [self._node(k) for k in ATTITUDE]
        self._place = [self._node(k) for k in (PLACE_ROUND if self.round else PLACE_FLAT)]
        self._velocity = [self._node(k) for k in VELOCITY]
        self._rates = [self._node(k) for k in (INERTIAL_RATES if self.round else RATES)]
        self._force = [self._node(k) for k in FORCE]
        self._flow = [self._node(k) for k in FLOW]
        self._rate_changes = [self._node(k) for k in RATE_CHANGES]
        self._mass = self._node("inertia/mass-slugs")
        self._tanks = [(self._node(f"propulsion/tank[{i}]/contents-lbs"), share) for i, share in enumerate(tanks)]
        self._point = first_point
        self._points: list[Any] = []
        self._first = True
        self._node("atmosphere/turb-type").set_double_value(0.0)

    def _node(self, name: str) -> Any:
        """A property that exists. Raises ConfigError: JSBSim makes an unknown one silently, and it does nothing."""
        node = self._pm.get_node(name)
        if node is None:
            raise ConfigError(f"JSBSim {library().FGFDMExec(None).get_version()}: no property {name}")
        return node

    # --- into JSBSim ------------------------------------------------------------------------------------------------
    def weigh(self, fuel_kg: float, points_kg: list[float]) -> None:
        """Fuel in the tanks of the model, and weights [kg] of the plant's point masses."""
        if not self._points:
            self._points = [
                self._node(f"inertia/pointmass-weight-lbs[{self._point + i}]") for i in range(len(points_kg))
            ]
        for node, kg in zip(self._points, points_kg, strict=True):
            node.set_double_value(kg / LB)
        for node, share in self._tanks:
            node.set_double_value(share * fuel_kg / LB)

    def control(self, s: Arr) -> None:
        """Deflections, thrust and its moment of state `s`."""
        for node, sign, i in self._controls:
            node.set_double_value(sign * s.item(n.S_SURF + i))
        self._thrust.set_double_value(s.item(n.S_T) / LBF)
        self._unequal.set_double_value(s.item(n.S_YAW) / (LBF * FT))

    def breathe(self, height_m: float) -> None:
        """Air of the plant at a height [m]."""
        t, p, rho, _ = air(air_height(height_m, self.par), self.par)
        for node, x in zip(self._air, (t / RANKINE, p / PSF, rho / SLUG_FT3), strict=True):
            node.set_double_value(x)

    def blow(self, wind: Arr) -> None:
        """Effective wind [NW]: JSBSim's wind is the velocity of the air, NED, as the plant's."""
        for node, x in zip(self._wind[:3], wind[:3].tolist(), strict=True):
            node.set_double_value(x / FT)
        for node, x in zip(self._wind[3:], wind[3:6].tolist(), strict=True):
            node.set_double_value(x)

    def begin(self, s: Arr, wind: Arr) -> None:
        """Start from state `s` [NS] in this wind [NW]. Raises ConfigError if JSBSim cannot."""
        self.control(s)
        h = -s.item(n.S_P + 2)
        w = s[n.S_W : n.S_W + 3]
        if self.round:
            lat = self.par[n.P_LAT0] + s.item(n.S_P) / self.par[n.P_MAP_N]
            lon = s.item(n.S_P + 1) / self.par[n.P_MAP_E]
            om = self.par[n.P_OMEGA]
            earth = np.array([om * math.cos(lat), 0.0, -om * math.sin(lat)])
            w = w - (np.array(quat_dcm(*s[0:4])).reshape(3, 3) * earth[:, None]).sum(axis=0)
        else:
            lat = s.item(n.S_P) / (R_FLAT + h)
            lon = s.item(n.S_P + 1) / ((R_FLAT + h) * math.cos(lat))
        psi, theta, phi = euler_from_quat(*s[0:4].tolist())
        values = (lat, lon, h / FT, phi, theta, psi, *(s[n.S_V : n.S_V + 3] / FT), *w)
        for name, x in zip(START, values, strict=True):
            self._node(name).set_double_value(float(x))
        if self.round:  # its sea level is not quite the ellipsoid
            self._node(START[2]).set_double_value(2.0 * h / FT - self._node("ic/geod-alt-ft").get_double_value())
        self.breathe(h)
        for node in self._wind[3:]:
            node.set_double_value(0.0)
        if not self.fdm.run_ic():
            raise ConfigError("JSBSim refuses the initial condition")
        # run_ic knows no wind: what its integrators remember is of still air, and the first step must not use it
        self._integrate_by(EULER)
        self._first = True
        self.look(h, wind)

    def _integrate_by(self, number: int) -> None:
        for k in INTEGRATORS:
            self.fdm[f"simulation/integrator/{k}"] = number

    # --- a tick -----------------------------------------------------------------------------------------------------
    def look(self, height_m: float, wind: Arr) -> None:
        """Forces of now in the wind of now; nothing moves. Twice: JSBSim's rate of incidence is that of the evaluation before."""
        self.blow(wind)
        self.breathe(height_m)
        self.fdm.suspend_integration()
        self.fdm.run()
        self.fdm.run()
        self.fdm.resume_integration()

    def run(self, s: Arr) -> None:
        """One step to the controls of `s`."""
        self.control(s)
        self.fdm.run()
        if self._first:
            self._first = False
            self._integrate_by(ADAMS_BASHFORTH_2)

    # --- out of JSBSim ----------------------------------------------------------------------------------------------
    @property
    def height_m(self) -> float:
        """Height now [m]."""
        return float(self._place[2].get_double_value()) * FT

    @property
    def mass_kg(self) -> float:
        """Mass at the last evaluation."""
        return float(self._mass.get_double_value()) * SLUG

    def state(self, s: Arr) -> None:
        """Attitude, rates, velocity and position into `s`."""
        q = quat_from_euler(*(x.get_double_value() for x in self._attitude))
        sign = (
            1.0 if sum(a * b for a, b in zip(q, s[0:4].tolist(), strict=True)) >= 0.0 else -1.0
        )  # no jump at a full turn
        for i in range(4):
            s[i] = sign * q[i]
        for i in range(3):
            s[n.S_W + i] = self._rates[i].get_double_value()
            s[n.S_V + i] = self._velocity[i].get_double_value() * FT
        lat, lon, h = (x.get_double_value() for x in self._place)
        h *= FT
        if self.round:
            north, east = (lat - self.par[n.P_LAT0]) * self.par[n.P_MAP_N], lon * self.par[n.P_MAP_E]
        else:
            north, east = lat * (R_FLAT + h), lon * math.cos(lat) * (R_FLAT + h)
        s[n.S_P], s[n.S_P + 1], s[n.S_P + 2] = north, east, -h

    def felt(self) -> tuple[list[float], list[float], list[float]]:
        """Force but gravity [N], angular acceleration [rad/s^2], body axes; airspeed [m/s], beta, alpha [rad], lift, drag [N]."""
        force = [x.get_double_value() * LBF for x in self._force]
        turning = [x.get_double_value() for x in self._rate_changes]
        v, beta, alpha, lift, drag = (x.get_double_value() for x in self._flow)
        return force, turning, [v * FT, beta, alpha, lift * LBF, drag * LBF]
