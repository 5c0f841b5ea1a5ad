"""Gyro against attitude reference against moments: who is left out, in motions made by scipy's integrator and rotations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import ode
from scipy.spatial.transform import Rotation

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.kernels.atmosphere import density
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.forces import moment_rates
from flightsw.sixdof.looks import KEPT, Looks
from flightsw.sixdof.moments import JUMP, LASTING, Moments
from flightsw.sixdof.params import parameter_vector
from flightsw.sixdof.turning import make_turning
from flightsw.types import HF_ATT, HF_IMU, UPD_ATT, UPD_IMU, Health, NavState, SensorFrame

DT, V, RHO = 0.05, 195.0, 0.59
SIGMA_W, SIGMA_A = 0.0131, 0.0035  # of a gyro reading at 100 Hz, of an attitude
Arr = np.ndarray


@pytest.fixture(scope="module")
def ac() -> Aircraft:
    return load_aircraft("learjet24")


FLOWN: dict[tuple[str, int, float], tuple[Arr, Arr, Arr]] = {}  # the longest flight of each aircraft, seed and size


def flown(ac: Aircraft, seconds: float, seed: int, size: float = 1.0) -> tuple[Arr, Arr, Arr]:
    """Rates [k, 3], attitudes body to navigation (Rotation's quaternions [k, 4], scalar last) and controls [k, 4] of an aircraft
    whose elevator and aileron move to and fro, incidence and sideslip held: the moments are the model's, and a tenth more."""
    n, key = round(seconds / DT), (ac.meta.name, seed, size)
    if key not in FLOWN or len(FLOWN[key][0]) < n:
        FLOWN[key] = fly(ac, n, seed, size)
    w, q, u = FLOWN[key]
    return w[:n], q[:n], u[:n]


def fly(ac: Aircraft, n: int, seed: int, size: float) -> tuple[Arr, Arr, Arr]:
    """`flown`, n steps of it; a shorter flight is the beginning of a longer one."""
    P, fm = parameter_vector(ac, ac.mass.empty_kg + ac.mass.default_fuel_kg), np.zeros(9)
    rng = np.random.default_rng(seed)
    u = np.zeros((n, 4))
    phase = rng.uniform(0.0, 6.28, 3)
    t = np.arange(n) * DT
    for j, (most, period) in enumerate(((0.004, 1.7), (0.01, 2.3), (0.002, 4.0))):
        u[:, j] = size * most * np.sin(2.0 * np.pi * t / period + phase[j])
    a, b, c = moment_rates(V, 0.0, 0.01, np.zeros(3), np.zeros(4), RHO, P, fm)

    def rates(_t: float, x: Arr, u: Arr) -> tuple[float, float, float]:
        p, q, r = moment_rates(V, 0.0, 0.01, x, u, RHO, P, fm)
        return 1.1 * (p - a), 1.1 * (q - b), 1.1 * (r - c)

    w, solver = np.zeros((n, 3)), ode(rates).set_integrator("dopri5", rtol=1e-8, atol=1e-6)
    for k in range(n - 1):
        w[k + 1] = solver.set_initial_value(w[k], 0.0).set_f_params(u[k]).integrate(DT)
    R = Rotation.from_rotvec(np.vstack((np.zeros(3), 0.5 * (w[:-1] + w[1:]) * DT)))
    done = 1  # turns joined in each: one after the other, twice as many every time
    while done < n:
        R = Rotation.concatenate((R[:done], R[:-done] * R[done:]))
        done *= 2
    return w, R.as_quat(), u


Wrong = Callable[[float, Arr, Arr], tuple[Arr, Arr]]


def watched(
    ac: Aircraft, seconds: float, seed: int, wrong: Wrong, gap: str = "", stuck_s: float = 1e9, size: float = 1.0
) -> list[tuple[float, int]]:
    """(t, who is left out) at every change; wrong(t, mean rate, attitude quaternion): what is read of them without noise. gap:
    what there is not from 10 to 12.5 s: an "estimate" or "steps"; stuck_s: from when the reference repeats itself, which is found
    out half a second later."""
    w, q, u = flown(ac, seconds, seed, size)
    rng = np.random.default_rng(seed + 1)
    turning = make_turning(ac, NavParams())
    assert turning is not None
    nav, out = NavState(valid=True, V=V, alpha=0.01, pos_n=(0.0, 0.0, -7010.0)), [(0.0, 0)]
    noise = rng.standard_normal((len(w) - 1, 6))
    read = [wrong(k * DT, 0.5 * (w[k - 1] + w[k]), q[k]) for k in range(1, len(w))]
    rates = np.array([r for r, _ in read]) + SIGMA_W / np.sqrt(5.0) * noise[:, 3:]
    atts = (Rotation.from_quat([a for _, a in read]) * Rotation.from_rotvec(SIGMA_A * noise[:, :3])).as_quat()
    stuck = q[0]
    for k, (rate, att) in enumerate(zip(rates, atts, strict=True), 1):
        t = k * DT
        t_us = round(t * 1e6)
        absent = bool(gap) and 10.0 <= t < 12.5
        if absent and gap == "steps":
            continue
        nav.valid = not absent
        stuck, failed = (att, 0) if t < stuck_s else (stuck, HF_ATT if t > stuck_s + 0.5 else 0)
        x, y, z, s = stuck.tolist()
        f = SensorFrame(t_us=t_us, att_t_us=t_us, att_q_nb=(s, x, y, z), gyro_mean_b=tuple(rate.tolist()), gyro_count=5)
        updated, health = turning.step(f, u[k - 1], nav, UPD_ATT | UPD_IMU, Health(failed=failed), DT)
        assert updated == (UPD_ATT | UPD_IMU) & ~{0: 0, HF_IMU: UPD_IMU, HF_ATT: UPD_ATT}[turning.out]
        assert health.failed == turning.out | failed
        if turning.out != out[-1][1]:
            out.append((t, turning.out))
    return out


def test_the_turn_that_moments_make_is_euler_step_by_step(ac: Aircraft) -> None:
    """To the bit, with a ring that has gone round."""
    rng, moments = np.random.default_rng(3), Moments(ac, SIGMA_W)
    lasting = moments.m[LASTING:JUMP] = 0.01, -0.02, 0.005
    looks, given, still = Looks((0.3, 1.0), 6.0, SIGMA_A, SIGMA_W, moments), [], (1.0, 0.0, 0.0, 0.0)
    looks.known = True
    for _ in range(KEPT + 40):
        u, turned, flow, h = rng.normal(0.0, 0.02, 4), rng.normal(0.0, 0.01, 3), rng.normal(0.0, 0.03, 2), 7010.0
        dt, speed = rng.uniform(0.04, 0.06), rng.uniform(180.0, 200.0)
        flown = (speed, *flow.tolist())
        looks.take((0.0, 0.0, 0.0), dt, still, 0.0, tuple(turned.tolist()), dt, flown, h, u, 5)
        given.append((dt, *flown, u))
    for began in (KEPT - 2, KEPT - 30, 5):
        w, turn = np.array([0.02, -0.01, 0.03]), np.zeros(3)
        for dt, speed, beta, alpha, u in given[began + 1 - KEPT :]:
            rates = moment_rates(speed, beta, alpha, w, u, density(h), moments.P, np.zeros(9))
            w = w + (np.array(rates) + lasting) * dt
            turn = turn + w * dt
        assert looks.turned(began, (0.02, -0.01, 0.03)) == tuple(turn.tolist())


def frozen(which: int, at: float, until: float = 1e9) -> Wrong:
    kept: list[Arr] = []

    def wrong(t: float, rate: Arr, att: Arr) -> tuple[Arr, Arr]:
        if not at <= t < until:
            return rate, att
        kept[:] = kept or [rate, att]
        return (kept[0], att) if which == HF_IMU else (rate, kept[1])

    return wrong


@pytest.mark.parametrize("seed", range(3))
def test_nobody_is_left_out_of_a_sound_flight(ac: Aircraft, seed: int) -> None:
    assert watched(ac, 120.0, seed, lambda t, rate, att: (rate, att)) == [(0.0, 0)]


@pytest.mark.parametrize("gap", ["estimate", "steps"])
def test_a_turn_that_nobody_watched_accuses_nobody(ac: Aircraft, gap: str) -> None:
    assert watched(ac, 20.0, 3, lambda t, rate, att: (rate, att), gap) == [(0.0, 0)]


@pytest.mark.parametrize("which", [HF_IMU, HF_ATT])
@pytest.mark.parametrize("seed", range(4))
def test_who_stands_still_is_left_out_and_taken_again(ac: Aircraft, seed: int, which: int) -> None:
    [_, (t, who), (back, nobody), *more] = watched(ac, 40.0, seed, frozen(which, 20.0, 25.0))
    assert who == which and 20.0 < t < 22.0
    assert nobody == 0 and 29.0 < back < 35.0 and not more


@pytest.mark.parametrize("axis", range(3))
def test_a_gyro_that_jumps_is_not_taken_for_a_turn(ac: Aircraft, axis: int) -> None:
    off = 0.1 * np.eye(3)[axis]
    [_, (t, who), *_] = watched(ac, 24.0, 5, lambda t, rate, att: (rate + off * (t >= 20.0), att))
    assert who == HF_IMU and 20.0 < t < 21.0


def test_a_reference_that_jumps_is(ac: Aircraft) -> None:
    off = Rotation.from_rotvec([0.0, 0.1, 0.0])

    def wrong(t: float, rate: Arr, att: Arr) -> tuple[Arr, Arr]:
        return rate, (Rotation.from_quat(att) * off).as_quat() if t >= 20.0 else att

    [_, (t, who), *_] = watched(ac, 24.0, 6, wrong)
    assert who == HF_ATT and 20.0 < t < 20.5


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("walk", [0.002, 0.005, 0.02])
def test_a_gyro_that_walks_off_never_puts_the_reference_out(ac: Aircraft, axis: int, walk: float) -> None:
    off = walk * np.eye(3)[axis]
    found = watched(ac, 40.0, 7, lambda t, rate, att: (rate + off * max(t - 20.0, 0.0), att))
    assert all(who != HF_ATT for _, who in found)


@pytest.mark.parametrize("size", [1.0, 4.0])
@pytest.mark.parametrize("axis", range(3))
def test_a_gyro_that_jumps_to_and_fro_is_left_out_within_a_quarter_of_a_second(
    ac: Aircraft, axis: int, size: float
) -> None:
    """And taken again when the motion has told that it does not come late."""
    rng = np.random.default_rng(axis)
    off = 0.3 / np.sqrt(5.0) * np.eye(3)[axis]
    [_, (t, who), *more] = watched(
        ac, 40.0, 8, lambda t, rate, att: (rate + off * rng.standard_normal() * (20.0 <= t < 25.0), att), size=size
    )
    assert who == HF_IMU and 20.0 < t < 20.5
    assert [who for _, who in more] == [0]


def test_jumps_of_twice_what_counts_do_not_become_the_rule() -> None:
    """Three of four steps beyond the limit come by chance, and the limit has to stay where it is until then."""
    tanker = load_aircraft("kc135r")
    for seed in range(12):
        rng = np.random.default_rng(seed)

        def wrong(t: float, rate: Arr, att: Arr, rng: np.random.Generator = rng) -> tuple[Arr, Arr]:
            return rate + rng.uniform(-0.3, 0.3, 5).mean() * np.eye(3)[0] * (t >= 20.0), att

        found = watched(tanker, 26.0, 40 + seed, wrong, size=0.3)
        assert [who for _, who in found] == [0, HF_IMU] and found[1][0] < 25.0, (seed, found)


@pytest.mark.parametrize("size", [0.3, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_gyro_that_jumped_and_comes_late_is_not_taken_again(ac: Aircraft, seed: int, size: float) -> None:
    """Late by 0.1 s from the jumps on: in motions this small both agree about the turn."""
    rng, before = np.random.default_rng(seed), [np.zeros(3), np.zeros(3)]

    def wrong(t: float, rate: Arr, att: Arr) -> tuple[Arr, Arr]:
        before.append(rate)
        jumps = 0.3 / np.sqrt(5.0) * np.eye(3)[1] * rng.standard_normal() * (20.0 <= t < 22.0)
        return (before[-3] if t >= 20.0 else rate) + jumps, att

    found = watched(ac, 60.0, 20 + seed, wrong, size=size)
    assert [who for _, who in found] == [0, HF_IMU]


@pytest.mark.parametrize("seed", range(4))
def test_a_reference_that_repeats_itself_accuses_nobody(ac: Aircraft, seed: int) -> None:
    assert watched(ac, 30.0, seed, lambda t, rate, att: (rate, att), stuck_s=20.0) == [(0.0, 0)]


def test_who_was_accused_by_one_that_fails_is_taken_again(ac: Aircraft) -> None:
    """A reference that jumps to and fro slowly, of which the moments know nothing, until it is found to be wrong itself."""
    turning = make_turning(ac, NavParams())
    assert turning is not None
    turning._leave_out(HF_IMU, (0.01, 0.0, 0.0), 1.0, "not by moments")
    turning._by = HF_ATT
    f = SensorFrame(t_us=50_000, att_t_us=50_000, gyro_count=5)
    nav = NavState(valid=True, V=V, pos_n=(0.0, 0.0, -7010.0))
    _, health = turning.step(f, np.zeros(4), nav, UPD_IMU, Health(failed=HF_ATT), DT)
    assert turning.out == 0 and health.failed == HF_ATT and turning.texts[-1].text == "gyro used: attitude failed"
