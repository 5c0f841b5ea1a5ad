"""The project's aircraft as JSBSim models, and a flight of the same manoeuvre in JSBSim and in the plant.

`python -m tests.validation.jsbsim_model` prints the table of differences, state by state.

Same assumptions on both sides: rigid body of constant mass, still standard atmosphere, thrust along body x through the
centre of gravity, flat earth. JSBSim knows only round planets, so it is given one of 1e10 m radius that does not
rotate, with GM for 9.80665 m/s^2 at the start height: 12 km of flight turn the vertical by 1.2e-6 rad. Its standard
atmosphere converts geometric to geopotential height with the true earth's radius; the start height is chosen to be
7010 m geopotential, and height is compared as change. Neither actuators nor engine are modelled there: JSBSim is fed
the deflections and the thrust the plant's own actuators produced.
"""

from __future__ import annotations

import re
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import jsbsim
import numpy as np
from scipy.interpolate import CubicHermiteSpline

from flightsw.aircraft import Aircraft, load_aircraft
from sim_plant.aircraft.jsbsim.model import R_FLAT as RADIUS
from sim_plant.aircraft.jsbsim.model import model_xml
from sim_plant.aircraft.sixdof.eom import step
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.aircraft.sixdof.trim import throttle_for, trim
from sim_plant.kernels import layout as n

FT, LBF = 0.3048, 4.4482216152605
H0, V0, DURATION = 7010.0, 195.0, 60.0  # [m], [m/s], [s]
EARTH = 6356766.0  # [m] radius in the standard's geopotential height
H_START = EARTH * H0 / (EARTH - H0)  # [m] geometric height of H0 geopotential
MASS = {"kc135r": 120e3, "learjet24": 4989.5}
STATES = (
    "V [m/s]", "alpha [rad]", "beta [rad]", "p [rad/s]", "q [rad/s]", "r [rad/s]",
    "phi [rad]", "theta [rad]", "psi [rad]", "altitude [m]", "north [m]", "east [m]",
)  # fmt: skip

Array = np.ndarray


# --- the aircraft file ---------------------------------------------------------------------------------------------
def aircraft_xml(ac: Aircraft, mass_kg: float) -> str:
    """JSBSim configuration of an aircraft record, as the plant's own, but in JSBSim's atmosphere."""
    xml = model_xml(ac.meta.name, parameter_vector(ac), mass_kg, H_START)
    return re.sub(r"<property [^>]*>atmosphere/override/[a-z]+</property>", "", xml)


# --- the manoeuvre in the plant ------------------------------------------------------------------------------------
@dataclass(frozen=True)
class History:
    """What the plant did: t [k], states [k,12] in the order of STATES, deflections da, de, dr [k,3], their rates,
    thrust [k].
    """

    t: Array
    states: Array
    surf: Array
    surf_rate: Array
    thrust: Array
    thrust_rate: Array


def doublet(t: float, start: float, half: float, size: float) -> float:
    """+size for `half` seconds, then -size for as long."""
    return size * ((start <= t < start + half) * 1.0 - (start + half <= t < start + 2 * half) * 1.0)


def commands(t: float, trimmed: Array) -> tuple[float, float, float, float]:
    """Aileron, elevator, rudder [rad], throttle factor: doublets on each axis and a thrust step, spread over the
    minute.
    """
    d = np.pi / 180
    return (
        trimmed[0] + doublet(t, 16.0, 1.5, 2.0 * d),
        trimmed[1] + doublet(t, 2.0, 2.0, -2.0 * d),
        trimmed[2] + doublet(t, 26.0, 1.5, 3.0 * d),
        1.6 if t >= 34.0 else 1.0,
    )


def fly_plant(ac: Aircraft, mass_kg: float, rate_hz: int = 100) -> History:
    """The manoeuvre with the plant's own step (servos and engine included) in still air, from its own trim."""
    par = parameter_vector(ac)
    par[n.P_TSFC] = 0.0  # constant mass
    w = np.zeros(n.NW)
    s = trim(np.array([0.0, 0.0, -H0]), np.array([V0, 0.0, 0.0]), w, mass_kg - ac.mass.empty_kg, par)
    trimmed, throttle = s[n.S_SURF : n.S_SURF + 3].copy(), throttle_for(s, w, par)
    c, scratch, k = np.zeros(n.NC), np.zeros((4, n.NS)), round(DURATION * rate_hz)
    log = np.zeros((k + 1, n.NS))
    log[0] = s
    for i in range(k):
        da, de, dr, f = commands(i / rate_hz, trimmed)
        c[0:4] = da, de, dr, f * throttle
        step(s, c, w, par, 1.0 / rate_hz, scratch)
        log[i + 1] = s
    t = np.arange(k + 1) / rate_hz
    thrust = log[:, n.S_T]
    states = np.array([_plant_states(row) for row in log])
    surf, surf_rate = log[:, n.S_SURF : n.S_SURF + 3], log[:, n.S_RATE : n.S_RATE + 3]
    return History(t, states, surf, surf_rate, thrust, np.gradient(thrust, t))


def _plant_states(s: Array) -> Array:
    """Plant vector -> STATES, with rotations of this file (Euler-Rodrigues), not the plant's."""
    q0, v = s[0], s[1:4]
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    R = ((q0 * q0 - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * q0 * skew).T  # north-east-down to body
    u = R @ s[n.S_V : n.S_V + 3]
    V = float(np.linalg.norm(u))
    euler = np.arctan2(R[1, 2], R[2, 2]), -np.arcsin(R[0, 2]), np.arctan2(R[0, 1], R[0, 0])
    air = V, np.arctan2(u[2], u[0]), np.arcsin(u[1] / V)
    return np.array([*air, *s[n.S_W : n.S_W + 3], *euler, -s[n.S_P + 2], s[n.S_P], s[n.S_P + 1]])


# --- the same in JSBSim --------------------------------------------------------------------------------------------
def load(folder: Path, ac: Aircraft, mass_kg: float) -> jsbsim.FGFDMExec:
    """Write the model below `folder` and load it. Raises RuntimeError if JSBSim refuses it."""
    name = ac.meta.name
    place = folder / "aircraft" / name
    place.mkdir(parents=True, exist_ok=True)
    (place / f"{name}.xml").write_text(aircraft_xml(ac, mass_kg))
    jsbsim.FGJSBBase().debug_lvl = 0
    fdm = jsbsim.FGFDMExec(str(folder))
    fdm.set_debug_level(0)
    if not fdm.load_model(name):
        raise RuntimeError(f"JSBSim refused the model of {name}")
    # second-order Adams-Bashforth everywhere; JSBSim's default is of first order in the rotation
    for k in ("rate/rotational", "rate/translational", "position/rotational", "position/translational"):
        fdm[f"simulation/integrator/{k}"] = 3
    return fdm


def fly_jsbsim(folder: Path, ac: Aircraft, mass_kg: float, h: History, substeps: int = 10) -> Array:
    """States [k,12] of JSBSim at the plant's times, flown with the plant's deflections and thrust."""
    fdm = load(folder, ac, mass_kg)
    dt = (h.t[1] - h.t[0]) / substeps
    fdm.set_dt(dt)
    surf = CubicHermiteSpline(h.t, h.surf, h.surf_rate)
    fine = np.arange((len(h.t) - 1) * substeps + 1) * dt
    deflection, thrust = surf(fine), np.interp(fine, h.t, h.thrust) / LBF
    x0 = h.states[0]
    ic = {
        "ic/lat-gc-deg": 0.0,
        "ic/long-gc-deg": 0.0,
        "ic/h-sl-ft": H_START / FT,
        "ic/psi-true-rad": x0[8],
        "ic/theta-rad": x0[7],
        "ic/phi-rad": x0[6],
        "ic/u-fps": x0[0] * np.cos(x0[1]) * np.cos(x0[2]) / FT,
        "ic/v-fps": x0[0] * np.sin(x0[2]) / FT,
        "ic/w-fps": x0[0] * np.sin(x0[1]) * np.cos(x0[2]) / FT,
    }
    for key, value in ic.items():
        fdm[key] = float(value)

    def control(i: int) -> None:
        fdm["ctl/da"], fdm["ctl/de"], fdm["ctl/dr"] = (float(v) for v in deflection[i])
        fdm["external_reactions/thrust/magnitude"] = float(thrust[i])

    control(0)
    if not fdm.run_ic():
        raise RuntimeError("JSBSim refused the initial condition")
    out = [_jsbsim_states(fdm)]
    for i in range(1, len(fine)):
        control(i)  # a run integrates first, then evaluates the forces of the new time
        fdm.run()
        if i % substeps == 0:
            out.append(_jsbsim_states(fdm))
    states = np.array(out)
    states[:, 8] = np.unwrap(states[:, 8])
    states[:, 9] += H0 - states[0, 9]
    return states


def _jsbsim_states(fdm: jsbsim.FGFDMExec) -> Array:
    names = (
        "aero/alpha-rad", "aero/beta-rad", "velocities/p-rad_sec", "velocities/q-rad_sec", "velocities/r-rad_sec",
        "attitude/phi-rad", "attitude/theta-rad", "attitude/psi-rad",
    )  # fmt: skip
    psi = fdm["attitude/psi-rad"]
    values = [fdm["velocities/vt-fps"] * FT, *(fdm[k] for k in names[:-1]), psi if psi < np.pi else psi - 2 * np.pi]
    height = fdm["position/h-sl-ft"] * FT
    north, east = (fdm[f"position/{k}-gc-rad"] * (RADIUS + height) for k in ("lat", "long"))
    return np.array([*values, height, north, east])


# --- comparison ----------------------------------------------------------------------------------------------------
def differences(plant: Array, other: Array) -> tuple[Array, Array, Array]:
    """Range of each state, largest absolute difference, and their ratio [12]."""
    span = np.ptp(plant, axis=0)
    worst = np.abs(plant - other).max(axis=0)
    return span, worst, worst / span


def compare(folder: Path, name: str, substeps: int = 10) -> tuple[Array, str]:
    """Relative differences [12] of one aircraft over the manoeuvre, and the printed table."""
    ac = load_aircraft(name)
    h = fly_plant(ac, MASS[name])
    span, worst, ratio = differences(h.states, fly_jsbsim(folder, ac, MASS[name], h, substeps))
    rates = f"plant 100 Hz, JSBSim {100 * substeps} Hz"
    lines = [f"{name}, {MASS[name]:.0f} kg, {DURATION:.0f} s from {V0:.0f} m/s at {H0:.0f} m: {rates}"]
    lines += [f"  {'state':12s} {'range':>12s} {'largest diff':>13s} {'relative':>10s}"]
    lines += [f"  {s:12s} {a:12.5g} {b:13.3e} {c:10.2e}" for s, a, b, c in zip(STATES, span, worst, ratio, strict=True)]
    lines += [f"  largest relative difference {ratio.max():.2e} ({STATES[int(ratio.argmax())]})"]
    return ratio, "\n".join(lines)


def main() -> None:
    """Print the table of both aircraft."""
    substeps = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    with tempfile.TemporaryDirectory() as folder:
        for name in MASS:
            print(compare(Path(folder), name, substeps)[1])


if __name__ == "__main__":
    main()
