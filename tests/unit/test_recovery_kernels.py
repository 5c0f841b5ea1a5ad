"""Kernels of the protection against the plain expressions they stand for, to the bit: readings, lags, differences, bounds."""

from __future__ import annotations

import math
import statistics
from collections import deque

import numpy as np
import pytest

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.rotations import Vec3, dcm_from_euler, less, quat_from_euler, turn
from flightsw.sixdof.recovery import answer_kernel as ak
from flightsw.sixdof.recovery import readings_kernel as rk
from flightsw.sixdof.recovery.beyond import (
    AIRSPEED,
    BANK,
    INCIDENCE,
    OVERLOAD,
    PITCH,
    PITCH_BEYOND,
    PITCH_RATE,
    RATES,
    ROLL,
    SIDEWAYS,
    YAW,
    felt_beyond,
)
from flightsw.sixdof.recovery.motion import (
    AGE,
    BY_GYRO,
    GATE,
    LAG_S,
    LEAST_S,
    LENGTH_S,
    SHARE,
    STATE,
    TURNED,
    angle,
    carry,
)
from flightsw.sixdof.recovery.readings import Readings
from flightsw.sixdof.recovery.turbulence import FIRST_S, KEPT, LEARNT, RoughAirParams, Turbulence, learnt, taken
from flightsw.types import HF_IMU, UPD_AIR, UPD_ATT, UPD_BARO, UPD_IMU, Health, SensorFrame

AC, DT, H = load_aircraft("learjet24"), 0.05, 7010.0
Rng = np.random.Generator


class Plain:
    """Airspeed and flow, one reading after another."""

    def __init__(self, ac: Aircraft, s: Readings) -> None:
        lo, hi = ac.limits.V_min_mps, ac.limits.V_max_mps
        self.ac, self.between = ac, lo + rk.SHARE_V * (hi - lo)
        self.V = self.felt = self.between
        self.measured = self.given = False
        self.age = self.alpha = self.beta = 0.0
        self.load, self.w, self.mass = 1.0, (0.0, 0.0, 0.0), s.mass

    def step(self, f: SensorFrame, fresh: bool, health: Health, h: float, down: Vec3, V: float) -> None:
        if f.gyro_count and not health.failed & HF_IMU:
            self.w, self.load = f.gyro_mean_b, -f.acc_mean_b[2] / G0
        kept = bool(health.kept_out >> rd.V & 1)
        self._airspeed(f, fresh and not kept, down, V if kept else None)
        self.q = 0.5 * density(h) * self.V * self.V
        self._flow(f, fresh, health.kept_out)

    def _airspeed(self, f: SensorFrame, fresh: bool, down: Vec3, given: float | None) -> None:
        self.age += DT
        if given is not None:
            self.V = self.felt = given
            self.age, self.measured, self.given = 0.0, False, True
            return
        (ahead, _, below), ca, sa = f.acc_mean_b, math.cos(self.alpha), math.sin(self.alpha)
        gained = DT * (ca * (ahead + G0 * down[0]) + sa * (below + G0 * down[2]))
        self.V += gained
        self.felt += gained
        good = f.air_mask & ~f.air_bad if fresh else 0
        if seen := [v for i, v in enumerate(f.air_V) if good >> i & 1]:
            V = statistics.median(seen)
            if not self.measured and not self.given:
                self.felt = V
            off = V - self.felt
            if abs(off) < rk.V_GATE:
                self.V, self.age, self.measured, self.given = V, 0.0, True, False
                self.felt += min(DT / rk.SETTLE_V_S, 1.0) * off
            elif self.age <= DT:
                self.V = self.felt
        if self.age > rk.V_COAST_S:
            self.measured = False
            self.V += min(DT / rk.TAU_V_S, 1.0) * (self.between - self.V)
        self.V = min(max(self.V, 0.3 * self.between), 2.0 * self.between)

    def _flow(self, f: SensorFrame, fresh: bool, out: int) -> None:
        c, S, V, (p, q, r) = self.ac.aero, self.ac.geometry.S_m2, self.V, self.w
        vanes = f.air_mask if fresh else 0
        up = 0 if out >> rd.ALPHA & 1 else vanes & ~(f.air_bad >> 6)
        side = 0 if out >> rd.BETA & 1 else vanes & ~(f.air_bad >> 3)
        at = [probe.position_m for probe in self.ac.probe]
        alpha = [f.air_alpha[i] - (p * y - q * x) / V for i, (x, y, _) in enumerate(at) if up >> i & 1]
        beta = [f.air_beta[i] - r * x / V for i, (x, _, _) in enumerate(at) if side >> i & 1]
        lift = (self.load * self.mass * G0 / (self.q * S) - c.CL0) / c.CL_alpha
        aside = f.acc_mean_b[1] * self.mass / (self.q * S * c.CY_beta)
        self.by_vanes = bool(alpha)
        a, b = statistics.median(alpha) if alpha else lift, statistics.median(beta) if beta else aside
        self.alpha, self.beta = min(max(a, -rk.FLOW_MOST), rk.FLOW_MOST), min(max(b, -rk.FLOW_MOST), rk.FLOW_MOST)


def read(r: Rng, V: float, probes: int) -> SensorFrame:
    """One frame of a flight to and fro, some probes missing or refused."""
    q = np.zeros(4)
    quat_from_euler(*r.normal(0.0, 0.2, 3), q)
    f = SensorFrame(gyro_count=int(r.integers(3)), baro_alt_m=r.uniform(5e3, 13e3), att_q_nb=tuple(q.tolist()))
    f.gyro_mean_b = tuple(r.normal(0.0, 0.2, 3).tolist())
    f.acc_mean_b = tuple((r.normal(0.0, 2.0, 3) - [0.0, 0.0, 9.8]).tolist())
    f.air_mask, f.air_bad = int(r.integers(1 << probes)), int(r.integers(512)) if r.integers(3) == 0 else 0
    f.air_V = tuple((V + r.normal(0.0, 5.0, probes)).tolist())
    f.air_alpha, f.air_beta = (tuple(r.normal(0.0, 0.3, probes).tolist()) for _ in range(2))
    return f


@pytest.mark.parametrize("seed", range(4))
def test_airspeed_and_flow_are_those_of_the_plain_expressions(seed: int) -> None:
    """Probes that leap, are missing, kept out and come back, for longer than an airspeed is carried on."""
    r = np.random.default_rng(seed)
    ac = AC if seed else load_aircraft("kc135r")
    s = Readings(ac, H)
    plain, seen = Plain(ac, s), set()
    for k in range(2000):
        f = read(r, 190.0 - 100.0 * (k // 200 % 3 == 1), len(ac.probe))
        health = Health(failed=HF_IMU if r.integers(8) == 0 else 0, kept_out=int(r.integers(8)) if k // 400 % 2 else 0)
        fresh = bool(r.integers(4)) and k % 700 < 400
        s.step(f, UPD_IMU | UPD_BARO | UPD_ATT | (UPD_AIR if fresh else 0), health, DT, 185.0)
        plain.step(f, fresh, health, s.h_m, s.down, 185.0)
        assert (s.V, s.alpha, s.beta, s.q, s.load) == (plain.V, plain.alpha, plain.beta, plain.q, plain.load)
        assert (s.V_measured, s.alpha_measured) == (plain.measured, plain.by_vanes)
        assert s.V_beyond_felt == plain.V - plain.felt
        seen.add((s.V_measured, s.alpha_measured, plain.given))
    assert len(seen) >= 5


@pytest.mark.parametrize("n", range(1, 5))
def test_the_middle_one_is_the_median(n: int) -> None:
    r = np.random.default_rng(n)
    for _ in range(50):
        v = r.choice([-1.0, 0.0, 0.5, 2.0, 7.0], rk.PROBES)
        assert rk.middle(v.copy(), n) == statistics.median(v[:n].tolist())


@pytest.mark.parametrize("fresh", [True, False])
def test_a_window_is_looked_at_where_its_reference_parts_or_it_is_over(fresh: bool) -> None:
    r, found = np.random.default_rng(5), set()
    for _ in range(200):
        own, q = np.zeros(9), np.zeros(4)
        dcm_from_euler(*r.normal(0.0, 0.3, 3), own)
        quat_from_euler(*r.normal(0.0, 0.05, 3), q)
        windows, rate, reference = np.zeros((2, STATE)), r.uniform(0.0, 0.3), np.zeros(9)
        for w in windows:
            dcm_from_euler(*r.normal(0.0, 0.05, 3), w[:BY_GYRO])
            w[AGE], w[TURNED] = r.choice([-1.0, 0.5, 3.0, 2.0 * LENGTH_S], p=[0.1, 0.3, 0.5, 0.1]), r.uniform(0.0, 2.0)
        ages, was = windows[:, AGE].copy(), windows.copy()
        _, due = carry(
            own, True, reference, fresh, *q, windows[0], windows[1], 0.1, 0.2, -0.1, 1.0, 0.0, -9.8, rate, DT
        )
        wanted = False
        for w, before, age in zip(windows, was, ages, strict=True):
            if age >= 0.0:
                turn(before[:BY_GYRO], 0.1, 0.2, -0.1, DT)
                assert w[AGE] == age + DT and w[TURNED] == before[TURNED] + rate * DT
            limit = GATE + SHARE * w[TURNED] + LAG_S * rate
            parted = w[AGE] >= LEAST_S and not angle(reference, before[:BY_GYRO]) < limit
            wanted |= fresh and (w[AGE] < 0.0 or w[AGE] >= 2.0 * LENGTH_S or parted)
        assert due == wanted
        found.add(due)
    assert found == ({True, False} if fresh else {False})


@pytest.mark.parametrize("seed", range(3))
def test_what_is_beyond_is_what_the_limits_say(seed: int) -> None:
    r, found = np.random.default_rng(seed), 0
    inside = np.array([1.0, 0.2, 150.0, 220.0, -0.5, 2.0])
    for _ in range(2000):
        x, down = np.zeros(rk.BLOCK), r.normal(size=3)
        down /= np.linalg.norm(down)
        x[[rk.FORWARD, rk.RIGHT, rk.BELOW]] = down
        x[[rk.ALPHA, rk.SPEED, rk.LOAD]] = r.uniform(-0.3, 0.3), r.uniform(130.0, 240.0), r.uniform(-2.0, 4.0)
        x[: rk.ROLLED], x[rk.MEASURED], x[rk.BY_VANES] = r.normal(0.0, 0.4, 3), r.integers(2), r.integers(4)
        known, V, alpha, w = bool(r.integers(2)), r.uniform(130.0, 240.0), r.uniform(-0.3, 0.3), r.normal(0.0, 0.4, 3)
        bank, pitch = abs(math.atan2(down[1], down[2])), abs(math.asin(down[0]))
        fast = [max(abs(w / (ROLL, PITCH_RATE, YAW))) for w in (x[: rk.ROLLED], w)]
        speeds, flows = [x[rk.SPEED], *[V] * known], [x[rk.ALPHA], *[alpha] * known]
        wanted = BANK * (bank > 1.0 and pitch < SIDEWAYS) | PITCH * (pitch > PITCH_BEYOND)
        wanted |= INCIDENCE * bool(x[rk.BY_VANES] and min(map(abs, flows)) > 0.2)
        wanted |= AIRSPEED * bool(x[rk.MEASURED] and (max(speeds) < 150.0 or min(speeds) > 220.0))
        wanted |= RATES * (min(fast[: 1 + known]) > 1.0) | OVERLOAD * (not known and not -0.5 < x[rk.LOAD] < 2.0)
        assert felt_beyond(x, known, V, alpha, *w, inside) == wanted
        found |= wanted
    assert found == BANK | PITCH | INCIDENCE | AIRSPEED | RATES | OVERLOAD


def test_the_slowest_engine_follows_no_quicker_than_its_spool() -> None:
    r, e = np.random.default_rng(4), AC.engine
    P, m, slow = ak.numbers(AC), np.zeros(ak.MEMORY), -1.0
    for k in range(300):
        avail, thrust = r.uniform(8e3, 12e3), r.uniform(0.0, 13e3)
        if k % 100 == 0:
            slow = m[ak.SLOW] = -1.0
        m[ak.AVAILABLE] = avail
        slow = thrust if slow < 0.0 or e.spool_full_ps == 0.0 else slow
        full = min(max(slow / avail, 0.0), 1.0)
        most = ak.LAZY * (e.spool_idle_ps + (e.spool_full_ps - e.spool_idle_ps) * full) * avail * DT
        slow += min(max(thrust - slow, -most), most)
        assert ak.lagging(thrust, P, DT, m) == slow - thrust and m[ak.SLOW] == slow


def test_how_far_both_have_been_apart_is_forgotten_in_two_seconds() -> None:
    r, m, was = np.random.default_rng(6), np.zeros(ak.MEMORY), np.zeros(3)
    for dt in (0.05, 0.01, 3.0, 0.05):
        now = r.normal(size=3)
        ak.parted(*now, dt, m)
        was = np.maximum(np.abs(now), max(1.0 - dt / ak.APART_S, 0.0) * was)
        assert (m[ak.APART : ak.SLOW] == was).all()


def test_sums_and_ranges_of_a_ring_are_those_of_its_last_rows() -> None:
    r = np.random.default_rng(7)
    ring, rows = np.zeros((7, 3)), deque(maxlen=7)
    for n in range(1, 30):
        rows.append(r.normal(size=3))
        ring[(n - 1) % 7] = rows[-1]
        count = min(n, int(r.integers(1, 8)))
        last = np.array(rows)[::-1][:count, 1].tolist()
        assert ak.total(ring, n, count, 1) == sum(last)
        assert ak.spread(ring, n, count, 1) == max(last) - min(last)


def test_nothing_is_learnt_twice_of_a_step_that_is_doubtful() -> None:
    """Within its first seconds all is learnt, then what is near; a share of 1/t of that time."""
    r, m, square = np.random.default_rng(8), np.zeros(ak.MEMORY), np.zeros((2, 8))
    off, mean = r.normal(size=8), r.normal(size=(2, 8))
    ak.learnt(off, mean, 9.0, False, DT, m, square)
    assert m[ak.LEARNT_S] == DT and (m[ak.LASTING : ak.LEAST] == off).all() and (square == mean * mean).all()
    m[ak.LEARNT_S] = ak.LEARN_S
    ak.learnt(2.0 * off, mean, ak.DOUBTFUL, False, DT, m, square)
    assert (m[ak.LASTING : ak.LEAST] == off).all()
    ak.learnt(2.0 * off, mean, 0.9 * ak.DOUBTFUL, False, DT, m, square)
    assert (m[ak.LASTING : ak.LEAST] == off + DT / ak.LEARN_S * (2.0 * off - off)).all()


@pytest.mark.parametrize("lag_s", [0.1, 0.3, 2.0])
def test_turbulence_is_that_of_differences_kept_one_by_one(lag_s: float) -> None:
    p = RoughAirParams(lag_s=lag_s)
    r, t, span, sigma, past = np.random.default_rng(9), 0.0, 0.0, 0.0, deque()
    gained, square, ring, m, found = np.zeros(3), np.zeros(3), np.zeros((KEPT, 4)), np.zeros(LEARNT), 0.0
    R = np.zeros(9)
    for k in range(900):
        dt = DT if k % 50 else 0.15
        dcm_from_euler(*r.normal(0.0, 0.1, 3), R)
        x = np.zeros(rk.BLOCK)
        x[rk.AHEAD : rk.DOWN + 1] = r.normal(size=3) - [0.0, 0.0, G0]
        x[[rk.SPEED, rk.ALPHA, rk.BETA]] = 190.0 + r.normal(), *r.normal(0.0, 0.02, 2)
        t += dt
        found = taken(x, R, t, dt, ring, m, lag_s, p.window_s, 0.1, p.L_m, found)
        V, a, b = x[[rk.SPEED, rk.ALPHA, rk.BETA]].tolist()
        force = x[rk.AHEAD : rk.DOWN + 1].tolist()
        air = V * math.cos(a) * math.cos(b), V * math.sin(b), V * math.sin(a) * math.cos(b)
        for i, g in enumerate((0.0, 0.0, G0)):
            gained[i] += (R[i] * force[0] + R[3 + i] * force[1] + R[6 + i] * force[2] + g) * dt
        here = tuple(float(gained[i] - (R[i] * air[0] + R[3 + i] * air[1] + R[6 + i] * air[2])) for i in range(3))
        past.append((t, here))
        while (lag := t - past[0][0]) > lag_s + 0.5 * dt and len(past) > 1:
            past.popleft()
        if lag > lag_s - 0.5 * dt:
            span = min(span + dt, p.window_s)
            learnt(R, *less(here, past[0][1]), lag * V / p.L_m, dt / span, 0.1, square)
            if span >= FIRST_S:
                sigma = math.sqrt(max(sorted(square.tolist())[1], 0.0))
        assert found == sigma
    assert sigma > 0.0 and Turbulence(p).sigma == 0.0


def test_steps_too_short_to_keep_the_lag_are_judged_over_what_is_kept() -> None:
    """At 1000 steps a second the ring holds half a second: differences are learnt over that, as at 20 a second over it."""
    p, found = RoughAirParams(), {}
    for dt, lag_s in ((0.001, 2.0), (0.051, 0.51)):
        r, ring, m, sigma = np.random.default_rng(11), np.zeros((KEPT, 4)), np.zeros(LEARNT), 0.0
        V, R, wind, squares = 190.0, np.eye(3).ravel(), 0.0, []
        for k in range(round(100.0 / dt)):
            x = np.zeros(rk.BLOCK)
            wind += 1.0 * math.sqrt(dt) * r.normal()
            x[rk.DOWN] = -G0
            x[rk.SPEED], x[rk.ALPHA], x[rk.BETA] = V + wind, 0.0, math.asin(0.5 * wind / (V + wind))
            sigma = taken(x, R, k * dt, dt, ring, m, lag_s, p.window_s, 0.0, p.L_m, sigma)
            squares.append(sigma**2)
        found[dt] = math.sqrt(np.mean(squares[len(squares) // 5 :]))
    assert found[0.001] == pytest.approx(found[0.051], rel=0.3) and found[0.051] > 0.2
