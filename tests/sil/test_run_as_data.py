"""A run flown, stepped, opened and exported from Python: the bytes of `sil run`, the logs' arrays, other people's readers."""

from __future__ import annotations

import contextlib
import hashlib
import json
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from typer.testing import CliRunner

import hil_scripts
from flightsw.strict import ConfigError
from ground import Run
from ground.__main__ import app as ground
from ground.columns import load
from ground.frames import need
from hil_scripts import Flight, fly
from hil_scripts.launch import finish, screen
from hil_scripts.launch.flying import FlightError
from hil_scripts.launch.mission import Outcome
from hil_scripts.launch.procs import StopFlag
from hil_scripts.launch.runfolder import resolve
from tests.sil.conftest import Flown
from tests.sil.launch import sil

SECONDS = 3.0
NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "docs" / "notebooks").glob("*.ipynb"))


def digests(folder: Path) -> dict[str, str]:
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.glob("*.tlog"))}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return fly("gust", seed=3, duration=SECONDS, out=tmp_path_factory.mktemp("fly") / "run")


def test_fly_and_steps_leave_the_bytes_of_sil_run(run: Run, tmp_path: Path) -> None:
    args = ("gust", "--seed", 3, "--duration", SECONDS, "--in-process", "--no-rrd", "--json", "--out", tmp_path / "a")
    told = sil("run", *args)
    figures = json.loads(told.text[told.text.index("{\n") : told.text.rindex("}") + 1])
    assert told.code == 0 and figures["run.outcome"] == "completed" and figures["run.folder"] == str(tmp_path / "a")
    assert digests(tmp_path / "a") == digests(run.folder)
    with Flight("gust", seed=3, duration=SECONDS) as flight:
        while not flight.done:
            flight.step()
    assert flight.run is not None and flight.run.summary["run.outcome"] == "completed"
    assert digests(flight.run.folder) == digests(run.folder)


def test_a_flight_is_stepped_changed_commanded_and_begun_again(run: Run) -> None:
    flight = Flight("gust", seed=3, duration=SECONDS, step_s=0.2)
    plain = flight.step()
    assert flight.t_s == pytest.approx(0.2)
    seen = plain["alexis"]
    assert seen["HIL_SENSOR"]["zacc"] < 0.0 and "HIL_ACTUATOR_CONTROLS" in seen and "TRUTH" not in seen
    flight.send("alexis", "law", 0)
    for _ in range(4):
        flight.step({"alexis": {"flap": np.radians(5.0)}})
    with pytest.raises(ConfigError, match=r"'rudder_': allowed: aileron.*did you mean 'rudder'"):
        flight.step({"alexis": {"rudder_": 0.0}})
    with pytest.raises(ConfigError, match="action for 'alexi': allowed: alexis, reference"):
        flight.step({"alexi": {}})
    changed = flight.close()
    with pytest.raises(FlightError, match="closed"):
        flight.step()
    assert [e.text for e in changed.commands()][:2] == ["USER_2", "USER_2: ACCEPTED"]
    flap = changed["alexis/truth/controls/aileron"]  # of this aircraft the flap
    assert abs(flap.values[-1] - np.radians(5.0)) < np.radians(0.5)
    other = changed.align("reference/truth/V", "reference/truth/altitude")
    assert np.array_equal(other["reference/truth/V"], run["reference/truth/V"].values[: len(other)])  # untouched
    flight.reset(seed=3)
    while not flight.done:
        flight.step()
    assert digests(flight.close().folder) == digests(run.folder)


def test_bad_input_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no such name or file.*did you mean 'gust'"):
        fly("gusst")
    with pytest.raises(ConfigError, match=r"nav\.scal: unknown key.*did you mean 'scale'"):
        fly("gust", set={"alexis.nav.scal": 1.0}, out=tmp_path / "x")
    assert not (tmp_path / "x").exists()


def test_signals_are_what_the_logs_hold(run: Run) -> None:
    sysid = next(s for s, name in run.names.items() if name == "alexis")
    nav = load(run.folder / "tlm.tlog").tables[sysid, "NAV_STATE"]
    good = nav["valid"] != 0
    t, wind, unit = run["alexis/nav/wind"]
    assert unit == "m/s" and np.array_equal(t, nav.t_us[good] / 1e6) and np.array_equal(wind, nav["wind"][good])
    assert np.array_equal(run["nav/alexis/wind/e"].values, nav["wind"][good][:, 1])
    assert np.array_equal(run["message/alexis/NAV_STATE/V"].values, nav["V"])
    gyro = run["link/alexis/in/HIL_SENSOR/zgyro"]
    assert gyro.unit == "rad/s" and gyro.rate_hz == pytest.approx(50.0) and len(gyro) == round(SECONDS * 50)
    listed = {s.path: s for s in run.signals()}
    assert listed["nav/alexis/gust/alpha_w"].unit == "rad" and listed["truth/alexis/wind"].parts == ("n", "e", "d")
    assert set(run["guid/alexis/phase"].values) <= {"INIT", "GUST_HOLD", "GUST_ALLEVIATION"}
    with pytest.raises(KeyError, match="did you mean 'nav/alexis/wind'"):
        run["nav/alexis/wnd"]
    with pytest.raises(KeyError, match="an aircraft: alexis, reference"):
        run["nav/nobody/wind"]


def test_a_run_is_tables_words_and_settings(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    import polars as pl  # slow to import: only where it is needed

    both = run.align("alexis/nav/V")
    table = run.frame("alexis/nav/V", "alexis/truth/V", "alexis/guid/phase")
    assert list(table.columns) == ["nav/alexis/V", "truth/alexis/V", "guid/alexis/phase"] and table.index.name == "t"
    assert np.array_equal(table["truth/alexis/V"], both["truth/alexis/V"])
    assert isinstance(run.frame("alexis/nav/wind", kind="polars"), pl.DataFrame)
    with pytest.raises(ValueError, match="allowed: pandas, polars"):
        run.frame("alexis/nav/wind", kind="excel")
    with pytest.raises(ImportError, match=r"extra `data`: pip install 'wakefield\[data\]'"):
        need("no_such_module_of_anybody")
    assert any(e.kind == "phase" and e.who == "alexis" for e in run.events())
    assert run.keys["plant.meta.seed"] == 3 and run.summary["run.outcome"] == "completed"
    assert run.compare(run) == {}


@pytest.mark.parametrize("to", ["parquet", "csv", "mcap", "ulog"])
def test_exports_are_read_by_the_tools_they_are_for(run: Run, tmp_path: Path, to: str) -> None:
    out = tmp_path / f"out.{to}"
    said = CliRunner().invoke(ground, ["export", str(run.folder), "--to", to, "--out", str(out)])
    assert said.exit_code == 0, said.output
    wind, words = run["nav/alexis/wind"], run.events("phase")[0].text
    if to in ("parquet", "csv"):
        import pandas as pd

        read: Any = getattr(pd, f"read_{to}")
        table, texts = read(out / f"nav.alexis.NAV_STATE.{to}"), read(out / f"texts.{to}")
        t, north, found = table["t"].to_numpy(), table["wind/n"].to_numpy(), list(texts["text"])
        index = pd.read_csv(out / "signals.csv").set_index(["file", "column"])
        assert index.loc[(f"nav.alexis.NAV_STATE.{to}", "wind/n"), "unit"] == "m/s"
    elif to == "mcap":
        from mcap.reader import make_reader

        with out.open("rb") as f:
            reader = make_reader(f)
            rows = [json.loads(m.data) for _, _, m in reader.iter_messages(topics=["/nav/alexis/NAV_STATE"])]
            found = [json.loads(m.data)["message"] for _, _, m in reader.iter_messages(topics=["/texts"])]
        t, north = (np.array([r[k] for r in rows]) for k in ("t", "wind/n"))
    else:
        from pyulog import ULog

        log = ULog(str(out))
        data = log.get_dataset("nav_alexis_NAV_STATE").data
        t, north = data["timestamp"] / 1e6, data["wind_n"]
        found = [m.message.partition(": ")[2] for m in log.logged_messages]
        assert not log.file_corruption and log.initial_parameters["plant.meta.seed"] == 3
    assert np.allclose(t, wind.t, atol=1e-9) and np.allclose(north, wind.values[:, 0], rtol=1e-6)
    assert words in found


def test_signals_and_differences_as_json(run: Run) -> None:
    listed = json.loads(CliRunner().invoke(ground, ["signals", str(run.folder), "nav/*", "--json"]).stdout)
    assert {s["path"]: (s["unit"], s["rate_hz"]) for s in listed}["nav/alexis/wind"] == ("m/s", 10.0)
    same = json.loads(CliRunner().invoke(ground, ["diff", str(run.folder), str(run.folder), "--json"]).stdout)
    assert same["same"] and {log["log"] for log in same["logs"]} >= {"truth.tlog", "tlm.tlog"}
    assert json.loads(sil("keys", "gust", "alexis.nav.scale", "--json").text) == {"alexis.nav.scale": 0.3}
    assert "gust" in json.loads(sil("list", "scenarios", "--json").text)["scenarios"]
    replayed = sil("replay", run.folder, "--json").text
    assert json.loads(replayed[replayed.index("{\n") :])["same"] is True


def test_a_view_that_fails_costs_a_run_its_figures_alone(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ground.rrd import convert
    from ground.views.gust.view import VIEW

    def broken(*_: object) -> None:
        raise ZeroDivisionError("no span")

    monkeypatch.setattr(type(VIEW), "figures", broken)
    monkeypatch.setattr(type(VIEW), "draw", broken)
    plan = resolve("gust", 3, [], SECONDS)
    console = screen.console()
    with console.capture() as words, contextlib.ExitStack() as stack:
        stop = stack.enter_context(StopFlag())
        ended = Outcome("completed", "", SECONDS, 1.0)
        code = finish.finish(plan, run.folder, ended, False, console, stop, in_process=True)
    lines = [line for line in words.get().splitlines() if "wakefield.views" in line and "ground metrics" in line]
    assert lines == ["ground metrics: wakefield.views = 'gust': figures: ZeroDivisionError: no span"]
    summary = json.loads((run.folder / "summary.json").read_text())
    assert code == finish.EXIT_FAILED and summary["log.packets"] > 0 and "gust.alexis.a_z.rms_mps2" not in summary
    failed: list[str] = []
    convert(run.folder, tmp_path / "a.rrd", failed=failed)
    assert failed == ["wakefield.views = 'gust': draw: ZeroDivisionError: no span"]


@pytest.fixture
def quiet_plots() -> Iterator[None]:
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    with warnings.catch_warnings():
        yield
    plt.close("all")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebooks_run(path: Path, flown: Flown, monkeypatch: pytest.MonkeyPatch, quiet_plots: None) -> None:
    """Every cell, in order; in the place of its flights one of a few seconds, what it asks of them checked."""

    def short(scenario: str, *, seed: int, set: dict[str, Any] | None = None, duration: float | None = None) -> Run:  # noqa: A002
        resolve(scenario, seed, [f"{k}={json.dumps(v)}" for k, v in (set or {}).items()], duration)
        return Run(flown(scenario)[0])

    monkeypatch.setattr(hil_scripts, "fly", short, raising=False)
    cells = ["".join(c["source"]) for c in json.loads(path.read_text())["cells"] if c["cell_type"] == "code"]
    assert sum(bool(line.strip()) for cell in cells for line in cell.splitlines()) < 15
    names: dict[str, Any] = {}
    for cell in cells:
        exec(compile(cell, path.name, "exec"), names)  # noqa: S102 -- the notebook is the test
    assert names["a"].folder.is_dir()
