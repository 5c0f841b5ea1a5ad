"""Lee 2011, the source's own coefficient forms: (2.5)-(2.10) of the tanker, (2.19), (2.20), (2.25), (2.26) of the receiver,
loaded with the derivatives of an aircraft file and set against the plant. His coefficients are not printed.

Corrected: (2.6b) reads C_S_delta_r (lee.md E1), Delta_x of (2.25) counts aft (E21). Stabilizer as the aircraft files: fixed.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.strict import ConfigError
from hil_scripts.launch.runfolder import resolve
from hil_scripts.studies.sevil.loop_flight import in_process
from sim_plant.aircraft.polynomial.of import polynomial_of
from sim_plant.aircraft.polynomial.table import PolynomialTable
from sim_plant.aircraft.sixdof.aero import loads
from sim_plant.kernels import layout as n
from tests.validation.test_equations_of_motion import plant_parameters, plant_state, random_case
from tests.validation.wind_axis import r_bw

NAMES, MASS = ("kc135r", "learjet24"), {"kc135r": 120e3, "learjet24": 5000.0}
Array = np.ndarray


def within(ac: Aircraft) -> Aircraft:
    """The aircraft without what the form has no place for: incidence rate, side force of the rates."""
    none = {"CL_alphadot": 0.0, "Cm_alphadot": 0.0, "CY_p": 0.0, "CY_r": 0.0}
    return dataclasses.replace(ac, aero=dataclasses.replace(ac.aero, **none))


def coefficients(t: PolynomialTable) -> dict[str, Any]:
    """(2.20), (2.26) of a table, in the order of `printed`."""
    return {
        "D": (t.CD0, t.CD_alpha, t.CD_alpha2, t.CD_de, t.CD_de2, t.CD_ds, t.CD_ds2),
        "S": (t.CS0, t.CS_beta, t.CS_da, t.CS_dr),
        "L": (t.CL0, t.CL_alpha, t.CL_alpha2, math.radians(t.alpha_ref_deg), t.CL_q, t.CL_de, t.CL_ds),
        "M": (t.Cm0, t.Cm_alpha, t.Cm_de, t.Cm_q, t.Cm_ds),
        "roll": (t.Cl_beta, t.Cl_p, t.Cl_r, t.Cl_da, t.Cl_dr, t.Cl0),
        "yaw": (t.Cn_beta, t.Cn_p, t.Cn_r, t.Cn_da, t.Cn_dr, t.Cn0),
        "ds": math.radians(t.stabilizer_deg),
    }


def printed(
    ac: Aircraft, k: dict[str, Any], air: Array, w: Array, u: Array, rho: float, arm: Array, angle: float
) -> Array:
    """Force [N] and moment [N m], body axes, [6] as printed. air = V, beta, alpha; w [3] rates relative to the air; u = aileron,
    elevator, rudder [rad], thrust [N], inclined up by `angle`; arm [3] m = (Delta_x, Delta_y, Delta_z)."""
    (V, be, al), (p, q, r), (da, de, dr, T), g = air, w, u, ac.geometry
    hb, hc, qs = 0.5 * g.b_m / V, 0.5 * g.c_m / V, 0.5 * rho * V * V * g.S_m2
    d, s, li, m = k["D"], k["S"], k["L"], k["M"]
    ds = k["ds"]
    drag = qs * (d[0] + d[1] * al + d[2] * al**2 + d[3] * de + d[4] * de**2 + d[5] * ds + d[6] * ds**2)
    side = qs * (s[0] + s[1] * be + s[2] * da + s[3] * dr)
    lift = qs * (li[0] + li[1] * al + li[2] * (al - li[3]) ** 2 + li[4] * hc * q + li[5] * de + li[6] * ds)
    roll, yaw = (
        qs * g.b_m * (x[5] + x[0] * be + hb * (x[1] * p + x[2] * r) + x[3] * da + x[4] * dr)
        for x in (k["roll"], k["yaw"])
    )
    pitch = qs * g.c_m * (m[0] + m[1] * al + m[2] * de + m[3] * hc * q + m[4] * ds)
    tx, ty, tz = T * math.cos(angle), 0.0, -T * math.sin(angle)
    x, y, z = arm
    moment = [roll - z * ty + y * tz, pitch + z * tx + x * tz, yaw - y * tx - x * ty]
    return np.concatenate((r_bw(be, al) @ [-drag, -side, -lift] + [tx, ty, tz], moment))


def flown(
    ac: Aircraft, number: int, seed: int, table: PolynomialTable | None = None
) -> list[tuple[Array, Array, Array, float, Array]]:
    """Random instants: air (V, beta, alpha), rates relative to the air, controls, density; force and moment [6] of the plant, by
    the derivatives of the file or by a table."""
    rng, par, out = np.random.default_rng(seed), plant_parameters(ac), []
    name, top = ac.meta.name, math.radians(ac.stall.straight_deg) if ac.stall is not None else 0.15
    par[n.P_MACH], par[n.P_BELOW] = 0.0, ac.engine.below_m
    if table is not None:
        par[n.P_SERIES] = len(par)
        par = np.concatenate((par, table.vector()))
    while len(out) < number:
        x, u = random_case(rng, name)
        x[2] = rng.uniform(-0.05, top)
        wind, gust = rng.uniform(-15.0, 15.0, 3), rng.uniform(-0.1, 0.1, 3)
        s = plant_state(x, u, wind, 1000.0)
        s[n.S_T] = u[3]
        got = loads(s[: n.N_RIGID], u[0], u[1], u[2], np.concatenate((wind, gust)), MASS[name], par)
        out.append((np.array(got[6:9]), x[3:6] - gust, u, got[12], np.array(got[:6])))
    return out


def scale(ac: Aircraft, air: Array, rho: float) -> Array:
    """Dynamic pressure times area, and times span or chord: what coefficients multiply, [6]."""
    qs, g = 0.5 * rho * air[0] ** 2 * ac.geometry.S_m2, ac.geometry
    return qs * np.array([1.0, 1.0, 1.0, g.b_m, g.c_m, g.b_m])


def thrust_arm(ac: Aircraft) -> Array:
    """(Delta_x, Delta_y, Delta_z) [m] of an aircraft file: nacelles below the centre of gravity, their thrust along body x."""
    return np.array([0.0, 0.0, ac.engine.below_m])


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_map_one_to_one_at_an_incidence(name: str) -> None:
    """Mapped at the momentary incidence and elevator: force and moment of the plant to rounding, at random states."""
    ac, worst = within(load_aircraft(name)), 0.0
    for air, w, u, rho, want in flown(ac, 200, 1):
        got = printed(ac, coefficients(polynomial_of(ac, air[2], u[1])), air, w, u, rho, thrust_arm(ac), 0.0)
        worst = max(worst, float(np.abs((got - want) / scale(ac, air, rho)).max()))
    print(f"{name}: coefficients apart by {worst:.1e}")
    assert worst < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_about_one_incidence_what_is_left_over_is_known(name: str) -> None:
    """One set of coefficients for all incidences: lift, side force and pitch exact; drag lacks the product of the deviations of
    alpha and elevator, roll and yaw the turn of the stability axes by the deviation of alpha."""
    ac, a0, de0 = within(load_aircraft(name)), 0.06, -0.03
    a, k, most = ac.aero, coefficients(polynomial_of(ac, 0.06, -0.03)), np.zeros(6)
    for air, w, u, rho, want in flown(ac, 200, 2):
        al = air[2]
        left = (printed(ac, k, air, w, u, rho, thrust_arm(ac), 0.0) - want) / scale(ac, air, rho)
        wind = r_bw(air[1], al).T @ left[:3]
        assert wind[0] == pytest.approx(2.0 * a.K * a.CL_alpha * a.CL_de * (al - a0) * (u[1] - de0), abs=1e-12)
        assert np.abs(wind[1:]).max() < 1e-12 and abs(left[4]) < 1e-12
        # the plant's roll and yaw are those of the same set turned by al - a0, of rates turned back by it
        d = al - a0
        turn = np.array([[math.cos(d), 0.0, -math.sin(d)], [0.0, 1.0, 0.0], [math.sin(d), 0.0, math.cos(d)]])
        same = printed(ac, k, air, turn.T @ w, u, rho, np.zeros(3), 0.0)[3:] / scale(ac, air, rho)[3:]
        there = turn @ [same[0], 0.0, same[2]]
        plant = want[3:] / scale(ac, air, rho)[3:]
        assert np.abs(there[[0, 2]] - plant[[0, 2]]).max() < 1e-12
        most = np.maximum(most, np.abs([wind[0], 0.0, 0.0, left[3], 0.0, left[5]]))
    print(f"{name}: drag coefficient up to {most[0]:.4f} off, roll {most[3]:.4f}, yaw {most[5]:.4f}")
    assert most[0] > 1e-4 and most[3] > 1e-3


def test_what_the_forms_have_no_place_for() -> None:
    """Yaw rate in C_S, incidence rate anywhere; in the tanker's (2.6a), (2.10) also a slope of drag and a C_M at no incidence."""
    whole = load_aircraft("kc135r")
    a, g, V = whole.aero, whole.geometry, 190.0
    rate = math.radians(1.7)
    slip = a.CY_r * rate * 0.5 * g.b_m / V / abs(a.CY_beta)
    trim = math.degrees(a.Cm0 / abs(a.Cm_de))
    flat = math.degrees(-a.CL0 / a.CL_alpha)  # least drag of the polar; of (2.6a) at alpha = 0
    print(
        f"1.7 deg/s: side force of {math.degrees(slip):.3f} deg of sideslip; C_M0 {trim:.1f} deg of elevator; {flat:.1f} deg"
    )
    worst = 0.0
    for air, w, u, rho, want in flown(whole, 100, 3):
        got = printed(whole, coefficients(polynomial_of(whole, air[2], u[1])), air, w, u, rho, thrust_arm(whole), 0.0)
        worst = max(worst, float(np.abs((got - want) / scale(whole, air, rho)).max()))
    assert worst > 1e-3
    assert 0.0 < math.degrees(slip) < 0.1 and trim > 2.0 and flat < -2.0


def test_thrust_angle_and_arm_are_those_of_a_force_at_a_place() -> None:
    """(2.3), (2.25): T (cos, 0, -sin) at Delta_x aft, Delta_y right, Delta_z below. (2.9) of the tanker is Delta_z T: short of it
    by the cosine and by the arm aft."""
    ac, rng = within(load_aircraft("learjet24")), np.random.default_rng(4)
    k, none = coefficients(polynomial_of(ac, 0.05, 0.0)), np.zeros(3)
    for _ in range(50):
        air, u, angle, arm = (
            np.array([180.0, 0.02, 0.05]),
            np.array([0.0, 0.0, 0.0, 9e3]),
            rng.uniform(-0.1, 0.1),
            rng.uniform(-2, 2, 3),
        )
        with_it, without = (printed(ac, k, air, none, v, 0.6, arm, angle) for v in (u, np.zeros(4)))
        force = u[3] * np.array([math.cos(angle), 0.0, -math.sin(angle)])
        assert np.allclose(with_it[:3] - without[:3], force, atol=1e-9)
        assert np.allclose(with_it[3:] - without[3:], np.cross(arm * [-1.0, 1.0, 1.0], force), atol=1e-8)
        short = arm[2] * u[3] - (with_it - without)[4]
        assert short == pytest.approx(u[3] * (arm[2] * (1.0 - math.cos(angle)) + arm[0] * math.sin(angle)), abs=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_the_plant_flies_a_table_as_printed(name: str) -> None:
    """Force and moment of the plant with a table of random coefficients, stabilizer setting, thrust angle and arm are
    (2.19), (2.20), (2.25), (2.26) written down anew."""
    ac, rng, worst = load_aircraft(name), np.random.default_rng(5), 0.0
    for _ in range(20):
        values = {f.name: float(rng.uniform(-1.0, 1.0)) for f in dataclasses.fields(PolynomialTable)}
        table = PolynomialTable(**values)
        arm = np.array([table.thrust_aft_m, table.thrust_right_m, table.thrust_below_m])
        for air, w, u, rho, want in flown(ac, 10, int(rng.integers(1000)), table):
            got = printed(ac, coefficients(table), air, w, u, rho, arm, math.radians(table.thrust_up_deg))
            worst = max(worst, float(np.abs((got - want) / scale(ac, air, rho)).max()))
    assert worst < 1e-12


def test_flown_by_the_polynomial_of_its_file_it_flies_like_its_file() -> None:
    """The mission with the receiver by the table `polynomial_of` makes at its trim: contact is made, and the same place held."""
    table = polynomial_of(load_aircraft("learjet24"), math.radians(4.0), math.radians(-2.0))
    sets = ["plant.aircraft.receiver.model='polynomial'"]
    sets += [f"plant.aircraft.receiver.plant.{k}={v!r}" for k, v in dataclasses.asdict(table).items()]
    seen = []
    exact = ["plant.aircraft.receiver.aero_error_frac=0.0"]
    for given in (exact, exact + sets):
        with in_process(resolve("refueling", 1, given, 20.0)) as flight:
            while not flight.server.done:
                flight.tick()
            seen.append(flight.server.world.truth(1))
    assert np.array(seen[0].xi) == pytest.approx(np.array(seen[1].xi), abs=0.5)
    assert seen[0].alpha != seen[1].alpha  # not the same equations


def test_a_table_that_lacks_a_coefficient_is_refused_by_name() -> None:
    with pytest.raises(ConfigError, match=r"aircraft\.receiver\.plant: CD0: missing"):
        resolve("refueling", 1, ["plant.aircraft.receiver.model='polynomial'"], 20.0)
