"""An estimator's step in one compiled call and the same step by step: equal to the bit, in calm flight and with readings that are
wrong, missing or back again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.kernels.rotations import quat4, quat_from_euler
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.judged import DONE, O_END, UNUSUAL
from flightsw.sixdof.trim import trim_free
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, UPD_REL, Health, PeerState, SensorFrame

AC = load_aircraft("learjet24")
TRIM = trim_free(AC, AC.mass.empty_kg + AC.mass.default_fuel_kg, 7010.0, 195.0, 0.0)
STEPS, DT_US = 240, 50_000
ALL = UPD_AIR | UPD_ATT | UPD_GNSS | UPD_IMU | UPD_REL
BY_STEPS = -1.0  # of a step that was not one call
Nav = AirframeNav | RelativeNav


def flight(seed: int) -> Iterator[tuple[SensorFrame, int]]:
    """Level flight behind a tanker on noisy readings, and what of them is new; with one fault after the other."""
    r, q = np.random.default_rng(seed), np.zeros(4)
    V, beta, alpha = TRIM.x[:3].tolist()
    n, t = len(AC.probe), 0
    for k in range(STEPS):
        t += DT_US if k != 200 else 16 * DT_US  # once the process stands still
        age = 10_000 * int(r.integers(3))
        f = SensorFrame(
            t_us=t, air_t_us=t - age, att_t_us=t - age, gnss_t_us=t - 20_000, rel_t_us=t - age, rel_valid=True
        )
        f.air_mask, f.gyro_count, f.gyro_age_s, f.fuel_kg = (1 << n) - 1, 5, 0.02, 1500.0 - k // 20
        f.air_V, f.air_beta, f.air_alpha = (
            tuple(r.normal(v, s, n).tolist()) for v, s in ((V, 0.1), (beta, 2e-3), (alpha, 2e-3))
        )
        quat_from_euler(0.0, TRIM.x[7] + r.normal(0.0, 1e-3), TRIM.x[8] + (0.3 if k in (60, 110) else 0.0), q)
        f.att_q_nb, at = quat4(q), V * (t - 20_000) * 1e-6
        f.gyro_b = f.gyro_mean_b = tuple(r.normal(0.0, 3e-3, 3).tolist())
        f.acc_b = f.acc_mean_b = (0.3, 0.0, -9.8)
        f.gnss_pos_n, f.gnss_vel_n = (
            (at + r.normal(0.0, 0.3), 0.0, -7010.0),
            tuple(r.normal((V, 0.0, 0.0), 0.05).tolist()),
        )
        f.rel_pos_t, f.rel_vel_t = (
            tuple(r.normal((-59.0, 20.0, 6.0), 0.1).tolist()),
            tuple(r.normal(0.0, 0.03, 3).tolist()),
        )
        quat_from_euler(0.0, 0.02, 0.0, q)
        if not 150 <= k < 180:  # the data link falls silent, and comes back
            f.peer = PeerState(
                t_us=t - 30_000, q_nb=quat4(q), vel_n=(V, 0.0, 0.0), pos_n=(59.0 + V * t * 1e-6, -20.0, -7016.0)
            )
        new = ALL & ~(UPD_GNSS if k % 2 else 0)
        if 115 <= k < 130:
            f.air_V = tuple(v + 12.0 for v in f.air_V)
        if k in (132, 133):
            new &= ~UPD_AIR
        if k == 135:
            f.gnss_vel_n, new = (np.nan, 0.0, 0.0), new | UPD_GNSS
        if k == 140:
            f.gyro_count, f.air_mask = 0, 0
        if 185 <= k < 195:
            new = 0
        yield f, new


def state(nav: Nav) -> bytes:
    """Everything compiled steps write."""
    c = nav.core
    assert c.refusals is not None
    held = (*c.ukf.memory(), *c.rows, c.air, c.w_air, nav._fm, nav._d, *c.refusals.gate.arrays()[:2])
    return b"".join(a.tobytes() for a in held) + f"{c.m} {c.probes} {c.P.tobytes()!r}".encode()


@pytest.mark.parametrize("kind", [AirframeNav, RelativeNav])
@pytest.mark.parametrize("seed", [1, 2])
def test_one_call_is_the_same_step(kind: type[Nav], seed: int) -> None:
    once, one_by_one = kind(AC, NavParams()), kind(AC, NavParams())
    one_by_one._whole = None
    ends: Counter[float] = Counter()
    for k, (f, new) in enumerate(flight(seed)):
        once._told[O_END] = BY_STEPS
        a, b = once.step(f, TRIM.u, Health(), new), one_by_one.step(f, TRIM.u, Health(), new)
        assert a == b, k
        assert state(once) == state(one_by_one), k
        ends[float(once._told[O_END])] += 1
    assert ends[DONE] > 80 and ends[UNUSUAL] > 1 and ends[BY_STEPS] > 20, ends


VARIANTS = (
    {"filter": "ukf"}, {"cmw": True}, {"wind_model": "gauss_markov"}, {"wind_model": "dryden"}, {"adapt_wind": "single"},
    {"adapt_wind": "bank"}, {"colour_tau_s": 0.1}, {"colour_tau_s": 0.1, "colour": "augmented"},
)  # fmt: skip


@pytest.mark.parametrize("changed", [*VARIANTS, {"state_form": "velocity"}, {"model": "hybrid"}], ids=str)
def test_variants_of_a_free_aircraft_go_step_by_step(changed: dict[str, object]) -> None:
    assert (
        AirframeNav(AC, NavParams())._whole is not None
        and AirframeNav(AC, NavParams(filter="srckf"))._whole is not None
    )
    assert AirframeNav(AC, NavParams(**changed))._whole is None


@pytest.mark.parametrize("changed", [*VARIANTS, {"rotational_wind": True}, {"local_probes": True}], ids=str)
def test_variants_of_a_receiver_go_step_by_step(changed: dict[str, object]) -> None:
    assert RelativeNav(AC, NavParams())._whole is not None
    assert RelativeNav(AC, NavParams(**changed))._whole is None
