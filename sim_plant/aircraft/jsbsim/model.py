"""JSBSim's model of an aircraft from the plant's parameter vector, and what every model here has: wind, air and thrust of ours.

It is the build-up of aircraft/sixdof/aero.py in JSBSim's words: drag, side force and lift along the wind axes, moments in
stability axes, rates against the air that turns. Servos and engines are not in it: it is given deflections and thrust.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim_plant.aircraft.sixdof.eom import inertia
from sim_plant.kernels import layout as n

R_FLAT = 1.0e10  # [m] radius of the sphere that stands for a flat earth: 100 km turn the vertical by 1e-5 rad
SLUG_FT2 = 4.4482216152605 * 0.3048  # [kg m^2]; JSBSim's own conversion from kg m^2 is 9e-5 off
ARM = 10.0  # [m] of the point masses that carry what mass and inertia change by
# places of those, structural axes (aft, right, up), in ARM: the centre, then pairs along each axis and along the diagonal
POINTS = (
    (0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 0, 1), (-1, 0, -1),
)  # fmt: skip
CONTROLS = ("ctl/da", "ctl/de", "ctl/dr")
WIND_RATES = ("ctl/p-wind", "ctl/q-wind", "ctl/r-wind")  # [rad/s] of the air's turning, body axes
AIR = ("atmosphere/override/temperature", "atmosphere/override/pressure", "atmosphere/override/density")
AERO_RATES = (
    "velocities/p-aero-rad_sec", "velocities/q-aero-rad_sec", "velocities/r-aero-rad_sec", "aero/alphadot-rad_sec",
)  # fmt: skip
INERTIAL_RATES = ("velocities/pi-rad_sec", "velocities/qi-rad_sec", "velocities/ri-rad_sec")
OWN_RATES = ("aero/function/p-air", "aero/function/q-air", "aero/function/r-air", "aero/function/alphadot-air")


def product(*factors: str | float) -> str:
    """<product> of properties and numbers."""
    items = "".join(f"<p>{f}</p>" if isinstance(f, str) else f"<v>{float(f)!r}</v>" for f in factors)
    return f"<product>{items}</product>"


def _function(name: str, scale: list[str], terms: list[str]) -> str:
    outer = "".join(f"<p>{f}</p>" for f in scale)
    return f'<function name="{name}"><product>{outer}<sum>{"".join(terms)}</sum></product></function>'


def planet(g_mps2: float, height_m: float) -> str:
    """<planet> that stands for a flat earth: no rotation, gravity g [m/s^2] at this height [m]."""
    gm = g_mps2 * (R_FLAT + height_m) ** 2
    return (
        f'<planet name="flat"><semimajor_axis unit="M">{R_FLAT!r}</semimajor_axis><semiminor_axis unit="M">{R_FLAT!r}'
        f'</semiminor_axis><rotation_rate unit="RAD/SEC">0.0</rotation_rate><GM unit="M3/SEC2">{gm!r}</GM><J2>0.0</J2></planet>'
    )


def system() -> str:
    """<system> of the properties the plant writes; the air's take JSBSim's own atmosphere off."""
    own = "".join(f'<property value="0.0">{p}</property>' for p in (*CONTROLS, *WIND_RATES))
    air = "".join(
        f'<property value="{v!r}">{p}</property>' for p, v in zip(AIR, (518.67, 2116.22, 0.002377), strict=True)
    )
    return f'<system name="wakefield">{own}{air}</system>'


def own_rates() -> str:
    """Functions of the body rates against air that turns (JSBSim knows no such wind but its own turbulence; over a turning earth
    they are inertial, as the plant's), and of the rate of incidence.

    JSBSim takes that one from u' and w' of the motion over the ground: in a wind W, however steady, they lack w x W.
    """
    rates = "".join(
        f'<function name="{own}"><difference><p>{inertial}</p><p>{wind}</p></difference></function>'
        for own, inertial, wind in zip(OWN_RATES, INERTIAL_RATES, WIND_RATES, strict=False)
    )
    u, v, w = (f"<difference><p>velocities/{k}-fps</p><p>velocities/{k}-aero-fps</p></difference>" for k in "uvw")
    p, q, r = (f"<p>velocities/{k}-rad_sec</p>" for k in "pqr")
    ua, wa = (f"<p>velocities/{k}-aero-fps</p>" for k in "uw")
    du = f"<difference><product>{q}{w}</product><product>{r}{v}</product></difference>"
    dw = f"<difference><product>{p}{v}</product><product>{q}{u}</product></difference>"
    turned = (
        f"<quotient><difference><product>{ua}{dw}</product><product>{wa}{du}</product></difference>"
        f"<sum><product>{ua}{ua}</product><product>{wa}{wa}</product></sum></quotient>"
    )
    return f'{rates}<function name="{OWN_RATES[3]}"><sum><p>{AERO_RATES[3]}</p>{turned}</sum></function>'


def reactions(at_m: tuple[float, float, float]) -> str:
    """<external_reactions>: thrust along body x at a place, structural axes [m], and the yawing moment of its being unequal."""
    place = "".join(f"<{k}>{float(v)!r}</{k}>" for k, v in zip("xyz", at_m, strict=True))
    return (
        f'<external_reactions><force name="thrust" frame="BODY"><location unit="M">{place}</location>'
        "<direction><x>1</x><y>0</y><z>0</z></direction></force>"
        '<moment name="unequal" frame="BODY"><direction><x>0</x><y>0</y><z>1</z></direction></moment></external_reactions>'
    )


def point_masses(at_m: tuple[float, float, float], places: tuple[tuple[int, int, int], ...] = POINTS) -> str:
    """<pointmass> of each of `places` about a point, structural axes [m], without weight."""
    return "".join(
        f'<pointmass name="wakefield-{i}"><weight unit="KG">0.0</weight><location unit="M">'
        + "".join(
            f"<{k}>{float(at + ARM * d)!r}</{k}>" for k, at, d in zip("xyz", at_m, place, strict=True)
        )
        + "</location></pointmass>"
        for i, place in enumerate(places)
    )  # fmt: skip


def point_weights(mass: float, base: float, par: NDArray[np.float64]) -> list[float]:
    """Masses [kg], some of them negative, that at POINTS turn mass and inertia at `base` [kg] into those at `mass`."""
    now, then = inertia(mass, par), inertia(base, par)
    dx, dy, dz, k = (a - b for a, b in zip(now, then, strict=True))
    # a diagonal pair adds (k, 2 k, k) to Ixx, Iyy, Izz and k to Ixz; pairs along x, y, z make up the rest
    along = ((dy + dz - dx) / 2.0 - k, (dx + dz - dy) / 2.0, (dx + dy - dz) / 2.0 - k, k)
    pairs = [x / (2.0 * ARM * ARM) for x in along]
    centre = mass - base - 2.0 * sum(pairs)
    return [centre, *(w for w in pairs for _ in range(2))]


def aerodynamics(par: NDArray[np.float64]) -> str:
    """<aerodynamics> of a parameter vector (kernels/layout.py)."""
    al, be = "aero/alpha-rad", "aero/beta-rad"
    p, q, r, ad = OWN_RATES
    ps, rs, static = "aero/function/ps", "aero/function/rs", "aero/function/static-lift"
    da, de, dr = CONTROLS
    hb, hc = "aero/bi2vel", "aero/ci2vel"
    cos, sin = f"<cos><p>{al}</p></cos>", f"<sin><p>{al}</p></sin>"

    def times(x: str, factor: str) -> str:
        return f"<product><p>{x}</p>{factor}</product>"

    def lateral(at: int, aileron: float) -> list[str]:
        """Of beta and of the two rates, `at` and what follows it; of the aileron."""
        b, by_p, by_r = (float(x) for x in par[at : at + 3])
        return [product(b, be), product(by_p, hb, ps), product(by_r, hb, rs), product(aileron, da)]

    qs = ["aero/qbar-psf", "metrics/Sw-sqft"]
    qsb, qsc = [*qs, "metrics/bw-ft"], [*qs, "metrics/cbarw-ft"]
    lift = [
        f"<v>{float(par[n.CL0])!r}</v>", product(par[n.CL_ALPHA], al), product(par[n.CL_DE], de),
    ]  # fmt: skip
    pitch = [
        f"<v>{float(par[n.CM0])!r}</v>", product(par[n.CM_ALPHA], al), product(par[n.CM_Q], hc, q),
        product(par[n.CM_ALPHADOT], hc, ad), product(par[n.CM_DE], de),
    ]  # fmt: skip
    side = [*lateral(n.CY_BETA, 0.0), product(par[n.CY_DR], dr)]
    roll = [*lateral(n.CL_ROLL_BETA, par[n.CL_ROLL_DA]), product(par[n.CL_ROLL_DR], dr)]
    yaw = [*lateral(n.CN_BETA, par[n.CN_DA]), product(par[n.CN_DR], dr)]
    drag = [f"<v>{float(par[n.CD0])!r}</v>", product(par[n.K_POLAR], static, static)]
    whole = [f"<p>{static}</p>", product(par[n.CL_Q], hc, q), product(par[n.CL_ALPHADOT], hc, ad)]
    functions = (
        own_rates()
        + f'<function name="{ps}"><sum>{times(p, cos)}{times(r, sin)}</sum></function>'
        + f'<function name="{rs}"><difference>{times(r, cos)}{times(p, sin)}</difference></function>'
        + f'<function name="{static}"><sum>{"".join(lift)}</sum></function>'
    )
    forces = {
        "DRAG": _function("aero/coefficient/CD", qs, drag), "SIDE": _function("aero/coefficient/CY", qs, side),
        "LIFT": _function("aero/coefficient/CL", qs, whole),
    }  # fmt: skip
    moments = {
        "ROLL": _function("aero/coefficient/Cl", qsb, roll), "PITCH": _function("aero/coefficient/Cm", qsc, pitch),
        "YAW": _function("aero/coefficient/Cn", qsb, yaw),
    }  # fmt: skip
    axes = "".join(f'<axis name="{k}">{f}</axis>' for k, f in forces.items())
    axes += "".join(f'<axis name="{k}" frame="STABILITY">{f}</axis>' for k, f in moments.items())
    return f"<aerodynamics>{functions}{axes}</aerodynamics>"


def model_xml(name: str, par: NDArray[np.float64], mass_kg: float, flat_height_m: float | None) -> str:
    """JSBSim configuration of an aircraft of these parameters, with inertias at a mass [kg], its centre of gravity in the origin.

    flat_height_m: over a flat earth, at which height [m] gravity is the standard's; None: over JSBSim's WGS-84.
    """
    ixx, iyy, izz, ixz = (float(v) / SLUG_FT2 for v in inertia(mass_kg, par))
    size = {"wingarea": ("M2", par[n.P_S]), "wingspan": ("M", par[n.P_B]), "chord": ("M", par[n.P_C])}
    zero = "<x>0</x><y>0</y><z>0</z>"
    metrics = "".join(f'<{k} unit="{u}">{float(v)!r}</{k}>' for k, (u, v) in size.items())
    metrics += "".join(f'<location name="{k}" unit="M">{zero}</location>' for k in ("AERORP", "EYEPOINT", "VRP"))
    moments = "".join(
        f'<{k} unit="SLUG*FT2">{v!r}</{k}>' for k, v in (("ixx", ixx), ("iyy", iyy), ("izz", izz), ("ixz", ixz))
    )
    return (
        f'<?xml version="1.0"?><fdm_config name="{name}" version="2.0" release="BETA">'
        + ("" if flat_height_m is None else planet(n.G0, flat_height_m))
        + f'<metrics>{metrics}</metrics><mass_balance negated_crossproduct_inertia="false">{moments}'
        + f'<emptywt unit="KG">{float(mass_kg)!r}</emptywt><location name="CG" unit="M">{zero}</location>'
        + point_masses((0.0, 0.0, 0.0))
        + f"</mass_balance><ground_reactions/><propulsion/>{system()}"
        + f"{aerodynamics(par)}{reactions((0.0, 0.0, 0.0))}</fdm_config>"
    )
