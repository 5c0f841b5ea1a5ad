"""The receiver half of Lee (2011) as printed: its law and its filter against closed forms and independent derivations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag, expm, solve_continuous_are, solve_continuous_lyapunov

from flightsw.aircraft import load_aircraft
from flightsw.sixdof.layout import POS
from flightsw.sixdof.lqr import augment
from flightsw.sixdof.trim import linearise_relative, tanker_stage, trim_free, trim_relative
from hil_scripts.campaign.study import Case
from hil_scripts.studies.lee import printed
from hil_scripts.studies.lee.printed_filter import (
    Model,
    PrintedEstimator,
    Tune,
    free_wind,
    relative_wind,
    spread,
)
from hil_scripts.studies.lee.printed_law import ALTITUDE, SPEEDS, TURNS, N, PrintedLaw, Weights, augmented, gains
from tests.validation import wind_axis as wa

MASSES, XI = (5300.0, 119000.0), (-35.5, 0.0, 8.5)
DT = 0.05


@pytest.fixture(scope="module")
def linear() -> tuple[np.ndarray, np.ndarray]:
    """A [12,12], B [12,4] of (2.41) at 180 m/s in the left turn."""
    ac, tanker = load_aircraft("learjet24"), load_aircraft("kc135r")
    tt = trim_free(tanker, MASSES[1], ALTITUDE, SPEEDS[0], TURNS[0])
    A, B, _ = linearise_relative(ac, MASSES[0], tt, trim_relative(ac, MASSES[0], tt, np.array(XI)))
    return A[:N, :N], B[:N]


@pytest.fixture(scope="module")
def law() -> PrintedLaw:
    return PrintedLaw(load_aircraft("learjet24"), load_aircraft("kc135r"), MASSES, XI, Weights())


def test_linear_model_is_that_of_the_matrix_equations(linear: tuple[np.ndarray, np.ndarray]) -> None:
    """(2.41) by differencing lee.md 3.2 in matrices, which shares nothing with the onboard kernels."""
    ac, tanker = load_aircraft("learjet24"), load_aircraft("kc135r")
    tt = trim_free(tanker, MASSES[1], ALTITUDE, SPEEDS[0], TURNS[0])
    t, tk, b = trim_relative(ac, MASSES[0], tt, np.array(XI)), tanker_stage(tt.x), wa.body(ac, MASSES[0])
    none, rho = np.zeros(3), wa.density(ALTITUDE)

    def rates(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return wa.relative(b, x, u, rho, none, none, tk[:9].reshape(3, 3), tk[9:12], none, tk[15:18])

    x, u = t.x[:N], t.u
    hx, hu = np.full(N, 1e-4), np.array([1e-4, 1e-4, 1e-4, 10.0])
    A = np.array([(rates(x + e, u) - rates(x - e, u)) / (2 * h) for e, h in zip(np.diag(hx), hx, strict=True)]).T
    B = np.array([(rates(x, u + e) - rates(x, u - e)) / (2 * h) for e, h in zip(np.diag(hu), hu, strict=True)]).T
    for mine, theirs in zip(linear, (A, B), strict=True):
        assert np.abs(mine - theirs).max() < 1e-4 * np.abs(theirs).max()
        assert np.abs(mine - theirs)[np.abs(theirs) > 1e-6].size
    assert np.abs(rates(x, u)).max() < 1e-4  # and the nominal condition is one


def test_gains_of_single_integrators_are_the_closed_form() -> None:
    """x' = u, e' = x: k = sqrt(q + 2 sqrt(q_e)), k_e = sqrt(q_e) in units of the input; x' = -a x + u: k = -a + sqrt(a^2 + q)."""
    A, B = -2.0 * np.eye(N), np.zeros((N, 4))
    A[POS, POS] = 0.0
    B[POS, :3], B[0, 3] = np.eye(3), 1.0
    w = Weights(states=(0.5, *[1.0] * 8, 2.0, 2.0, 0.5), integrals=(4.0, 10.0, 1.0), inputs=(0.1, 1.0, 3.0, 5.0))
    K = gains(A, B, w)
    for i in range(3):
        q, qe = (w.inputs[i] / w.states[9 + i]) ** 2, (w.inputs[i] / w.integrals[i]) ** 2
        assert K[i, 9 + i] == pytest.approx(np.sqrt(q + 2.0 * np.sqrt(qe)))
        assert K[i, N + i] == pytest.approx(np.sqrt(qe))
    assert K[3, 0] == pytest.approx(-2.0 + np.sqrt(4.0 + (5.0 / 0.5) ** 2))
    K[[0, 1, 2, 0, 1, 2, 3], [9, 10, 11, 12, 13, 14, 0]] = 0.0
    assert np.abs(K).max() < 1e-9


def test_gains_cost_least(linear: tuple[np.ndarray, np.ndarray]) -> None:
    """The cost trace P of A'P + PA + Q + K'RK = 0 is that of scipy's Riccati solution, and any other gain costs more."""
    w = Weights()
    K = gains(*linear, w)
    A, B = augmented(*linear)
    assert np.array_equal(A[N:], np.hstack((np.zeros((3, 9)), np.eye(3), np.zeros((3, 3))))) and not B[N:].any()
    Q, R = np.diag(1.0 / np.square([*w.states, *w.integrals])), np.diag(1.0 / np.square(w.inputs))

    def cost(k: np.ndarray) -> float:
        Ac = A - B @ k
        assert np.linalg.eigvals(Ac).real.max() < 0.0
        return float(np.trace(solve_continuous_lyapunov(Ac.T, -(Q + k.T @ R @ k))))

    least = cost(K)
    s = np.array(w.inputs)
    assert least == pytest.approx(np.trace(solve_continuous_are(A, B * s, Q, np.eye(4))), rel=1e-6)
    rng = np.random.default_rng(3)
    for _ in range(5):
        assert cost(K * (1.0 + 0.05 * rng.standard_normal(K.shape))) > least


def test_law_at_a_node_is_the_printed_sum(law: PrintedLaw) -> None:
    """(2.46): u0 at the nominal state; u0 - K dx - K_e e off it; between speeds the mean (2.47)."""
    s, xi = law.sched, np.array(XI)
    law.z[:] = 0.0
    for i, (yd, V) in enumerate((yd, V) for yd in TURNS for V in SPEEDS):
        assert law.step(s.z0[i, :N], xi, yd, V, DT) == pytest.approx(s.u0[i], rel=1e-9, abs=1e-9)
    dx = np.arange(1.0, 13.0) * 1e-3
    want = s.u0[3] - s.K[3, :, :N] @ dx - s.K[3, :, N:] @ (dx[POS] * DT)
    assert law.step(s.z0[3, :N] + dx, xi, 0.0, SPEEDS[1], DT) == pytest.approx(want)
    law.z[:] = 0.0
    x = s.z0[2, :N]
    mean = 0.5 * (s.u0[2] + s.u0[3] - s.K[3, :, :N] @ (x - s.z0[3, :N]))
    assert law.step(x, xi, 0.0, 190.0, DT) == pytest.approx(mean)


def formation(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Readings y_t, y_r [15] of two aircraft by vectors of inertial space, and the wind [3] on the receiver."""
    wind, e_t, w_t = rng.uniform(-15, 15, 3), rng.uniform(-0.5, 0.5, 3), rng.uniform(-0.1, 0.1, 3)
    air, e, v_t = np.array([185.0, *rng.uniform(-0.1, 0.1, 2)]), rng.uniform(-0.3, 0.3, 3), rng.uniform(-150, 150, 3)
    xi, R_t = rng.uniform(-60, 60, 3), wa.r_bi(*e_t)
    v_r = (wa.r_bi(*e) @ R_t).T @ wa.r_bw(air[1], air[2]) @ [air[0], 0.0, 0.0] + wind
    rate = R_t @ (v_r - v_t) - np.cross(w_t, xi)  # d/dt of R_t (p_r - p_t)
    own = np.array([190.0, 0.01, 0.05, *w_t, *e_t, 0.0, 0.0, -7000.0, *v_t])
    return own, np.array([*air, *rng.uniform(-0.1, 0.1, 3), *e, *xi, *rate]), wind


def test_calculated_winds_of_perfect_readings() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        y_t, y_r, wind = formation(rng)
        assert relative_wind(y_r[:N], y_r[N:], y_t[:N], y_t[N:]) == pytest.approx(wind, abs=1e-9)
        u = wa.r_bi(*y_t[6:9]).T @ wa.r_bw(y_t[1], y_t[2]) @ [y_t[0], 0.0, 0.0]
        assert free_wind(y_t[:N], u + wind) == pytest.approx(wind, abs=1e-9)


def test_variance_of_the_calculated_wind_is_that_of_its_history() -> None:
    """Against 4000 draws: the standard deviation of one scatters by 1.1 %."""
    rng = np.random.default_rng(2)
    y_t, y_r, _ = formation(rng)
    s = np.tile([0.2, 0.0035, 0.0044, *[0.0131] * 3, *[0.0035] * 3, *[0.5] * 3, *[0.1] * 3], 2)

    def wind(z: np.ndarray) -> np.ndarray:
        return relative_wind(z[15:27], z[27:], z[:N], z[N:15])

    z = np.concatenate((y_t, y_r))
    drawn = np.array([wind(z + s * rng.standard_normal(30)) for _ in range(4000)])
    assert spread(wind, z, s) == pytest.approx(drawn.std(axis=0), rel=0.06)


def linear_filter(
    x: np.ndarray, P: np.ndarray, F: np.ndarray, Q: np.ndarray, H: np.ndarray, R: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One step of (3.1)-(3.3)."""
    x, P = F @ x, F @ P @ F.T + Q
    S = H @ P @ H.T + R
    K = np.linalg.solve(S, H @ P).T
    return x + K @ (y - H @ x), P - K @ S @ K.T


@pytest.mark.parametrize("tau", [0.0, 1.0])
def test_filter_of_a_linear_model_is_the_linear_filter(tau: float) -> None:
    """(4.8), (6.15) white; (4.13), (6.19) coloured: h = f - A_v x and noise G_v W_v, of x' = A x."""
    rng = np.random.default_rng(5)
    D = -0.2 * np.eye(15) + 0.05 * rng.standard_normal((15, 15))
    D[N:] = 0.0  # wind walks
    F = np.eye(15) + DT * D

    def carry(X: np.ndarray, dt: float) -> None:
        X[:] = X @ F.T

    m = Model(carry, lambda x: D @ x)
    s, ws, tune = rng.uniform(0.2, 1.0, N), rng.uniform(0.3, 0.6, 3), Tune(window=1, start_mps=3.0)
    est = PrintedEstimator(s, ws, tune, tau, False)
    x, last = rng.standard_normal(15), rng.standard_normal(N)
    x[:N] = last
    est.start(last, x[N:])
    P, Q = np.diag(np.square([*s, *[3.0] * 3])), np.diag(tune.root() ** 2 * DT)
    e = np.exp(-DT / tau) if tau else 0.0
    if tau:
        H, R = D[:N] + np.eye(15)[:N] / tau, np.diag(s**2 * (1.0 - e * e) / DT**2)
    else:
        H, R = np.eye(15), block_diag(np.diag(s**2), np.diag(ws**2))
    for _ in range(4):
        y, wind = rng.standard_normal(N), rng.standard_normal(3)
        read = (y - last) / DT + y / tau if tau else np.concatenate((y, wind))
        x, P = linear_filter(x, P, F, Q, H, R, read)
        last = y
        assert est.step(m, y, wind, DT) == pytest.approx(x, abs=1e-8)
        assert est.sigmas == pytest.approx(np.sqrt(np.diag(P)), rel=1e-8)


def test_moving_mean_is_causal_and_of_the_window() -> None:
    """(4.7): with readings of the states worth nothing, the wind goes by the mean of the last three."""
    m = Model(lambda X, dt: None, lambda x: np.zeros(15))
    est = PrintedEstimator(np.full(N, 1e3), np.full(3, 1e-3), Tune(q_wind=100.0, window=3), 0.0, False)
    est.start(np.zeros(N), np.zeros(3))
    given = [np.array([1.0, 2.0, 3.0]) * k for k in (1.0, 5.0, 6.0, 10.0)]
    for k, w in enumerate(given):
        got = est.step(m, np.zeros(N), w, DT)[N:]
        assert got == pytest.approx(np.mean(given[max(0, k - 2) : k + 1], axis=0), rel=1e-3)


def test_fast_gains_lose_the_receiver_to_servos_and_sampling(linear: tuple[np.ndarray, np.ndarray]) -> None:
    """The law on its own model is stable at any softness; with servos, engine and twenty samples a second not below about two."""
    ac = load_aircraft("learjet24")
    C = np.zeros((3, N))
    C[:, POS] = np.eye(3)
    A, B = augment(*linear, C, np.zeros((3, 4)), ac)
    n = A.shape[0]
    held = expm(DT * np.block([[A, B], [np.zeros((4, n + 4))]]))  # zero-order hold
    radius = {}
    for soft in (1.0, printed.SOFT):
        K = gains(*linear, Weights().softer(soft))
        Aa, Ba = augmented(*linear)
        assert np.linalg.eigvals(Aa - Ba @ K).real.max() < 0.0
        whole = np.zeros((4, n))
        whole[:, :N], whole[:, -3:] = K[:, :N], K[:, N:]
        radius[soft] = np.abs(np.linalg.eigvals(held[:n, :n] - held[:n, n:] @ whole)).max()
    assert radius[1.0] > 1.05 and radius[printed.SOFT] < 1.0


def test_printed_receiver_holds_contact() -> None:
    p = {"controllers": ["true", "estimated"], "duration_s": 40.0}
    v = printed.run_case(Case("short", p), 3).values
    for kind in ("true", "estimated"):
        assert v[f"{kind}.lost"] == 0.0
        assert max(v[f"{kind}.contact.max_m.{a}"] for a in "xyz") < 4.0
    assert max(v[f"estimated.estimate.rms_m.{a}"] for a in "xyz") < 0.5  # of readings with 0.5 m each
    assert v["estimated.contact.max_m.x"] + v["estimated.contact.max_m.y"] > 1.0  # and it is the soft law that flies
