"""Lee 2011, receiver relative to the tanker, matrix equations: errata E4, E6, E7, E8 of lee.md section 4.

Yardstick: two plant aircraft (body axes, quaternions), each in a wind of its own that varies with time, turned to the
relative states by differencing. The printed equations are written as printed, with S(w_rel) + R S(w_T) R^T unreduced.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from flightsw.aircraft import Aircraft, load_aircraft
from sim_plant.kernels import layout as n
from tests.validation import wind_axis as wa
from tests.validation.test_equations_of_motion import (
    SCALE,
    Wind,
    along,
    dcm_bn,
    plant_parameters,
    plant_rates,
    plant_state,
    random_case,
    relative_state,
)

M_R, M_T = 4989.5, 120e3
Array = np.ndarray


def without_lag(name: str) -> Aircraft:
    """Aircraft data without incidence-rate derivatives, which Lee's build-up does not have."""
    ac = load_aircraft(name)
    return dataclasses.replace(ac, aero=dataclasses.replace(ac.aero, CL_alphadot=0.0, Cm_alphadot=0.0))


@dataclasses.dataclass
class Pair:
    """One instant of a formation: relative state x [12] and its rates by differencing, and what the equations need.

    R = R_BRBT, Rt = R_BTI, Rr = R_BRI; w_t, w_t_dot tanker rates; v_t its velocity (NED); wind, wind_dot of the receiver
    (NED); wb, wb_dot the same in receiver body components; A aerodynamic force in wind axes, M moment, P thrust.
    """

    x: Array
    rates: Array
    R: Array
    Rt: Array
    Rr: Array
    w_t: Array
    w_t_dot: Array
    v_t: Array
    euler_t: Array
    wind: Array
    wind_dot: Array
    wb: Array
    wb_dot: Array
    A: Array
    M: Array
    P: Array
    I: Array  # noqa: E741 - the letter of the source


def pairs(number: int, seed: int) -> list[Pair]:
    """Random formations of the receiver near the tanker, both manoeuvring."""
    rng, out = np.random.default_rng(seed), []
    rec, tan = without_lag("learjet24"), load_aircraft("kc135r")
    par_r, par_t, b = plant_parameters(rec), plant_parameters(tan), wa.body(without_lag("learjet24"), M_R)
    none = np.zeros(3)
    for _ in range(number):
        xr, ur = random_case(rng, "learjet24")
        xt, ut = random_case(rng, "kc135r")
        xr[6:9] = xt[6:9] + rng.uniform(-0.3, 0.3, 3)
        xr[9:12] = xt[9:12] + rng.uniform(-80, 80, 3)
        wr, wt, t = Wind(rng), Wind(rng), rng.uniform(0, 50)
        sr = plant_state(xr, ur, wr.at(t), M_R - rec.mass.empty_kg)
        st = plant_state(xt, ut, wt.at(t), M_T - tan.mass.empty_kg)
        dr = plant_rates(sr, ur, np.concatenate((wr.at(t), none)), par_r)
        dt = plant_rates(st, ut, np.concatenate((wt.at(t), none)), par_t)
        rates = along(lambda h: relative_state(sr[: n.N_RIGID] + h * dr, st[: n.N_RIGID] + h * dt, wr.at(t + h)), 2e-3)  # noqa: B023
        wb_dot = along(lambda h: dcm_bn(sr[0:4] + h * dr[0:4]) @ wr.at(t + h), 2e-3)  # noqa: B023
        Rr, Rt, x = dcm_bn(sr[0:4]), dcm_bn(st[0:4]), relative_state(sr, st, wr.at(t))
        A, M = wa.aero(b, x[0:3], sr[4:7], ur, wa.density(-sr[12]), 0.0)
        P = np.array([ur[3], 0.0, 0.0])
        out.append(
            Pair(
                x=x,
                rates=rates,
                R=Rr @ Rt.T,
                Rt=Rt,
                Rr=Rr,
                w_t=st[4:7],
                w_t_dot=dt[4:7],
                v_t=st[7:10],
                euler_t=xt[6:9],
                wind=wr.at(t),
                wind_dot=wr.rate(t),
                wb=Rr @ wr.at(t),
                wb_dot=wb_dot,
                A=A,
                M=M,
                P=P,
                I=b.I,
            )
        )
    return out


def terms(c: Pair) -> tuple[Array, Array, Array, Array]:
    """eps, S(w_rel) + R S(w_T) R^T, R_BW [V, 0, 0] and the external force per mass, as (2.16) prints them."""
    V, be, al = c.x[0:3]
    turn = wa.skew_s(c.x[3:6]) + c.R @ wa.skew_s(c.w_t) @ c.R.T
    rbw = wa.r_bw(be, al)
    return wa.eps(V, be, al), turn, rbw @ [V, 0.0, 0.0], c.R @ c.Rt @ wa.G + (rbw @ c.A + c.P) / M_R


def test_E04_relative_equations_are_right() -> None:
    """(2.16), (2.23), (2.29), (6.5), (6.11) are right as printed: differencing two inertial aircraft."""
    worst = dict.fromkeys(("2.16", "2.23", "2.29", "6.5", "6.11"), 0.0)
    for c in pairs(60, 4):
        e, turn, ua, force = terms(c)
        w = c.x[3:6] + c.R @ c.w_t
        got = {
            "2.16": np.linalg.solve(e, turn @ (ua + c.wb) - c.wb_dot + force),
            "6.5": np.linalg.solve(e, turn @ ua - c.Rr @ c.wind_dot + force),
            "2.23": np.linalg.solve(c.I, c.M + wa.skew_s(w) @ c.I @ w)
            - wa.skew_s(c.x[3:6]) @ c.R @ c.w_t
            - c.R @ c.w_t_dot,
            "2.29": c.R.T @ ua + c.R.T @ c.wb - c.Rt @ c.v_t + wa.skew_s(c.w_t) @ c.x[9:12],
            "6.11": c.R.T @ ua + c.Rt @ c.wind - c.Rt @ c.v_t + wa.skew_s(c.w_t) @ c.x[9:12],
        }
        for k, v in got.items():
            i = {"2.16": 0, "6.5": 0, "2.23": 3, "2.29": 9, "6.11": 9}[k]
            want = c.rates[i : i + 3]
            worst[k] = max(worst[k], float(np.abs((v - want) / (SCALE[i : i + 3] + np.abs(want))).max()))
    print("scaled differences:", ", ".join(f"({k}) {v:.1e}" for k, v in worst.items()))
    assert max(worst.values()) < 1e-7


def test_E06_second_brace_needs_the_transpose() -> None:
    """(6.6) prints R^T {S(w) R_BW V} + R {F/m - eps [..]}; correct R^T on both braces (R = R_BRI)."""
    good, bad = 0.0, []
    for c in pairs(60, 6):
        e, turn, ua, force = terms(c)
        second = force - e @ c.rates[0:3]
        good = max(good, float(np.abs(c.Rr.T @ (turn @ ua + second) - c.wind_dot).max()))
        bad.append(np.linalg.norm(c.Rr.T @ turn @ ua + c.Rr @ second - c.wind_dot))
    print(f"transposed {good:.1e} m/s^2; printed median {np.median(bad):.1f}, up to {max(bad):.0f} m/s^2")
    assert good < 1e-6
    assert np.median(bad) > 10.0


def test_E07_calculated_wind_needs_the_rate_of_xi_and_r_bw_as_it_is() -> None:
    """(6.14) prints xi for xidot and R_BRWR^T for R_BRWR; correct W = rdot_T + R_BTI^T (xidot - S(w_T) xi - R^T R_BW V)."""
    good, no_dot, transposed, printed = 0.0, [], [], []
    for c in pairs(60, 7):
        V, be, al = c.x[0:3]
        rbw, xi, xi_dot = wa.r_bw(be, al), c.x[9:12], c.rates[9:12]

        def wind(first: Array, rot: Array) -> Array:
            return c.Rt.T @ first - c.Rt.T @ c.R.T @ rot @ [V, 0, 0] + c.v_t - c.Rt.T @ wa.skew_s(c.w_t) @ xi  # noqa: B023

        good = max(good, float(np.abs(wind(xi_dot, rbw) - c.wind).max()))
        no_dot.append(np.linalg.norm(wind(xi, rbw) - c.wind))
        transposed.append(np.linalg.norm(wind(xi_dot, rbw.T) - c.wind))
        printed.append(np.linalg.norm(wind(xi, rbw.T) - c.wind))
    print(
        f"correct {good:.1e} m/s; median error: xi for xidot {np.median(no_dot):.0f}, transposed R_BW "
        f"{np.median(transposed):.0f}, both {np.median(printed):.0f} m/s"
    )
    assert good < 1e-6
    for err in (no_dot, transposed, printed):
        assert np.median(err) > 20.0


def test_E07_formation_at_rest_still_fails() -> None:
    """(6.14) even at rest at the contact position (xidot = 0, w_T = 0) gives xi and 2 V sin(alpha) as wind."""
    xi, V, al, wind = np.array([-35.5, 0.0, 8.5]), 190.0, 0.06, np.array([7.0, -13.0, 0.0])
    ua = wa.r_bw(0.0, al) @ [V, 0, 0]
    v_t = ua + wind  # both fly level, axes parallel to NED, receiver at rest relative to the tanker
    assert np.allclose(np.zeros(3) - ua + v_t, wind, atol=1e-12)
    assert np.linalg.norm(xi - ua + v_t - wind) == pytest.approx(36.5, abs=0.01)
    assert np.linalg.norm(v_t - wa.r_bw(0.0, al).T @ [V, 0, 0] - wind) == pytest.approx(2 * V * math.sin(al), rel=1e-9)


def test_E08_first_line_is_the_rate_of_psi() -> None:
    """(2.27) prints psi = (q sin phi + r cos phi) sec theta; the left side is psidot."""
    good, bad = 0.0, []
    for c in pairs(40, 8):
        (_, q, r), (psi, th, ph) = c.x[3:6], c.x[6:9]
        right = (q * math.sin(ph) + r * math.cos(ph)) / math.cos(th)
        good = max(good, abs(right - c.rates[6]))
        bad.append(abs(right - psi))
    print(f"as psidot {good:.1e} rad/s; as psi median {np.median(bad):.2f} rad")
    assert good < 1e-8
    assert np.median(bad) > 0.1
