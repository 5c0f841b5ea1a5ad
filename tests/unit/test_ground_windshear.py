"""The windshear mission on the ground: the downburst redrawn from the scenario, hazard index by energy, figures, recording."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ground import Run
from ground.__main__ import app
from ground.columns import load
from ground.link.command import CommandError, fit, order
from ground.metrics import compute
from ground.rrd import convert
from ground.rrd.blueprint import NoTabError
from ground.views.windshear.read import KD, VA, WX, Downburst, H, X, flights, has_windshear
from ground.views.windshear.signals import radio_heights
from sim_plant.wind.microburst import Microburst
from sim_plant.wind.microburst_kernel import wind
from tests.drawn import are_signals
from tests.sil.launch import sil

SECONDS = 66.0


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The approach and the begin of the escape, with a radio altimeter, which moves nothing."""
    out = tmp_path_factory.mktemp("ws") / "run"
    radio = ("--set", "plant.sensors.twinjet.radalt.grade=tactical")
    ended = sil("run", "windshear_paper", "--duration", SECONDS, "--in-process", "--no-rrd", *radio, "--out", out)
    assert ended.code == 0, ended.text
    return out


def test_the_downburst_of_the_picture_is_that_of_the_plant() -> None:
    """Two programs of the same report agree; largest outflow and its height are the numbers asked for."""
    args = (26.5, 915.0, 46.0, 120.0, 250.0)
    m, out = Microburst(*args).vector(), np.zeros(6)
    rng = np.random.default_rng(4)
    x, h = rng.uniform(-4000.0, 4000.0, 200), rng.uniform(0.0, 400.0, 200)
    along, up = Downburst(*args).wind(x, h)
    for i in range(len(x)):
        wind(x[i], h[i], m, out)
        assert (along[i], up[i]) == pytest.approx((out[0], out[1]), abs=1e-9)
    gx, gh = np.meshgrid(np.linspace(0.0, 3000.0, 3001), np.linspace(1.0, 200.0, 200))
    a = Downburst(21.0, 915.0, 46.0).wind(gx, gh)[0]
    assert a.max() == pytest.approx(21.0, abs=1e-3) and gh.ravel()[a.argmax()] == pytest.approx(46.0, abs=1.0)
    assert Downburst().wind(gx, gh)[0].max() == 0.0


def test_flight_and_thresholds_are_read_from_the_run(run: Path) -> None:
    truth, tlm = load(run / "truth.tlog"), load(run / "tlm.tlog")
    assert has_windshear(tlm)
    [f] = flights(run, truth, tlm)
    assert f.name == "twinjet" and f.burst == Downburst(26.5, 915.0, 46.0, 0.0, 0.0)
    assert f.thresholds == {"caution_F": 0.12, "abort_F": 0.12, "caution_s": 1.5, "abort_s": 4.0}
    assert f.dt == pytest.approx(0.02) and f.abort > 0
    assert f.true[0, X] == pytest.approx(-4500.0) and f.true[0, H] == pytest.approx(350.0)
    assert np.abs(f.x[:, KD] - 1.0).max() < 0.3 and np.abs(f.x[100:, VA] - f.true[100:, VA]).max() < 2.0


def test_the_height_by_radio_is_a_signal(run: Path) -> None:
    """Ten a second, within scale, constant and noise of the grade."""
    [f] = flights(run, load(run / "truth.tlog"), load(run / "tlm.tlog"))
    [s] = radio_heights(Run(run))
    true = np.interp(s.t_us, f.t_us, f.true[:, H])
    assert s.path == "nav/twinjet/radio_height" and len(s.t_us) > 10 * SECONDS - 20
    assert 0.1 < np.abs(s.values - true).max() < 0.04 * 350.0 + 3.0


def test_the_hazard_index_is_the_energy_it_costs(run: Path) -> None:
    """F from the wind against F from thrust, drag and specific energy: d(h + V^2/2g)/dt = V ((T cos a - D)/W - F)."""
    [f] = flights(run, load(run / "truth.tlog"), load(run / "tlm.tlog"))
    s = slice(round(50.0 / f.dt), round(64.0 / f.dt))
    energy = f.true[s, H] + f.true[s, VA] ** 2 / (2.0 * 9.81)
    V, alpha, T = f.true[s, VA], f.true[s, 4], f.true[s, 6]
    e = f.state["elevator"][s]
    lift = 0.875 + 4.4 * alpha
    q = 0.5 * 1.225 * V * V * 91.04
    drag = q * (0.07925 + 0.043 * lift * lift + 1.5 * np.maximum(alpha - 0.2, 0.0) ** 2)
    excess = (T * 1e3 * np.cos(alpha) - drag) / (38500.0 * 9.81)
    rate = np.gradient(energy, f.dt) / V
    ours = np.convolve(excess - rate, np.ones(100) / 100.0, "valid")
    from_wind = np.convolve(f.F[s], np.ones(100) / 100.0, "valid")
    assert np.abs(ours - from_wind).max() < 0.02 and from_wind.max() > 0.2 and len(e) == len(V)


def test_figures(run: Path) -> None:
    s = compute(run)
    key = "windshear.twinjet."
    assert s[key + "valid_pct"] == 100.0 and s[key + "aborted"] is True and s[key + "by_hazard"] is True
    assert s[key + "w_x.rms_mps"] < 0.3 and s[key + "w_h.rms_mps"] < 0.22 and s[key + "F.slow.rms"] < 0.012
    assert s[key + "caution_s"] <= s[key + "abort_s"] and s[key + "abort_x_m"] < 0.0
    assert s[key + "height_min_m"] > 20.0
    assert not any(k.startswith(("contact.", "wind.tanker")) for k in s)
    json.dumps(s)


def test_recording_and_tabs(run: Path, tmp_path: Path) -> None:
    out = convert(run, tmp_path / "a.rrd", tab="windshear")
    assert out.stat().st_size > 100_000
    data = Run(run)
    [name] = data.names.values()
    met = are_signals(data, out, {}, frozenset({f"nav/{name}/alpha"}))  # drawn from the mission's message
    own = {"truth": ("w_x", "w_h", "F_quick", "climb", "thrust"), "nav": ("w_x", "F_slow", "path", "scale/lift", "nis")}
    assert {f"{k}/{name}/{q}" for k, keys in own.items() for q in keys} | {f"ctrl/{name}/elevator"} <= met
    both = data.align(f"nav/{name}/w_x")
    error = both[f"nav/{name}/w_x"] - both[f"truth/{name}/w_x"]
    assert np.abs(error).max() < 6.0 * data[f"nav/{name}/w_x_sigma"].values.max()
    assert set(data[f"guid/{name}/alert"].values) <= {"none", "monitor differs", "caution", "abort"}
    with pytest.raises(
        NoTabError, match="Windshear, Flight, Filter, Wind, Controls, Controller, Timing and filter, Sensors"
    ):
        convert(run, tmp_path / "b.rrd", tab="nothing")
    assert not (tmp_path / "b.rrd").exists()


def test_a_run_cut_short_still_gives_a_page(run: Path, tmp_path: Path) -> None:
    short = tmp_path / "short"
    short.mkdir()
    for name in ("truth.tlog", "tlm.tlog"):
        (short / name).write_bytes((run / name).read_bytes()[: 60_000 if name == "tlm.tlog" else 4_000])
    ended = CliRunner().invoke(app, ["metrics", str(short)])
    assert ended.exit_code in (0, 1)
    [f] = flights(run, load(run / "truth.tlog"), load(run / "tlm.tlog"))
    assert np.isfinite(f.low(1.5)).all() and f.first(f.true[:, WX] > 1e3) == -1


def test_orders_to_the_jet() -> None:
    assert order("go-around", None, None).target == 5 and order("go-around", None, 7).target == 7
    assert order("go-around", None, None).command == 191
    o, _ = fit(order("law", 1.0, 5), "windshear")
    assert (o.command, o.text) == (31012, "law pitch")
    with pytest.raises(CommandError, match="4 continue"):
        order("law", 5.0, 5)
    with pytest.raises(CommandError, match="takes no value"):
        order("go-around", 1.0, 5)
