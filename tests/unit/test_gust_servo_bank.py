"""The bank of servo models: its kernels against textbook forms, a snapshot, and gains that follow the lift."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from flightsw.missions.gust import dynamics as g
from flightsw.missions.gust.estimate import BASIC, VERTICAL
from flightsw.missions.gust.law import AlleviationParams, GustAlleviation, alleviation_gain
from flightsw.missions.gust.model import Turbulence, linear_model, parameter_vector, published
from flightsw.missions.gust.servo_bank import kernel as bk
from flightsw.missions.gust.servo_bank import states as st
from flightsw.missions.gust.servo_bank.nav import ServoBankNav
from flightsw.missions.gust.servo_bank.params import ServoBankParams
from flightsw.missions.gust.servo_bank.scaled import scaled_model
from flightsw.missions.gust.servo_bank.vane import ANEW, LEAVE, USE, VaneJump, VaneJumpParams
from flightsw.missions.gust.servos import GustServos

P = parameter_vector(published(), Turbulence())
TRIM = np.array([0.0, 0.0, 20.0, 0.0, 100.0, 20.0, 0.0])
SIGMA = np.array([0.01, 0.009, 0.35, 0.004, 1.0, 0.2, 0.3])
DT = 0.02


def positive(r: np.random.Generator) -> np.ndarray:
    a = r.normal(size=(st.NZ, st.NZ)) * 0.02
    return a @ a.T + 1e-6 * np.eye(st.NZ)


def test_readings_one_by_one_are_the_batch_update() -> None:
    r = np.random.default_rng(1)
    z, V, u = r.normal(size=st.NZ) * 0.03, positive(r), r.normal(size=(1, 3)) * 0.05
    codes, m = np.array([6, 0, 2, 1]), 4
    y, R = r.normal(size=m) * 0.1, np.abs(r.normal(size=(1, m))) + 0.05
    a, S, C, expected = np.zeros(4), np.zeros((st.S_N, st.NZ)), np.zeros((7, st.NZ)), np.zeros(7)
    st.instruments(z, u[0], P, a, expected)
    st.instrument_slopes(z, u[0], P, a, S, C)
    H = C[codes]
    Sy = H @ V @ H.T + np.diag(R[0] ** 2)
    K, nu = V @ H.T @ np.linalg.inv(Sy), y - expected[codes]
    Z, VV, nis, ll = z[None].copy(), V[None].copy(), np.zeros(1), np.zeros(1)
    bk.correct(Z, VV, np.zeros(1, dtype=np.int64), u, P, codes, y, R, m, a, S, C, np.zeros((3, st.NZ)), nis, ll)
    assert Z[0] == pytest.approx(z + K @ nu)
    assert pytest.approx(V - K @ Sy @ K.T, abs=1e-12) == VV[0]
    assert nis[0] == pytest.approx(nu @ np.linalg.solve(Sy, nu))
    assert ll[0] == pytest.approx(-0.5 * (nis[0] + np.linalg.slogdet(2.0 * np.pi * Sy)[1]))
    got_nu, got = np.zeros(7), np.zeros((7, 7))
    bk.foresee(z, V, u[0], P, codes, y, R[0], m, a, S, C, expected, got_nu, got)
    assert got_nu[:m] == pytest.approx(nu) and pytest.approx(Sy) == got[:m, :m]


def test_mixing_keeps_the_moments_of_the_whole_bank() -> None:
    r = np.random.default_rng(2)
    Z, V, mu = r.normal(size=(3, st.NZ)), np.array([positive(r) for _ in range(3)]), np.array([0.5, 0.3, 0.2])
    T = np.array([[0.9, 0.1, 0.0], [0.05, 0.9, 0.05], [0.0, 0.1, 0.9]])
    before, after = (np.zeros(st.NZ), np.zeros((st.NZ, st.NZ))), (np.zeros(st.NZ), np.zeros((st.NZ, st.NZ)))
    bk.combine(Z, V, mu, *before)
    want = mu @ T
    bk.mix(Z, V, mu, T, Z.copy(), V.copy(), np.zeros(3))
    assert mu == pytest.approx(want)
    bk.combine(Z, V, mu, *after)
    assert after[0] == pytest.approx(before[0]) and pytest.approx(before[1]) == after[1]


def test_servo_models_are_those_of_the_flight_software() -> None:
    nav, one = ServoBankNav(), GustServos(late_steps=2)
    same = nav.models.index((40.0, 1))
    r = np.random.default_rng(3)
    for _ in range(60):
        command = r.normal(size=3) * np.array([0.1, 5.0, 0.2])
        nav.hear(command, 1, DT)
        one.send(command)
        one.step(DT)
        assert nav.now[same] == pytest.approx(one.now, abs=1e-15) and nav.mean[same] == pytest.approx(
            one.mean, abs=1e-15
        )
    nav.chosen = same
    assert np.array_equal(nav.servos.queue, one.queue) and nav.late == 2


def test_a_flight_goes_on_from_a_snapshot() -> None:
    r = np.random.default_rng(4)
    y = TRIM + r.normal(size=(120, 7)) * SIGMA
    c = r.normal(size=(120, 3)) * 0.03

    def fly(nav: ServoBankNav, lo: int, hi: int) -> bytes:
        out = b""
        for i in range(lo, hi):
            nav.hear(c[i], 1, DT)
            e = nav.step(y[i], BASIC | VERTICAL, np.zeros(3), DT)
            out += e.x.tobytes() + e.sigma.tobytes() + nav.ll.tobytes()
        return out

    first = ServoBankNav()
    fly(first, 0, 60)
    saved = copy.deepcopy(first.get_state())
    went_on, other = fly(first, 60, 120), ServoBankNav()
    other.set_state(saved)
    assert fly(other, 60, 120) == went_on


def test_a_vane_that_jumps_alone_is_left_out_and_then_believed_with_a_new_bias() -> None:
    v = VaneJump(VaneJumpParams())
    assert v.judge(4.0, 0.5, DT) == USE
    got = [v.judge(9.0, 0.5, DT) for _ in range(14)]
    assert set(got[:8]) == {LEAVE} and got.count(ANEW) == 1 and got[-1] == LEAVE
    assert v.judge(9.0, 4.0, DT) == USE  # the load jumped too: the air did it


def test_lift_of_the_linear_model_is_that_of_the_nonlinear_one() -> None:
    ac, t = published(), Turbulence()
    own, more = linear_model(ac, t), scaled_model(ac, t, 0.2)
    assert scaled_model(ac, t, 0.0).A is not None and np.array_equal(scaled_model(ac, t, 0.0).A, own.A)
    ratio = (more.A - own.A)[g.AK, g.AK]
    assert ratio == pytest.approx(-0.2 * ac.lift[1] / ac.V0_mps, rel=1e-6)
    assert more.B[g.AK] == pytest.approx(1.2 * own.B[g.AK])
    assert np.array_equal(more.A[g.Q], own.A[g.Q]) and np.array_equal(more.B[g.Q], own.B[g.Q])


def test_gains_follow_servos_and_lift_and_do_not_chatter() -> None:
    law = GustAlleviation(servos=[(40.0, 1), (80.0, 2)], lifts=(-0.1, 0.0, 0.1))
    own = law.K
    law.fit(80.0, 2, 0.09)
    assert law.lift == 0.1 and law.late == 2 and law.K.shape[1] == own.shape[1] + 2
    law.fit(80.0, 2, 0.04)
    assert law.lift == 0.1  # nearer to none, but not by enough
    law.fit(40.0, 1, 0.0)
    assert law.K is own
    wanted, _ = alleviation_gain(AlleviationParams(), linear_model(), published(), DT)
    assert np.array_equal(own, wanted)
    with pytest.raises(KeyError):
        law.fit(41.0, 1, 0.0)


@pytest.mark.parametrize(
    ("over", "what"),
    [
        ({"wn_radps": ()}, "wn_radps"), ({"wn_radps": (40.0, 20.0)}, "ascending"), ({"extra_samples": (-1,)}, "extra_samples"),
        ({"lift_designs": (0.1,)}, "lift_designs"), ({"wn_radps": tuple(range(20, 40))}, "up to 32"),
    ],
)  # fmt: skip
def test_numbers_that_make_no_bank_are_refused(over: dict, what: str) -> None:
    with pytest.raises(ValueError, match=what):
        ServoBankParams(**over)
