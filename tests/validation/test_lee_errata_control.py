"""Lee 2011, controller and sample rate: errata E12 and E24 of lee.md section 4."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.sixdof.schedule import weights
from flightsw.sixdof.trim import linearise_free, linearise_relative, trim_free, trim_relative

YD = np.radians([-1.7, 0.0, 1.7])
VN = np.array([180.0, 200.0])
Array = np.ndarray


def printed(y: object, v: object, yd: object, vn: object, *, fixed: tuple[str, ...] = ()) -> list[object]:
    """The six fractions of (2.40) = (2.47) in the order u1..u6, as printed but for the terms named in `fixed`."""
    (y1, y2, y3), (V1, V2) = yd, vn  # type: ignore[misc]
    u1 = (y - y2) * (y - y3) * (v - V2) / ((y1 - y2) * (y1 - y3) * (V1 - V2))
    u2 = (y - y2) * (y - y3) * (v - V1) / ((y1 - y2) * (y1 - y3) * (V2 - V1))
    u4 = (y - y1) * (y - y3) * (v - V1) / ((y2 - y1) * (y2 - y3) * (V2 - V1))
    u6 = (y - y1) * (y - y2) * (v - V1) / ((y3 - y1) * (y3 - y2) * (V2 - V1))
    if "u3" in fixed:
        u3 = (y - y1) * (y - y3) * (v - V2) / ((y2 - y1) * (y2 - y3) * (V1 - V2))
    else:
        u3 = (y - y1) * (y - y3) * (v - V2) / ((y2 - y1) * (y - y2) * (v - V2))
    if "u5" in fixed:
        u5 = (y - y1) * (y - y2) * (v - V2) / ((y3 - y1) * (y3 - y2) * (V1 - V2))
    else:
        u5 = (y - y1) * (y - y3) * (V1 - V2) / ((y3 - y1) * (y3 - y2) * (V1 - V2))
    return [u1, u2, u3, u4, u5, u6]


def test_E12_weights_of_the_third_and_fifth_nominal() -> None:
    """(2.40), (2.47): u3 denominator must be (y2-y1)(y2-y3)(V1-V2); u5 numerator (yc-y1)(yc-y2)(Vc-V2)."""
    import sympy as sp  # slow to import: only where it is needed

    y, v = sp.symbols("y v")
    yd, vn = sp.symbols("y1:4"), sp.symbols("V1:3")

    def short_of_one(fixed: tuple[str, ...]) -> object:
        """Numerator, multiplied out, of the sum less one: 0 for an identity, and for nothing else."""
        return sp.expand(sp.fraction(sp.together(sum(printed(y, v, yd, vn, fixed=fixed)) - 1))[0])  # type: ignore[arg-type]

    assert short_of_one(("u3", "u5")) == 0
    for left in (("u3",), ("u5",), ()):
        assert short_of_one(left) != 0
    # cardinal at the nodes, and equal to the flight code inside the range
    rng, own, worst, off = np.random.default_rng(12), np.zeros(6), 0.0, []
    for i, yi in enumerate(YD):
        for j, vj in enumerate(VN):
            got = np.array(printed(yi, vj, YD, VN, fixed=("u3", "u5")), float)
            assert np.abs(got - np.eye(6)[2 * i + j]).max() < 1e-14
    for _ in range(200):
        yc, vc = rng.uniform(YD[0], YD[2]), rng.uniform(*VN)
        weights(yc, vc, YD, VN, own)
        good = np.array(printed(yc, vc, YD, VN, fixed=("u3", "u5")), float)
        worst = max(worst, float(np.abs(good - own).max()))
        off.append(abs(sum(printed(yc, vc, YD, VN)) - 1.0))  # type: ignore[arg-type]
    level = printed(1e-6, 185.0, YD, VN)  # nearly straight flight: u3's printed denominator vanishes at the node
    print(
        f"corrected against the flight code {worst:.1e}; printed sum of weights off by median {np.median(off):.2f}, "
        f"up to {max(off):.1f}; u3 in nearly straight flight {level[2]:.0f}"
    )
    assert worst < 1e-14
    assert np.median(off) > 0.3
    assert abs(level[2]) > 1e4  # type: ignore[arg-type]
    # u5 at its neighbour's node (yd2, V1), where it must vanish
    assert printed(YD[1] + 1e-12, VN[0], YD, VN)[4] == pytest.approx(-0.5, abs=1e-6)


def fastest(A: Array) -> tuple[float, float]:
    """Largest modulus of the real eigenvalues and of all eigenvalues of A [1/s]."""
    e = np.linalg.eigvals(A)
    real = np.abs(e[np.abs(e.imag) < 1e-9])
    return float(real.max()), float(np.abs(e).max())


def test_E24_the_sample_rate_rule_covers_the_tanker_only() -> None:
    """(3.4) with 1.1525 gives T <= 0.087 s; the Learjet's short period, light-weight roll and servos ask for less."""
    assert abs(0.1 / 1.1525 - 0.0868) < 5e-5
    tan, rec = load_aircraft("kc135r"), load_aircraft("learjet24")
    trim = trim_free(tan, 120e3, 7010.0, 190.0, 0.0)
    real_t, all_t = fastest(linearise_free(tan, 120e3, trim)[0][:9, :9])
    e = np.linalg.eigvals(linearise_free(tan, 120e3, trim)[0][:9, :9])
    slowest = np.abs(e[e.real < -1e-3][np.argmax(e.real[e.real < -1e-3])])
    assert 0.1 / slowest > 1.0  # "with the largest real part" taken literally is the phugoid: no rule at all
    found = {}
    for mass in (4082.0, 4989.5):
        t = trim_relative(rec, mass, trim, np.array([-35.5, 0.0, 8.5]))
        found[mass] = fastest(linearise_relative(rec, mass, trim, t)[0][:12, :12])
    servo = rec.controls.servo_wn_radps
    print(
        f"tanker real {real_t:.2f}, all {all_t:.2f}; Learjet 4082 kg {found[4082.0][0]:.2f}, "
        f"{found[4082.0][1]:.2f}; 4990 kg {found[4989.5][0]:.2f}, {found[4989.5][1]:.2f}; servo {servo:.0f} 1/s"
    )
    assert real_t == pytest.approx(1.1525, rel=0.2)  # our tanker's roll mode: 0.099 s by the rule
    assert 0.1 / real_t > 0.087
    assert 0.1 / all_t < 0.087  # with the short-period pair counted, 0.070 s: the rule reads real eigenvalues only
    assert 0.1 / found[4989.5][1] < 0.03  # short period: the source's own 0.05 s breaks the rule
    assert 0.1 / found[4082.0][0] < 0.03  # roll, tip tanks empty
    assert 0.1 / servo == pytest.approx(0.005)
    # what 0.05 s really costs: one Runge-Kutta step against the exponential, servo left out as a known input
    z = -0.05 * found[4989.5][1]
    assert abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24 - math.exp(z)) < 1e-5
    z = -0.05 * servo  # the servo by the same step: off by 2 % of the step, 0.087 s by 16 %
    assert abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24 - math.exp(z)) / math.exp(z) == pytest.approx(0.0194, abs=1e-3)
    z = -0.087 * servo
    assert abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24 - math.exp(z)) / math.exp(z) > 0.15
