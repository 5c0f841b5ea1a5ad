"""Figures and recording of gust runs, on synthetic logs whose answers are known, and on a short real flight."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from flightsw.aircraft import load_airframe
from flightsw.icd.codec import PlantCodec
from flightsw.icd.geo import Origin
from flightsw.icd.tlog import TlogWriter
from flightsw.icd.wire import Counters
from flightsw.missions.gust.reports import REPORTS, GustState
from flightsw.process.telemetry import Telemetry
from flightsw.types import ZERO3, ActuatorCmd, GuidanceCmd, Health, NavState, SensorFrame, Snapshot, Timing
from ground.__main__ import app
from ground.columns import load
from ground.link.record import Recorder
from ground.metrics import compute
from ground.views.gust.read import flights, has_gust, names, trim_speed, vane_bias
from sim_plant.truth import Truth

DEG = math.pi / 180.0
HZ = 50
V0 = 20.0
SCENARIO = """
[[aircraft]]
name = "one"
sysid = 3
start = { V_mps = 20.0 }
[[aircraft]]
name = "other"
sysid = 4
start = { V_mps = 20.0 }
[sensors]
one.air.alpha_bias_std = 0.0
other.air.alpha_bias_std = 0.0
[[event]]
t_s = 5.0
kind = "bias"
target = "one"
sensor = "air"
channel = "alpha"
value = [0.0174533]
"""


def make_run(
    folder: Path, seconds: float = 30.0, error_deg: float = 0.3, gain: float = 0.5, reference: bool = True
) -> Path:
    """Two aircraft in a 0.5 Hz gust: `one` estimates alpha_W with a constant error and feels `gain` of what `other` feels."""
    folder.mkdir()
    (folder / "scenario.toml").write_text(SCENARIO)
    truth, ground = TlogWriter(folder / "truth.tlog"), Recorder(TlogWriter(folder / "tlm.tlog"))
    ac = load_airframe("alexis")
    for sysid, scale, law in ((3, gain, 1), (4, 1.0, 0))[: 2 if reference else 1]:
        plant = PlantCodec(ac, sysid)
        tel = Telemetry(sysid, REPORTS, False, Origin(), HZ, Counters())
        for i in range(round(seconds * HZ)):
            t = i / HZ
            us = i * 1_000_000 // HZ
            w = 2.0 * math.sin(math.pi * t)
            climb = scale * math.sin(math.pi * t) / math.pi  # a_z = scale cos(pi t)
            true = Truth(
                us, pos_n=(V0 * t, 0.0, -100.0), vel_n=(V0, 0.0, -climb), q_nb=(1.0, 0.0, 0.0, 0.0), w_b=ZERO3, euler=ZERO3,
                acc_n=ZERO3, wind_n=(1.0, 0.0, w), wind_rot=ZERO3, V=V0, beta=0.0, alpha=0.01, controls=(0.0,) * 4,
                thrust_available=0.0, xi=ZERO3, xi_dot=ZERO3, mass=6.0, fuel_kg=0.0, boom_elevation=0.0, boom_azimuth=0.0,
                boom_extension=0.0, contact=False, inside=False,
            )  # fmt: skip
            truth.write(us, plant.truth(us, true.row))
            x, s = [0.0] * 9, [0.0] * 9
            x[1], x[2], x[8] = w / V0 + error_deg * DEG, 1.0, (1.0 if t >= 5.0 else 0.0) * DEG
            s[1], s[2], s[8] = (0.2 * DEG, 0.1, 0.1 * DEG)
            g = GustState(
                us, True, "", tuple(x), tuple(s), 7.0, 7, 0.3, (0.0, 0.2, 0.8, 0.0), 0.1, 0.1, 0.01, 0.02, 4, law
            )  # type: ignore[arg-type]
            nav = NavState(us, True, V=V0, nis=7.0, nis_dof=7)
            snap = Snapshot(
                us,
                i,
                SensorFrame(us),
                nav,
                GuidanceCmd(phase=17),
                ActuatorCmd(us),
                Health(),
                Timing(),
                reports={GustState: g},
            )
            for d in tel.datagrams(snap, i):
                ground.take(d)
    truth.close()
    ground.finish()
    (folder / "meta.json").write_text("{}")
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_run(tmp_path_factory.mktemp("gust") / "run")


def test_estimate_and_truth_meet_at_equal_times(run: Path) -> None:
    truth, tlm = load(run / "truth.tlog"), load(run / "tlm.tlog")
    assert has_gust(tlm) and names(run, tlm) == {3: "one", 4: "other"}
    f = flights(run, truth, tlm)[0]
    assert len(f.t_us) == 30 * HZ and f.name == "one"
    assert np.allclose(f.est[:, 0] - f.truth[:, 0], 0.3 * DEG, atol=1e-6)
    assert np.allclose(f.truth[:, 1], 1.0)
    # mean acceleration from row to row of 0.5 cos(pi t)
    mid = f.t[:-1] + 0.5 / HZ
    assert np.allclose(f.a_z[:-1], 0.5 * np.cos(math.pi * mid), atol=1e-3)


def test_figures_of_a_known_run(run: Path) -> None:
    s = compute(run)
    assert s["gust.one.alpha_w.rms_deg"] == pytest.approx(0.3, rel=1e-3)
    assert s["gust.one.alpha_w.inside_2sigma_pct"] == 100.0  # 0.3 deg of 2 x 0.2
    assert s["gust.one.v_w.rms_mps"] == pytest.approx(0.0, abs=1e-6)
    assert s["gust.one.bias.rms_deg"] == pytest.approx(0.0, abs=1e-4)
    assert s["gust.other.bias.rms_deg"] == pytest.approx(1.0, rel=1e-3)  # no event on that vane
    assert s["gust.one.nis_over_m"] == pytest.approx(1.0)
    assert s["gust.one.a_z.low_rms_mps2"] == pytest.approx(0.5 / math.sqrt(2), rel=0.02)
    assert s["gust.alleviation.low_reduction_pct"] == pytest.approx(50.0, abs=0.5)
    assert s["gust.alleviation.total_reduction_pct"] == pytest.approx(50.0, abs=0.1)
    assert not [k for k in s if k.startswith(("contact.", "wind.", "join."))]
    assert s["link.dropped"] == 0


def test_a_run_without_a_holding_aircraft_has_no_reduction(tmp_path: Path) -> None:
    s = compute(make_run(tmp_path / "run", 10.0, reference=False))
    assert not [k for k in s if k.startswith("gust.alleviation")]
    assert s["gust.one.samples"] > 0


STEP: dict[str, Any] = {
    "t_s": 2.0, "for_s": 3.0, "kind": "bias", "target": "a", "sensor": "air", "channel": "alpha", "value": [0.1],
}  # fmt: skip
T = np.arange(0.0, 10.0, 0.5)


def bias(*events: dict[str, Any], name: str = "a", std: float = 0.0) -> np.ndarray:
    sensors = {n: {"air": {"alpha_bias_std": std}} for n in "ab"}
    return vane_bias({"event": list(events), "sensors": sensors}, name, T)


def test_vane_bias_follows_the_events_of_its_own_aircraft() -> None:
    b = bias(STEP, STEP | {"channel": "V"}, STEP | {"index": 1}, STEP | {"t_s": 4.0, "for_s": 0.0})
    assert b[T < 2.0].max() == 0.0 and np.all(b[(T >= 4.0) & (T < 5.0)] == 0.2) and b[-1] == pytest.approx(0.1)
    assert not bias(STEP, name="b").any()
    whole = bias(STEP | {"channel": "", "value": [3.0, 0.2, 0.0]})  # V, alpha, beta
    assert whole.max() == 0.2
    drift = bias(STEP | {"kind": "drift", "value": [0.01]})
    assert drift[T == 4.0] == pytest.approx(0.02) and drift[-1] == 0.0


def test_a_vane_bias_no_record_tells_is_not_a_number() -> None:
    assert np.isnan(bias(STEP, std=0.001)).all()  # drawn by the plant
    assert np.isnan(vane_bias({}, "a", T)).all()
    for kind in ("scale", "garbage", "stuck", "delayed"):
        b = bias(STEP | {"kind": kind})
        on = (T >= 2.0) & (T < 5.0)
        assert np.isnan(b[on]).all() and not b[~on].any(), kind
    for kind in ("off", "intermittent", "spike"):
        assert not bias(STEP | {"kind": kind}).any()
    late = vane_bias({"sensors": {"a": {"air": {"alpha_bias_std": 0.0}}}}, "a", T, injected_s=6.0)
    assert np.isnan(late[T >= 6.0]).all() and not late[T < 6.0].any()
    assert math.isnan(trim_speed({}, "a"))


def test_figures_without_truth_are_none(tmp_path: Path) -> None:
    run = make_run(tmp_path / "run", 10.0)
    drawn = SCENARIO.replace("one.air.alpha_bias_std = 0.0", "one.air.alpha_bias_std = 0.001")
    (run / "scenario.toml").write_text(drawn.replace("V_mps = 20.0", "V_mps = 10.0", 1))
    s = compute(run)
    assert s["gust.one.bias.rms_deg"] is None and s["gust.one.bias.inside_2sigma_pct"] is None
    assert s["gust.other.bias.rms_deg"] is not None
    assert s["gust.one.alpha_w.rms_deg"] > 3.0  # truth is over the speed the aircraft started with
    (run / "scenario.toml").write_text("")
    s = compute(run)
    assert s["gust.aircraft3.alpha_w.rms_deg"] is None and s["gust.aircraft3.v_w.rms_mps"] == pytest.approx(
        0.0, abs=1e-6
    )


def test_injected_failures_end_the_known_bias(tmp_path: Path) -> None:
    from flightsw.icd.wire import Sender

    run = make_run(tmp_path / "run", 10.0)
    log = TlogWriter(run / "plant.tlog")
    log.write(
        6_000_000, Sender(3, 26).named("COMMAND_ACK", command=420, result=0, target_system=255, target_component=190)
    )
    log.close()
    f, other = flights(run, load(run / "truth.tlog"), load(run / "tlm.tlog"))
    assert np.isnan(f.truth[f.t >= 6.0, 2]).all() and np.isfinite(f.truth[f.t < 6.0]).all()
    assert np.isfinite(other.truth).all()


def test_conversion_and_tabs(run: Path, tmp_path: Path) -> None:
    from ground.rrd import convert
    from ground.rrd.blueprint import NoTabError

    path = convert(run, tmp_path / "run.rrd")
    assert path.stat().st_size > 20_000
    assert convert(run, tmp_path / "loads.rrd", tab="loads").exists()
    with pytest.raises(NoTabError, match="Gust, Loads, Filter, Wind, Flight, Controls, Timing and filter, Sensors"):
        convert(run, tmp_path / "none.rrd", tab="boom")


def test_metrics_command_prints_them(run: Path) -> None:
    r = CliRunner().invoke(app, ["metrics", str(run)])
    assert r.exit_code == 0 and json.loads(r.stdout)["gust.one.alpha_w.rms_deg"] == pytest.approx(0.3, rel=1e-3)


def test_law_by_command() -> None:
    from ground.link.command import CommandError, fit, order

    o, why = fit(order("law", 2.0, 3), "gust")
    assert (o.target, o.command, o.params[0], o.text, why) == (3, 31011, 2.0, "law elevator", "")
    for value, to in ((None, 3), (5.0, 3), (1.0, None)):
        with pytest.raises(CommandError, match="0 hold, 1 alleviation, 2 elevator"):
            order("law", value, to)
