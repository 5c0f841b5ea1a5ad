"""Each sensor aid of an estimator has one status: what it offered, what became of it, and how far off it was."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw import refusal as rd
from flightsw.aircraft import load_aircraft
from flightsw.kernels.rotations import quat4, quat_from_euler
from flightsw.refusal import AidStatus, GateParams
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.trim import trim_free
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, Health, SensorFrame

AC = load_aircraft("kc135r")
TRIM = trim_free(AC, AC.mass.empty_kg + AC.mass.default_fuel_kg, 7010.0, 195.0, 0.0)
STEPS, SPIKE, SILENT = 60, 40, 50  # attitude is wrong in step SPIKE, no GNSS from SILENT on


def fly(false_alarm: float = 1e-6, spike: float = 0.3, until: int = STEPS, late_us: int = 0) -> AirframeNav:
    """Level flight on exact readings, GNSS in every second step and late_us old."""
    nav = AirframeNav(AC, NavParams(gate=GateParams(false_alarm=false_alarm)))
    q = np.zeros(4)
    V, beta, alpha = TRIM.x[:3].tolist()
    for k in range(until):
        t = 50_000 * (k + 1)
        f = SensorFrame(t_us=t, air_t_us=t, att_t_us=t, air_mask=1, air_V=(V,), air_beta=(beta,), air_alpha=(alpha,))
        quat_from_euler(0.0, TRIM.x[7], TRIM.x[8] + (spike if k == SPIKE else 0.0), q)
        f.att_q_nb, f.gyro_count, f.gnss_t_us = quat4(q), 5, t - late_us
        f.gnss_vel_n, f.gnss_pos_n = (V, 0.0, 0.0), (V * (t - late_us) * 1e-6, 0.0, -7010.0)
        gnss = UPD_GNSS if k % 2 == 0 and k < SILENT else 0
        nav.step(f, TRIM.u, Health(), UPD_AIR | UPD_ATT | UPD_IMU | gnss)
    return nav


def status(nav: AirframeNav) -> dict[int, AidStatus]:
    return {s.kind: s for s in nav.core.aids}


def test_counts_are_those_of_the_frames() -> None:
    s = status(fly())
    assert set(s) == {*rd.AIR, rd.GYRO, rd.ATT, rd.GNSS_POS, rd.GNSS_VEL}
    assert [s[k].name for k in (rd.V, rd.ATT)] == ["airspeed", "attitude"]
    n = STEPS - 1  # the first frame is the start
    for kind in (*rd.AIR, rd.GYRO):
        assert (s[kind].offered, s[kind].used, s[kind].refused) == (n, n, 0)
        assert s[kind].age_s == 0.0 and not s[kind].kept_out
    assert (s[rd.ATT].offered, s[rd.ATT].used, s[rd.ATT].refused) == (n, n - 1, 1)
    gnss = sum(k % 2 == 0 for k in range(1, SILENT))
    assert s[rd.GNSS_POS].offered == s[rd.GNSS_VEL].used == gnss
    assert s[rd.GNSS_POS].age_s == pytest.approx(0.05 * (STEPS - 1 - (SILENT - 2)))


def test_the_ratio_says_how_far_off_and_exceeds_one_where_it_is_refused() -> None:
    s = status(fly(until=SPIKE + 1))[rd.ATT]
    assert s.refused == 1 and s.ratio > 1.0 and s.age_s == pytest.approx(0.05)
    gate = fly(until=SPIKE + 1).core.refusals
    assert gate is not None and gate.ratios == tuple(gate.status(k).ratio for k in range(len(rd.KINDS)))
    assert s.innovation[2] == pytest.approx(0.3, abs=0.02) and len(s.innovation) == len(s.sigma) == 3
    limit = rd.Refusals(GateParams(), 1).gate.limit
    # the roll channel is the worst one; its mean before the spike is next to nothing
    assert s.ratio == pytest.approx(abs(s.innovation[2]) / (limit * s.sigma[2]), rel=0.1)
    assert status(fly(until=SPIKE))[rd.ATT].ratio < 1.0


def test_a_late_fix_starts_the_estimate_where_the_aircraft_is() -> None:
    nav = fly(until=SPIKE, late_us=100_000)
    assert status(nav)[rd.GNSS_POS].refused == 0 and status(fly(until=3, late_us=100_000))[rd.GNSS_POS].ratio < 0.1
    assert nav.out.pos_n[0] == pytest.approx(TRIM.x[0] * 0.05 * SPIKE, abs=0.1)


def test_no_number_is_infinitely_far_off() -> None:
    s = status(fly(spike=math.nan, until=SPIKE + 1))[rd.ATT]
    assert s.refused == 1 and s.ratio == math.inf


def test_where_nothing_is_judged_there_is_nothing_to_say() -> None:
    assert fly(false_alarm=0.0, spike=0.0, until=3).core.aids == ()
