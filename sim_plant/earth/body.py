"""A body dropped or thrown over an earth: drag, rate damping, wind that depends on height. The plant's own equations of motion
(kernels/earth.py) on cases whose answer others have published (NASA/TM-2015-218675).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError, OneOf, Range, load
from sim_plant.earth.model import EARTHS
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.kernels.earth import air_height, gravitation, rigid_rates
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import euler_from_quat, quat_dcm, quat_from_euler, quat_normalise

Arr = NDArray[np.float64]
Pos = Annotated[float, Range(1e-12)]
V3 = tuple[float, float, float]
N_BODY = 13  # attitude, rates, velocity, position: the rigid-body state without thrust
# parameters of the body, behind those of the earth
B_MASS, B_I, B_S, B_SPAN, B_CHORD, B_CD, B_DAMP, NB = 0, 1, 5, 6, 7, 8, 9, 12


@dataclass(frozen=True)
class Body:
    """[body]: mass properties, reference sizes, drag and damping coefficients (per p b / 2V, q c / 2V, r b / 2V)."""

    mass_kg: Pos
    I_kgm2: V3  # Ixx, Iyy, Izz
    S_m2: Pos
    span_m: Pos
    chord_m: Pos
    Ixz_kgm2: float = 0.0
    CD: Annotated[float, Range(0.0)] = 0.0
    Clp: float = 0.0
    Cmq: float = 0.0
    Cnr: float = 0.0


@dataclass(frozen=True)
class BodyStart:
    """[start]: geodetic place, velocity over the earth in local axes, attitude against them, rates against inertial space."""

    lat_deg: Annotated[float, Range(-85.0, 85.0)] = 0.0
    lon_deg: Annotated[float, Range(-180.0, 180.0)] = 0.0
    height_m: Annotated[float, Range(-500.0, 20000.0)] = 0.0
    vel_n_mps: V3 = (0.0, 0.0, 0.0)
    euler_deg: V3 = (0.0, 0.0, 0.0)  # psi, theta, phi
    rates_degps: V3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class WindProfile:
    """[wind]: north and east component of the air's motion at heights, straight lines between, end values held."""

    height_m: tuple[float, ...] = (0.0,)
    north_mps: tuple[float, ...] = (0.0,)
    east_mps: tuple[float, ...] = (0.0,)

    def __post_init__(self) -> None:
        """Raises ConfigError for lists of different length, or heights that do not rise."""
        k = len(self.height_m)
        if not k or len(self.north_mps) != k or len(self.east_mps) != k or np.any(np.diff(self.height_m) <= 0.0):
            raise ConfigError("wind: height_m has to rise, north_mps and east_mps to be as long")


@dataclass(frozen=True)
class Case:
    """A case file."""

    name: str
    body: Body
    earth: Annotated[str, OneOf(tuple(k for k, e in EARTHS.items() if e.round))] = "wgs84"
    start: BodyStart = field(default_factory=BodyStart)
    wind: WindProfile = field(default_factory=WindProfile)
    duration_s: Pos = 30.0
    step_s: Annotated[float, Range(1e-4, 0.1)] = 0.01
    every: Annotated[int, Range(1, 10000)] = 10  # steps between rows
    source: str = ""


def load_case(path: Path) -> Case:
    """A case file. Raises ConfigError naming file, key, value and what is allowed."""
    return load(path, Case)


@jit
def profile(h: float, table: Arr) -> tuple[float, float]:
    """Wind north, east [m/s] at height h [m]; table [3, k]: heights, north, east."""
    k = table.shape[1]
    if h <= table[0, 0]:
        return table[1, 0], table[2, 0]
    for i in range(1, k):
        if h < table[0, i]:
            f = (h - table[0, i - 1]) / (table[0, i] - table[0, i - 1])
            return (
                table[1, i - 1] + f * (table[1, i] - table[1, i - 1]),
                table[2, i - 1] + f * (table[2, i] - table[2, i - 1]),
            )
    return table[1, k - 1], table[2, k - 1]


@jit
def forces(x: Arr, table: Arr, body: Arr, par: Arr, out: Arr) -> None:
    """Aerodynamic force [N] and moment [N m] in body axes into out [:6], airspeed [m/s] into out[6]: drag -qS CD along the flow,
    damping qS b Cl_p p b / 2V and so on with the rates against inertial space."""
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(x[0], x[1], x[2], x[3])
    h = -x[n.S_P + 2]
    wn, we = profile(h, table)
    an, ae, ad = x[n.S_V] - wn, x[n.S_V + 1] - we, x[n.S_V + 2]
    v = math.sqrt(an * an + ae * ae + ad * ad)
    _, _, rho, _ = isa(air_height(h, par))
    d = -0.5 * rho * v * body[B_S] * body[B_CD]
    out[0] = d * (c00 * an + c10 * ae + c20 * ad)
    out[1] = d * (c01 * an + c11 * ae + c21 * ad)
    out[2] = d * (c02 * an + c12 * ae + c22 * ad)
    m = 0.25 * rho * v * body[B_S]
    b2, c2 = body[B_SPAN] * body[B_SPAN], body[B_CHORD] * body[B_CHORD]
    out[3] = m * b2 * body[B_DAMP] * x[n.S_W]
    out[4] = m * c2 * body[B_DAMP + 1] * x[n.S_W + 1]
    out[5] = m * b2 * body[B_DAMP + 2] * x[n.S_W + 2]
    out[6] = v


@jit
def body_rates(x: Arr, table: Arr, body: Arr, par: Arr, load6: Arr, out: Arr) -> None:
    """Rates of the rigid-body state under the body's own forces."""
    forces(x, table, body, par, load6)
    rigid_rates(
        x, load6[0], load6[1], load6[2], load6[3], load6[4], load6[5],
        body[B_MASS], body[B_I], body[B_I + 1], body[B_I + 2], body[B_I + 3], par, out,
    )  # fmt: skip


@jit
def body_step(s: Arr, table: Arr, body: Arr, par: Arr, dt: float, work: Arr) -> None:
    """Classical Runge-Kutta step of dt [s] in place; work [4, 14]."""
    x, k, acc, load6 = work[0], work[1], work[2], work[3]
    for i in range(N_BODY):
        x[i], acc[i] = s[i], 0.0
    for stage in range(4):
        body_rates(x, table, body, par, load6, k)
        weight = 1.0 if stage == 0 or stage == 3 else 2.0
        ahead = 1.0 if stage == 2 else 0.5
        for i in range(N_BODY):
            acc[i] += weight * k[i]
            x[i] = s[i] + ahead * dt * k[i]
    for i in range(N_BODY):
        s[i] += dt / 6.0 * acc[i]
    quat_normalise(s, 0)


COLUMNS = (
    "time_s", "lat_deg", "lon_deg", "height_m", "v_north_mps", "v_east_mps", "v_down_mps", "psi_deg", "theta_deg", "phi_deg",
    "p_degps", "q_degps", "r_degps", "gravitation_mps2", "airspeed_mps", "mach", "density_kgpm3", "pressure_pa", "temperature_K",
    "Fx_N", "Fy_N", "Fz_N", "L_Nm", "M_Nm", "N_Nm",
)  # fmt: skip


def fly(case: Case) -> dict[str, Arr]:
    """Fly a case to its end: columns by name (COLUMNS), one row every `every` steps, the start included."""
    st, b = case.start, case.body
    par = np.zeros(n.P_TABLES)
    par[n.P_ROUND : n.P_MAP_E + 1] = EARTHS[case.earth].vector(st.lat_deg)
    body = np.array([b.mass_kg, *b.I_kgm2, b.Ixz_kgm2, b.S_m2, b.span_m, b.chord_m, b.CD, b.Clp, b.Cmq, b.Cnr])
    table = np.array([case.wind.height_m, case.wind.north_mps, case.wind.east_mps])
    s, work = np.zeros(N_BODY), np.zeros((4, n.N_RIGID))
    s[:4] = quat_from_euler(*(math.radians(a) for a in st.euler_deg))
    s[n.S_W : n.S_W + 3] = np.radians(st.rates_degps)
    s[n.S_V : n.S_V + 3] = st.vel_n_mps
    s[n.S_P + 2] = -st.height_m
    rows = []
    for i in range(round(case.duration_s / case.step_s) + 1):
        if i % case.every == 0:
            rows.append(_row(i * case.step_s, s, st, table, body, par, work[3]))
        body_step(s, table, body, par, case.step_s, work)
    return dict(zip(COLUMNS, np.array(rows).T, strict=True))


def _row(t: float, s: Arr, st: BodyStart, table: Arr, body: Arr, par: Arr, load6: Arr) -> list[float]:
    lat = par[n.P_LAT0] + s[n.S_P] / par[n.P_MAP_N]
    lon, h = math.radians(st.lon_deg) + s[n.S_P + 1] / par[n.P_MAP_E], -s[n.S_P + 2]
    gn, gd = gravitation(math.sin(lat), math.cos(lat), h, par)
    forces(s, table, body, par, load6)
    temperature, pressure, density, a = isa(air_height(h, par))
    return [
        t, math.degrees(lat), math.degrees(lon), h, *s[n.S_V : n.S_V + 3],
        *np.degrees(euler_from_quat(s[0], s[1], s[2], s[3])), *np.degrees(s[n.S_W : n.S_W + 3]),
        math.hypot(gn, gd), load6[6], load6[6] / a, density, pressure, temperature, *load6[:6],
    ]  # fmt: skip
