"""Lee 2011, Table 2.1: the six nominal conditions. Their numbers are not printed; the largest of the nominal values are, beside
Tables 2.2 and 2.3: V 190 m/s, beta 0, alpha 0.1005 rad, p, q, r 0.0041, 0.0478, 0.0406 rad/s."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from flightsw.aircraft import load_aircraft
from flightsw.sixdof.autopilot import TankerControl, TankerCtrlParams
from flightsw.sixdof.command import ScheduleParams
from flightsw.sixdof.layout import RATE, X_ALPHA, X_BETA, X_PHI, X_V
from flightsw.sixdof.trim import linearise_relative, trim_free, trim_relative
from hil_scripts.studies.lee.printed_law import ALTITUDE, N, Weights, augmented, gains

V, ALPHA, P, Q, R = 190.0, 0.1005, 0.0041, 0.0478, 0.0406
G, HALF = 9.80665, 0.5e-4  # half of the last printed digit
MASS = 119000.0  # [kg] of the tanker of the studies


def turn(speed: float, rate: float, alpha: float) -> tuple[float, float, float]:
    """|p|, |q|, |r| [rad/s] of a level coordinated turn without side force: tan(phi) = V psi'/(g cos(alpha)), tan(theta) =
    tan(alpha) cos(phi); p = psi' sin(theta), q, r = psi' cos(theta) (sin(phi), cos(phi))."""
    phi = math.atan(speed * rate / (G * math.cos(alpha)))
    theta = math.atan(math.tan(alpha) * math.cos(phi))
    return (
        rate * math.sin(theta), rate * math.cos(theta) * math.sin(phi), rate * math.cos(theta) * math.cos(phi),
    )  # fmt: skip


def nodes(q: float = Q, r: float = R) -> tuple[float, float]:
    """Turn rate [rad/s] and lower airspeed [m/s] of which q and r are the largest: q grows with airspeed, r falls with it."""
    rate = float(brentq(lambda w: turn(V, w, ALPHA)[1] - q, 0.03, 0.1))
    return rate, float(brentq(lambda v: turn(v, rate, ALPHA)[2] - r, 150.0, 200.0))


def test_printed_maxima_are_those_of_six_coordinated_turns_and_not_of_one() -> None:
    """From q and r the turn rate and the lower airspeed; p, which was not used, comes out as printed. One turn at 190 m/s with
    both q and r is none."""
    rate, low = nodes()
    ends = [nodes(Q + a, R + b) for a in (-HALF, HALF) for b in (-HALF, HALF)]
    p = max(turn(v, rate, ALPHA)[0] for v in (low, V))
    print(
        f"turn rate {math.degrees(rate):.3f} deg/s, airspeeds {low:.1f} ({min(e[1] for e in ends):.1f} to "
        f"{max(e[1] for e in ends):.1f}) and 190 m/s, p {p:.5f} rad/s"
    )
    assert abs(p - P) < HALF
    assert math.degrees(rate) == pytest.approx(3.56, abs=0.01) and low == pytest.approx(181.2, abs=0.6)
    # taken for one condition: its bank atan(q/r) turns 190 m/s at another rate than its q and r do
    single = math.hypot(Q, R) / math.cos(math.atan(math.tan(ALPHA) * math.cos(math.atan2(Q, R))))
    assert abs(turn(V, single, ALPHA)[1] - Q) > 5.0 * HALF and abs(turn(V, single, ALPHA)[2] - R) > 5.0 * HALF
    # with the 180, 200 m/s and 1.7 deg/s of this project, none of them
    ours = [turn(v, math.radians(1.7), ALPHA) for v in (180.0, 200.0)]
    assert max(o[1] for o in ours) < 0.4 * Q and max(o[2] for o in ours) < 0.7 * R


def test_trims_there_have_the_printed_rates_but_not_the_incidence() -> None:
    """q and r to 1 %; incidence, and p with it, is that of another aircraft: ours has 0.1005 rad when it weighs 94 t."""
    tanker, (rate, low) = load_aircraft("kc135r"), nodes()
    trims = [trim_free(tanker, MASS, ALTITUDE, v, yd) for yd in (-rate, 0.0, rate) for v in (low, V)]
    for t in trims:  # the solver's turns are those of the formula, but for the rudder's side force
        yd = math.copysign(rate, t.x[X_PHI]) if abs(t.x[X_PHI]) > 1e-6 else 0.0
        want = np.array(turn(float(t.x[X_V]), abs(yd), float(t.x[X_ALPHA])))
        assert np.abs(np.abs(t.x[RATE]) - want).max() < 1e-4
    most = np.abs([t.x for t in trims]).max(axis=0)
    p, q, r = most[RATE]
    light = float(brentq(lambda m: trim_free(tanker, m, ALTITUDE, low, rate).x[X_ALPHA] - ALPHA, 8e4, MASS))
    print(
        f"V {most[X_V]:.0f}, alpha {most[X_ALPHA]:.4f}, p {p:.4f}, q {q:.4f}, r {r:.4f}; mass for 0.1005 {light:.0f} kg"
    )
    assert most[X_V] == V and most[X_BETA] < 1e-12
    assert q == pytest.approx(Q, rel=0.01) and r == pytest.approx(R, rel=0.01)
    assert most[X_ALPHA] > 1.3 * ALPHA and p > 1.3 * P
    assert 90e3 < light < 100e3


def test_gains_exist_at_all_six() -> None:
    """The tanker's onboard design, and the receiver's by the printed rule (2.45), (2.46): every closed loop decays."""
    tanker, receiver, (rate, low) = load_aircraft("kc135r"), load_aircraft("learjet24"), nodes()
    turns = (-math.degrees(rate), 0.0, math.degrees(rate))
    law = TankerControl(
        tanker, TankerCtrlParams(ScheduleParams(turns, (low, V), mass_kg=MASS), w_input=(0.1, 0.1, 0.1, 2.0e4)), 0.05
    )
    radius = [law._design(tanker, yd, v, 0.05).radius for yd in law.nodes for v in (low, V)]
    slowest = []
    for yd in law.nodes:
        for v in (low, V):
            tt = trim_free(tanker, MASS, ALTITUDE, v, yd)
            t = trim_relative(receiver, 5300.0, tt, np.array([-35.5, 0.0, 8.5]))
            A, B, _ = linearise_relative(receiver, 5300.0, tt, t)
            K = gains(A[:N, :N], B[:N], Weights())
            Aa, Ba = augmented(A[:N, :N], B[:N])
            assert np.linalg.eigvals(Aa).real.max() > -1e-6  # without feedback it does not
            slowest.append(float(np.linalg.eigvals(Aa - Ba @ K).real.max()))
    print(f"tanker: spectral radius {max(radius):.5f}; receiver: slowest {max(slowest):.3f} 1/s")
    assert max(radius) < 1.0
    assert max(slowest) < -0.1
