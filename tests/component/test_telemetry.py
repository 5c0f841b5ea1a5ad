"""Rates, order and stamping of telemetry."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from itertools import pairwise
from types import SimpleNamespace

import pytest

from flightsw import plugins
from flightsw import refusal as rd
from flightsw.icd import wire
from flightsw.icd.codec_telemetry import ENCODERS, TIMED
from flightsw.icd.rates import COMMON, due, names_due, table
from flightsw.missions.base import MissionSpec
from flightsw.missions.receiver.airdata.reports import REPORTS, FdiStatus, WakeFix
from flightsw.process.config import TelemetryConfig
from flightsw.process.node import Node
from flightsw.strict import ConfigError
from flightsw.types import HF_GNSS, Text

from .flight_fakes import FakeApp, FakePlant, config, fields, names

OWN = [r.message for r in REPORTS]
TABLE = table([(r.message, r.rate_hz, r.offset) for r in REPORTS], True)
RATES = {n: rate for n, (rate, _) in TABLE.items()}


def test_table_and_encoders_name_the_same_messages() -> None:
    assert set(COMMON) == set(ENCODERS)
    assert next(iter(COMMON)) == "NAV_STATE" and "NAV_STATE" in TIMED
    for name, spec in plugins.parts(plugins.MISSIONS, MissionSpec).items():
        own = [r.message for r in spec.reports]
        assert not set(own) & set(COMMON) and set(own) <= set(wire.BY_NAME), name
        order = list(table([(m, 1.0, 0) for m in own], spec.sends_relative))
        assert [m for m in order if m in COMMON] == list(COMMON) and [m for m in order if m in own] == own


def test_a_rate_of_a_message_the_mission_does_not_send_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"telemetry\.rates_hz\.GUST_STATE: unknown message; allowed: NAV_STATE"):
        Node(config(telemetry=TelemetryConfig(rates_hz={"GUST_STATE": 1.0})), FakeApp())


@pytest.mark.parametrize("base", [50, 100, 250])
@pytest.mark.parametrize("rate", [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 10.0, 20.0, 33.0, 50.0])
def test_average_rate_is_exact(rate: float, base: int) -> None:
    n = sum(due(tick, rate, 3, base) for tick in range(100 * base))
    assert n == pytest.approx(100 * rate, abs=1)


def test_rate_above_base_is_every_tick_and_zero_never() -> None:
    assert all(due(t, 400.0, 0, 100) for t in range(100))
    assert not any(due(t, 0.0, 0, 100) for t in range(100))


def test_status_messages_are_spread_over_the_second() -> None:
    offsets = {n: offset for n, (_, offset) in TABLE.items()}
    due_at = [names_due(RATES, offsets, tick, 100) for tick in range(1000)]
    slow = [n for n, r in RATES.items() if r == 1.0]
    at = {n: next(t for t in range(100) if n in due_at[t]) for n in slow}
    assert len(set(at.values())) == len(slow)
    assert all(due_at[t] == () for t in range(1000) if t % 10)


def run(seconds: int, app: FakeApp | None = None, **changes: object) -> tuple[Node, list[bytes]]:
    node, plant = Node(config(**changes), app or FakeApp()), FakePlant()
    out: list[bytes] = []
    for k in range(100 * seconds):
        out += node.handle([plant.at(k)]).telemetry
    return node, out


def test_counts_per_message_over_ten_seconds() -> None:
    _, out = run(10)
    got = Counter(n for d in out for n in names(d))
    want = {n: 10 * r for n, r in RATES.items() if r and n not in OWN}
    # this one has neither tanks nor a static pressure nor a radio altimeter
    assert got == {n: int(c) for n, c in want.items() if n not in ("FUEL_STATUS", "SCALED_PRESSURE", "DISTANCE_SENSOR")}
    assert len(out) == 100  # one datagram per slot


def with_air_data(fdi: bool = True, wake: bool = True) -> FakeApp:
    app = FakeApp()
    status = FdiStatus(
        t_us=20_000, valid=True, gamma=(1.0, 2.0, 30.0), threshold=9.2103, residual=(1.0, 0.0, 1.0, -1.0, 5.0, -2.5),
        alarm=4, isolated=256, negative=256, excluded=256 | 1, exclusions=3,
    ) if fdi else None  # fmt: skip
    fix = WakeFix(
        t_us=20_000, valid=True, reason="x" * 60, pos_f=(-35.5, 0.25, 10.5), vel_f=(0.5, -0.25, 0.125), cov_yy=0.04,
        cov_yz=-0.01, cov_zz=0.09, scale=(0.9, 0.6), scale_sigma=(0.02, 0.1), height_m=0.5, wind_f=(2.0, 1.0, 0.5),
        nis=9.5, nis_dof=300, restarts=2,
    ) if wake else None  # fmt: skip
    app.reported = {type(r): r for r in (status, fix) if r is not None}
    return app


def test_air_data_messages_carry_every_field_ten_times_a_second() -> None:
    app = with_air_data()
    _, out = run(2, app)
    fdi, wake = (fields(b"".join(out), n) for n in ("FDI_STATUS", "WAKE_POSITION"))
    assert len(fdi) == len(wake) == 20
    assert all(len(d) <= 1400 for d in out) and len(out) == 20
    f, w = app.reported[FdiStatus], app.reported[WakeFix]
    assert isinstance(f, FdiStatus) and isinstance(w, WakeFix)
    got = {k: pytest.approx(v) for k, v in fdi[0].items()}
    names = {"t_us": "time_usec"}
    assert {names.get(k, k): v for k, v in dataclasses.asdict(f).items()} == got
    want = dataclasses.asdict(w)
    have = wake[0]
    assert have["reason"] == "x" * 50 and have["nis_dof"] == 255 and have["valid"] == 1
    for field, name in (("pos_f", "pos"), ("vel_f", "vel"), ("wind_f", "wind"), ("height_m", "height")):
        assert have[name] == pytest.approx(want[field])
    for name in ("scale", "scale_sigma", "nis", "restarts"):
        assert have[name] == pytest.approx(want[name])
    assert have["cov"] == pytest.approx((0.04, -0.01, 0.09))


@pytest.mark.parametrize(("fdi", "wake"), [(True, False), (False, True)])
def test_one_of_the_two_goes_alone(fdi: bool, wake: bool) -> None:
    _, out = run(1, with_air_data(fdi, wake))
    got = Counter(n for d in out for n in names(d))
    assert (got["FDI_STATUS"], got["WAKE_POSITION"]) == (10 * fdi, 10 * wake)


def test_without_them_not_a_byte_changes_and_asking_gives_nothing() -> None:
    everything, plain = run(3)[1], run(3, telemetry=TelemetryConfig(rates_hz=dict.fromkeys(OWN, 0.0)))[1]
    assert everything == plain
    node, plant = Node(config(), FakeApp()), FakePlant()
    node.handle([plant.at(0)])
    node.telemetry.once |= dict.fromkeys(OWN)
    assert not set(OWN) & {n for d in node.handle([plant.at(1)]).telemetry for n in names(d)}
    assert node.telemetry.failed == 0


def test_a_datagram_led_by_them_still_begins_with_the_time() -> None:
    rates = dict.fromkeys(COMMON, 0.0)
    _, out = run(1, with_air_data(), telemetry=TelemetryConfig(rates_hz=rates))
    assert {tuple(names(d)) for d in out} == {("SYSTEM_TIME", "FDI_STATUS", "WAKE_POSITION")}
    assert not run(1, telemetry=TelemetryConfig(rates_hz=rates))[1]


def test_first_packet_of_every_datagram_carries_the_time() -> None:
    node, plant = Node(config(), FakeApp()), FakePlant()
    app = node.app
    assert isinstance(app, FakeApp)
    for k in range(60):
        if k == 33:
            app.texts = [Text(6, "x" * 80)] * 40  # more than one datagram
        for d in node.handle([plant.at(k)]).telemetry:
            assert len(d) <= 1400
            first = wire.split(d, wire.SPECS, wire.Counters())[0]
            f = first[0].to_dict(first[1])
            t_us = f["time_usec"] if "time_usec" in f else f["time_boot_ms"] * 1000
            assert t_us == k * 10_000
        if k == 33:
            assert node.t_us == 330_000


def test_sequence_has_no_gap() -> None:
    _, out = run(3)
    seqs = [p[4] for d in out for p in wire.frames(d)]
    assert all((b - a) % 256 == 1 for a, b in pairwise(seqs))


def test_mission_without_relative_state_does_not_send_it() -> None:
    app = FakeApp()
    app.sends_relative = False
    node, plant = Node(config(), app), FakePlant()
    assert "RELATIVE_STATE" not in names(node.handle([plant.at(0)]).telemetry[0])


def test_non_finite_navigation_drops_integer_messages_only() -> None:
    node, plant = Node(config(), FakeApp()), FakePlant()
    app = node.app
    assert isinstance(app, FakeApp)
    app.nav.pos_n = (math.nan, 0.0, 0.0)
    out = names(node.handle([plant.at(0)]).telemetry[0])
    assert "GLOBAL_POSITION_INT" not in out and out[0] == "NAV_STATE"
    assert node.telemetry.failed == 1
    app.nav.V = 1e300  # does not fit the wire's float: the leading message fails, a time takes its place
    for k in range(1, 10):
        node.handle([plant.at(k)])
    out = names(node.handle([plant.at(10)]).telemetry[0])
    assert out[0] == "SYSTEM_TIME" and "ATTITUDE_QUATERNION" in out


def test_wind_is_nan_until_navigation_is_valid_and_health_is_shown() -> None:
    node, plant = Node(config(), FakeApp()), FakePlant()
    app = node.app
    assert isinstance(app, FakeApp)
    app.nav.valid = False
    app.health.failed = HF_GNSS
    out = b"".join(b"".join(node.handle([plant.at(k)]).telemetry) for k in range(100))
    assert math.isnan(fields(out, "WIND_COV")[0]["wind_x"])
    assert fields(out, "HEARTBEAT")[0]["system_status"] == 2
    assert not fields(out, "SYS_STATUS")[0]["onboard_control_sensors_health"] & 0x20
    assert fields(out, "HEALTH_STATUS")[0]["failed"] == HF_GNSS
    assert fields(out, "ESTIMATOR_STATUS")[0]["flags"] == 0x400
    timing = fields(out, "LOOP_TIMING")[0]
    assert all(v == 0 for k, v in timing.items() if k not in ("time_usec", "ticks"))


@pytest.mark.parametrize(
    ("ratios", "want"),
    [
        ({}, (0.0, 0.0, 0.0, 0.0)),
        ({rd.V: 1.5, rd.GNSS_VEL: 0.25, rd.GNSS_POS: 0.5, rd.ATT: 9.0}, (0.25, 0.5, 0.5, 1.5)),
        ({rd.GNSS_POS: 0.5, rd.REL_POS: math.inf, rd.REL_VEL: 2.0}, (2.0, 1e9, 1e9, 0.0)),
    ],
)
def test_test_ratios_are_those_of_the_gate(ratios: dict[int, float], want: tuple[float, ...]) -> None:
    app = FakeApp()
    app.nav.nis, app.nav.nis_dof = 99.0, 12
    each = tuple(ratios.get(k, 0.0) for k in range(len(rd.KINDS)))
    app.health.judged = SimpleNamespace(counts=(), ratios=each) if ratios else None
    got = fields(b"".join(run(1, app)[1]), "ESTIMATOR_STATUS")[0]
    assert [got[f"{k}_ratio"] for k in ("vel", "pos_horiz", "pos_vert", "tas")] == pytest.approx(want)


def test_the_head_up_display_has_calibrated_and_the_house_message_true_airspeed() -> None:
    app = FakeApp()
    app.nav.V, app.nav.V_cal = 195.0, 139.0
    _, out = run(1, app)
    data = b"".join(out)
    assert {f["airspeed"] for f in fields(data, "VFR_HUD")} == {139.0}
    assert {f["V"] for f in fields(data, "NAV_STATE")} == {195.0}


def test_stock_decoder_sees_vehicle_attitude_position_and_wind() -> None:
    from pymavlink.dialects.v20 import common

    _, out = run(2)
    link = common.MAVLink(None, 255, 1)
    link.robust_parsing = True
    got = {m.get_type() for d in out for m in (link.parse_buffer(d) or [])}
    assert {"HEARTBEAT", "ATTITUDE", "GLOBAL_POSITION_INT", "VFR_HUD", "WIND_COV", "SYS_STATUS"} <= got
