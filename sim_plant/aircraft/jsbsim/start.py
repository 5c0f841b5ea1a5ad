"""JSBSim's own steady flight of a model, and a model made ready for the plant."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError
from sim_plant.aircraft.jsbsim.motion import Motion, load
from sim_plant.aircraft.jsbsim.stock import SURFACES, Stock
from sim_plant.kernels import layout as n
from sim_plant.kernels.earth import rigid_rates
from sim_plant.kernels.rot import euler_from_quat, quat_from_euler

Arr = NDArray[np.float64]
WIDTH = 0.1  # [rad], or a hundredth of the static thrust: a step of what a trim is looked for by
RETRACTED = (
    "gear/gear-pos-norm", "gear/gear-cmd-norm", "fcs/flap-pos-norm", "fcs/speedbrake-pos-norm", "fcs/spoiler-pos-norm",
)  # fmt: skip


def unknown(stock: Stock, flat_height_m: float | None) -> list[str]:
    """Properties its aerodynamics go by that nothing left of the model makes: of flight control, systems or engines."""
    whole = ET.fromstring(stock.xml(flat_height_m))
    aero = whole.find("aerodynamics")
    assert aero is not None
    asked = {(e.text or "").strip().lstrip("-") for e in aero.iter() if e.tag in ("p", "property", "independentVar")}
    own = {str(e.get("name")) for e in aero.iter() if e.get("name")}
    whole.remove(aero)
    whole.append(ET.fromstring('<aerodynamics><axis name="LIFT"/></aerodynamics>'))
    have = load(ET.tostring(whole, encoding="unicode"), stock.name, 0.01).get_property_manager()
    return sorted(k for k in asked - own if have.get_node(k) is None)


def stock_motion(stock: Stock, par: Arr, flat_height_m: float | None, step_s: float) -> Motion:
    """JSBSim with a stock model, clean. Arguments as Stock.xml and Motion. Raises ConfigError."""
    if missing := unknown(stock, flat_height_m):
        raise ConfigError(
            f"JSBSim's {stock.name}: its aerodynamics go by {', '.join(missing)}, which is not of the airframe; allowed: a model "
            "without"
        )
    fdm = load(stock.xml(flat_height_m), stock.name, step_s)
    for k in RETRACTED:
        fdm[k] = 0.0
    whole = sum(stock.tanks_kg)
    return Motion(fdm, par, SURFACES, [t / whole for t in stock.tanks_kg], stock.points)


def rest(motion: Motion, s: Arr, wind: Arr, mass: float) -> Arr:
    """What keeps state `s` from being steady, as JSBSim has it [7]: acceleration [m/s^2] NED, ten times angular acceleration
    [rad/s^2] and ten times sideslip [rad]."""
    motion.begin(s, wind)
    (fx, fy, fz), turning, flow = motion.felt()
    k = np.zeros(n.N_RIGID)
    rigid_rates(s, fx, fy, fz, 0.0, 0.0, 0.0, mass, 1.0, 1.0, 1.0, 0.0, motion.par, k)
    return np.array([*k[n.S_V : n.S_V + 3], *(10.0 * x for x in turning), 10.0 * flow[1]])


def trim_motion(motion: Motion, s: Arr, wind: Arr, at: str) -> Arr:
    """State of steady flight near `s` [NS] at its position and velocity: attitude, surfaces and thrust that leave nothing of
    `rest`. Raises ConfigError, beginning with `at`, where the model has none within the travel of the surfaces."""
    from scipy.optimize import root  # slow to import: only where something is trimmed

    out, par = s.copy(), motion.par
    unit = 0.1 * float(par[n.P_T0])
    mass = float(par[n.P_EMPTY] + s[n.S_FUEL])

    x0 = np.array([*euler_from_quat(*s[0:4].tolist()), *s[n.S_SURF : n.S_SURF + 3], s[n.S_T] / unit])

    def residual(z: Arr) -> Arr:
        x = x0 + WIDTH * (z - 1.0)  # about 1: the solver's steps are relative, and some of x0 are all but nothing
        out[0:4] = quat_from_euler(x[0], x[1], x[2])
        out[n.S_SURF : n.S_SURF + 3], out[n.S_T] = x[3:6], x[6] * unit
        return rest(motion, out, wind, mass)

    off = residual(root(residual, np.ones(7), method="hybr", tol=1e-13, options={"eps": 1e-8}).x)
    lo, hi = par[n.P_LO : n.P_LO + 3], par[n.P_HI : n.P_HI + 3]
    worst, held = float(np.max(np.abs(off))), out[n.S_SURF : n.S_SURF + 3]
    if not worst <= 1e-5 or np.any(held < lo) or np.any(held > hi) or not out[n.S_T] > 0.0:
        raise ConfigError(
            f"{at}: no trim in JSBSim: residual {worst:.2g}, surfaces {np.degrees(held).round(2)} deg of "
            f"{np.degrees(lo).round(1)} to {np.degrees(hi).round(1)}, thrust {out[n.S_T]:.0f} N"
        )
    return out
