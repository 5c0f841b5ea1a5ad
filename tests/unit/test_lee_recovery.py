"""Loop transfer recovery, Lee (2011) (4.5): margins against responses and closed forms, covariances against a sampled filter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

from hil_scripts.campaign.study import Case
from hil_scripts.studies.lee import flight as fl
from hil_scripts.studies.lee import recovery
from hil_scripts.studies.lee.linear import Q_WIND, READ, tanker
from hil_scripts.studies.lee.recovery import FED, INPUTS, Loop, Open, initial, margins, readings


@pytest.fixture(scope="module")
def loop() -> Loop:
    return Loop(tanker())


def estimated(loop: Loop, q: float) -> tuple[Open, np.ndarray]:
    """Loop and gain for large noise and the Q_1 of the print."""
    R = readings(loop.t, fl.LARGE)[1]
    L, _ = loop.gain(initial(loop.t, fl.LARGE, False) + q * q * loop.B @ loop.B.T, R)
    return loop.estimated(L), L


def slowest(a: np.ndarray) -> float:
    return float(np.linalg.eigvals(a).real.max())


def same(a: np.ndarray, b: np.ndarray) -> None:
    """Two sets of eigenvalues."""
    a, b = (np.sort_complex(np.round(v, 9)) for v in (a, b))
    assert a == pytest.approx(b, abs=2e-5)


def test_margins_of_an_integrator_with_lag_are_the_closed_form() -> None:
    """l = 4 / (s (s + 1)^2) in one of four loops that have nothing to do with each other, 2 / s in the others."""
    A, B, K = np.zeros((6, 6)), np.zeros((6, 4)), np.zeros((4, 6))
    A[0, 1] = A[1, 2] = 1.0
    A[1, 1] = A[2, 2] = -1.0
    B[2, 0], K[0, 0] = 1.0, 0.5
    B[3:, 1:], K[1:, 3:] = np.eye(3), 2.0 * np.eye(3)
    got = margins(Open(A, B, K))
    # 0.5 / (w (1 + w^2)) = 1, and the phase is -180 deg at w = 1, where the loop is a quarter
    w = float(np.roots([1.0, 0.0, 1.0, -0.5])[-1].real)
    assert got["aileron.gain_up_db"] == pytest.approx(20.0 * np.log10(4.0), abs=2e-3)
    assert got["aileron.phase_margin_deg"] == pytest.approx(90.0 - 2.0 * np.degrees(np.arctan(w)), abs=1e-2)
    assert got["aileron.gain_down_db"] == -np.inf
    assert got["thrust.phase_margin_deg"] == pytest.approx(90.0, abs=2e-3) and got["thrust.gain_up_db"] == np.inf


def test_full_state_feedback_has_the_margins_it_must(loop: Loop) -> None:
    """Kalman's inequality: |I + L| >= 1 in units of the weights; so 60 deg, and half to infinite gain, of each input."""
    got = margins(loop.full)
    assert got["return_difference"] == pytest.approx(1.0, abs=1e-4)
    for i in INPUTS:
        assert got[f"{i}.phase_margin_deg"] > 60.0
        assert got[f"{i}.gain_up_db"] == np.inf and got[f"{i}.gain_down_db"] < -6.02


def test_loop_on_estimates_is_that_of_two_machines(loop: Loop) -> None:
    """Closed, its poles are those of law and filter; open, its response is the estimator's, built apart, on the whole plant's."""
    est, L = estimated(loop, 0.1)
    whole = np.linalg.eigvals(est.closed(np.ones(4)))
    same(whole, np.r_[np.linalg.eigvals(loop.full.closed(np.ones(4))), np.linalg.eigvals(loop.t.A - L)])
    n, t, K = len(FED), loop.t, loop.full.K
    Kx = np.zeros((4, 15))
    Kx[:, FED] = K[:, :n]
    A_c = np.block([[t.A - loop.B @ Kx - L, -loop.B @ K[:, n:]], [loop.C_e, np.zeros((3, 3))]])
    for w in (0.01, 0.3, 2.0, 30.0):
        y = np.linalg.solve(1j * w * np.eye(15) - t.A, loop.B.astype(complex))
        ask = np.hstack((Kx, K[:, n:])) @ np.linalg.solve(
            1j * w * np.eye(18) - A_c, np.vstack((L, np.zeros((3, 15)))) @ y
        )
        assert np.abs(est.response(np.array([w]))[0] - ask).max() < 1e-6 * np.abs(ask).max()


@pytest.mark.parametrize("q", [0.0, 0.1, 10.0])
def test_margins_are_where_the_response_meets_minus_one(loop: Loop, q: float) -> None:
    """Nyquist: at its margin the response of one input, the others closed, goes through -1 of its scale, at some frequency."""
    est, _ = estimated(loop, q)
    got, seen = margins(est), 0

    def one(w: np.ndarray) -> np.ndarray:
        return np.asarray(1.0 / np.linalg.inv(np.eye(4) + est.response(w))[:, range(4), range(4)] - 1.0)

    w = np.r_[1e-9, np.logspace(-5.0, 3.0, 4001)]
    coarse = one(w)

    def meets(factor: complex, i: int) -> bool:
        """About the frequency that comes nearest a closer look is taken."""
        k = int(np.abs(1.0 + factor * coarse[:, i]).argmin())
        fine = one(np.geomspace(w[max(k - 1, 0)], w[min(k + 1, len(w) - 1)], 21))
        return bool(np.abs(1.0 + factor * fine[:, i]).min() < 2e-3)

    assert slowest(est.closed(np.ones(4))) < 0.0
    for i, name in enumerate(INPUTS):
        turn = complex(np.exp(-1j * np.radians(got[f"{name}.phase_margin_deg"])))
        assert meets(turn, i) or meets(turn.conjugate(), i)
        for side in ("up", "down"):
            db = got[f"{name}.gain_{side}_db"]
            if np.isfinite(db):
                seen += 1
                assert meets(10.0 ** (db / 20.0), i)
    assert seen


def test_recovery_is_of_first_order_in_the_root(loop: Loop) -> None:
    """Response at the input against full state feedback: ten times the q, a tenth of the difference, in the end."""
    w = np.array([0.1, 1.0, 3.0])
    want = loop.full.response(w)
    off = [
        np.abs(estimated(loop, q)[0].response(w) - want).max() / np.abs(want).max() for q in (0.0, 10.0, 100.0, 1000.0)
    ]
    assert off[0] > 0.3 and off[-1] < 1e-3
    assert off[2] / off[3] == pytest.approx(10.0, rel=0.02)


def test_covariances_are_those_of_a_fast_sampled_filter(loop: Loop) -> None:
    """A filter sampled two hundred times a second, run for 100 s from a wide start: what it believes, and what its error is."""
    R, assumed = readings(loop.t, fl.SMALL)
    Q = initial(loop.t, fl.SMALL, True)
    L, P = loop.gain(Q, assumed)
    dt, wind = 5e-3, Q_WIND**2 * loop.t.G @ loop.t.G.T
    F = expm(loop.t.A * dt)
    own = np.diag(np.square(np.r_[fl.SMALL[:READ], 5.0, 5.0, 5.0]))
    true = own.copy()
    for _ in range(20000):
        own, true = F @ own @ F.T + dt * Q, F @ true @ F.T + dt * wind
        K = own @ np.linalg.inv(own + assumed / dt)
        own = own - K @ own
        J = np.eye(15) - K
        true = J @ true @ J.T + K @ R @ K.T / dt
    want = solve_continuous_lyapunov(loop.t.A - L, -(wind + L @ R @ L.T))
    assert np.sqrt(np.diag(own)) == pytest.approx(np.sqrt(np.diag(P)), rel=0.02)
    assert np.sqrt(np.diag(true)) == pytest.approx(np.sqrt(np.diag(want)), rel=0.02)
    assert np.sqrt(want[14, 14] / P[14, 14]) > 1.1  # the calculated wind has the noise of the readings once more


def test_margin_is_paid_for_in_noise() -> None:
    v = recovery.run_recovery(Case("large", {"noise": "large"}), 0).values
    least = {k: min(v[f"{k}.{i}.phase_margin_deg"] for i in INPUTS) for k in ("full", "q_0", "q_0p1", "q_1000")}
    assert least["q_0"] < 20.0 < 50.0 < least["q_0p1"] and least["q_1000"] == pytest.approx(least["full"], abs=0.5)
    assert v["q_0.return_difference"] < 0.1 and v["q_1000.return_difference"] > 0.99
    assert v["q_0.wind.error_mps"] < v["q_0p1.wind.error_mps"] < v["q_1000.wind.error_mps"]
    for i in INPUTS[:3]:
        assert v[f"q_0p1.{i}.noise_rms_deg"] > 2.0 * v[f"q_0.{i}.noise_rms_deg"]
