"""Views: shared parts of the ground name no mission, and a view of somebody else's package is shown like ours."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader
from typer.testing import CliRunner

from flightsw import plugins
from flightsw.icd.tlog import TlogWriter
from flightsw.icd.wire import Sender
from flightsw.strict import ConfigError
from ground.__main__ import app
from ground.link import live
from ground.link.command import CommandError, fit, offered, order
from ground.metrics import ViewError, compute
from ground.rrd import convert
from ground.rrd.blueprint import NoTabError
from ground.views import registry
from tests.drawn import rows

GROUND = Path(registry.__file__).parents[1]
MISSIONS = r"gust|wind.?shear|rendezvous|join.?up|refuel|airdata|tanker|receiver|tacan|microburst"
WORKS = r"\b(sevil|rivard|hoffmann|jing|lee)\b"
STUDIES = {"grades", "identify", "integrity"}  # reports of no published work, with a name that is an everyday word
ALLOWED: dict[str, set[str]] = {}  # file -> words it may have, with the reason beside it; none is needed today
SYSID, HZ, SECONDS = 7, 10, 20
VIEW = '''
"""A glider that reports its climb in VFR_HUD, which no view of ours reads."""

import numpy as np

from ground.views.base import Command, Value, View, Words


class Glider(View):
    aircraft = {7: "glider"}
    alarms = {"VFR_HUD": lambda f: "sinking" if f["climb"] < -2.0 else ""}
    commands = (
        Command("ballast", 31014, ("gust",), 7, value=Value(1, 20.0, "kg")),
        Command("law", 31014, ("tanker",), 7, value=Value(0, 0.0, choices={9: "spiral"})),
    )

    def finds(self, tlm):
        return tlm.get(7, "VFR_HUD") is not None

    def counts(self, tlm, sysid, t_us):
        return t_us >= 5_000_000

    def figures(self, run):
        return {"glider.climb_mean_mps": float(run.tlm.tables[7, "VFR_HUD"]["climb"].mean(dtype=np.float64))}

    def layout(self, run, look):
        from ground.rrd.layout import Layout, Plots
        import rerun.blueprint as rrb

        plot = Plots(*look.span).plot("climb [m/s]", ["nav/glider/climb"])
        return Layout(1, [rrb.Vertical(plot, name="Thermals")], lanes=["guid/glider/lift"], states={"up": (1, 2, 3)})

    def draw(self, sink, run):
        t = run.tlm.tables[7, "VFR_HUD"]
        sink.series("nav/glider/climb", t.t_us, t["climb"], "climb", (255, 255, 255))
        sink.states("guid/glider/lift", t.t_us, ["up" if c > 0 else "down" for c in t["climb"]], {})
        sink.series("truth/glider/V", t.t_us[:3], t["airspeed"][:3], "own drawing", (255, 255, 255))

    def words(self, heard):
        hud, last = heard.get("VFR_HUD"), heard.alarm("VFR_HUD")
        said = f"{hud['climb']:+.1f} m/s" + (f", was {last[0]}" if last else "") if hud else ""
        return [Words("climb", "VFR_HUD", said, bad=bool(last))] if hud else []


VIEW = Glider()
'''


def install(site: Path, module: str, entry: str) -> None:
    """A package with the module `glider_view` as pip leaves it in the folder `site`."""
    info = site / "glider-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: glider\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[wakefield.views]\n{entry}\n")
    (site / "glider_view.py").write_text(module)


def forget() -> None:
    """What is remembered of the packages installed."""
    plugins.look_again()
    for remembered in (registry.views, live.own_time, live.alarms):
        remembered.cache_clear()
    sys.modules.pop("glider_view", None)


Installer = Callable[[str, str], None]


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Installer]:
    """Installs a package with a view for one test."""

    def put(module: str, entry: str) -> None:
        install(tmp_path / "site", module, entry)
        monkeypatch.syspath_prepend(str(tmp_path / "site"))
        forget()

    yield put
    monkeypatch.undo()
    forget()


@pytest.fixture
def glider(installed: Installer) -> None:
    """The glider's view."""
    installed(VIEW, "glider = glider_view:VIEW")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the glider alone, without a scenario: truth, its message, a wind estimate 1 m/s off to the north."""
    out = tmp_path_factory.mktemp("glider")
    truth, tlm = TlogWriter(out / "truth.tlog"), TlogWriter(out / "tlm.tlog")
    plant, craft = Sender(SYSID, 190), Sender(SYSID, 1)
    for k in range(HZ * SECONDS + 1):
        t = k * 1_000_000 // HZ
        truth.write(t, plant.named("TRUTH", time_usec=t, V=30.0, q_nb=(1.0, 0.0, 0.0, 0.0), wind_n=(3.0, 4.0, 0.0)))
        tlm.write(t, craft.named("VFR_HUD", airspeed=30.0, climb=-3.0 if k == 30 else 1.0))
        tlm.write(t, craft.named("NAV_STATE", time_usec=t, valid=1, wind=(4.0, 4.0, 0.0), wind_sigma=(1.0, 1.0, 1.0)))
        tlm.write(t, craft.named("MISSION_STATUS", time_usec=t, phase=0))
    truth.close()
    tlm.close()
    return out


def blueprint(rrd: Path) -> str:
    """Everything the recording's blueprint says (in the file it is compressed)."""
    reader = RrdReader(str(rrd))
    [entry] = reader.blueprints()
    return " ".join(str(c.to_record_batch().to_pydict()) for c in reader.stream(store=entry))


def test_shared_files_name_no_mission_and_no_work() -> None:
    views = {p.parent.name for p in GROUND.glob("views/*/__init__.py")}
    works = {p.parent.name for p in GROUND.glob("report/*/__init__.py")}
    rooms = {GROUND / "views" / v for v in views} | {GROUND / "report" / w for w in works}
    assert len(views) >= 6 and set(re.findall(r"\w+", WORKS)) >= works - STUDIES
    named = {}
    for path in sorted(GROUND.rglob("*.py")):
        if rooms & set(path.parents):
            continue
        found = {m.group(0).lower() for m in re.finditer(f"{MISSIONS}|{WORKS}", path.read_text(), re.IGNORECASE)}
        if found - ALLOWED.get(str(path.relative_to(GROUND)), set()):
            named[str(path.relative_to(GROUND))] = found
    assert named == {}


def test_seams_are_typed() -> None:
    for name in ("views/base.py", "views/registry.py", "report/base.py", "rrd/layout.py"):
        assert not re.search(r"\b(Any|getattr|hasattr)\b", (GROUND / name).read_text()), name


def test_every_view_of_ours_is_declared_and_finds_nothing_in_an_empty_log() -> None:
    from ground.columns import Columns

    assert {p.parent.name for p in GROUND.glob("views/*/view.py")} <= set(registry.views())
    assert registry.found(Columns()) == {}
    assert registry.usual_names() == {1: "tanker", 2: "receiver"}


@pytest.mark.usefixtures("glider")
def test_figures_of_a_view_stand_beside_the_common_ones(run: Path) -> None:
    found = compute(run)
    assert found["glider.climb_mean_mps"] == pytest.approx(1.0 - 4.0 / (HZ * SECONDS + 1))
    assert found["wind.glider.samples"] == HZ * (SECONDS - 5) + 1  # from where the view says that they count
    assert found["wind.glider.rms_mps.n"] == pytest.approx(1.0) and found["wind.glider.rms_mps.e"] == pytest.approx(0.0)
    assert found["link.dropped"] == 0 and "log.truth.end_s" in found
    assert not [k for k in found if re.search(MISSIONS, k) or k.startswith("contact.")]


def test_without_its_view_a_run_has_the_common_figures(run: Path) -> None:
    forget()
    found = compute(run)
    assert found["wind.aircraft7.samples"] == 0  # of 20 s, all within the settling time
    assert not [k for k in found if k.startswith(("glider.", "contact."))]


@pytest.mark.usefixtures("glider")
def test_tab_lanes_and_entities_of_a_view_are_in_the_recording(run: Path, tmp_path: Path) -> None:
    out = convert(run, tmp_path / "a.rrd", tab="thermals")
    have, rows_of = rows(out), HZ * SECONDS + 1
    assert have["/nav/glider/climb"] == rows_of and "/guid/glider/lift" in have
    assert have["/truth/glider/wind/n"] == rows_of and "/guid/glider/phase" in have and "/nav/glider/wind/n" in have
    assert have["/truth/glider/V"] == 3  # as the view has drawn it, not as the common part would
    assert "Thermals" in blueprint(out) and "climb [m/s]" in blueprint(out)
    with pytest.raises(NoTabError, match="Thermals, Wind, Flight, Controls, Timing and filter, Sensors"):
        convert(run, tmp_path / "b.rrd", tab="nothing")


@pytest.mark.usefixtures("glider")
def test_words_and_alarms_of_a_view_are_on_the_monitor() -> None:
    send, monitor = Sender(SYSID, 1), live.Monitor(clock=lambda: 0.0)
    for k, climb in enumerate((1.0, -3.0, 2.0)):
        monitor.take(send.named("NAV_STATE", time_usec=(k + 1) * 100_000, valid=1))
        monitor.take(send.named("VFR_HUD", climb=climb))
    [line] = monitor.lines()
    assert line.startswith("glider: ") and "speed 0.0 m/s" in line and "climb +2.0 m/s, was sinking" in line
    [vehicle] = monitor.vehicles.values()
    assert vehicle.alarm("VFR_HUD") == ("sinking", 200_000)
    assert [said.bad for said in live.describe(vehicle, 0.0) if said.label == "climb"] == [True]


@pytest.mark.usefixtures("glider")
def test_words_of_a_view_are_sent() -> None:
    what = order("ballast", 25.0, None)
    assert (what.target, what.command, what.params[:3], what.text) == (7, 31014, (0.0, 25.0, 0.0), "ballast 25 kg")
    assert fit(what, "gust") == (what, "") and fit(what, None) == (what, "")
    assert "of gust; this aircraft flies windshear" in fit(what, "windshear")[1]
    with pytest.raises(
        CommandError, match="ballast needs a value in kg greater than 0, for example: ground send ballast"
    ):
        order("ballast", None, None)
    with pytest.raises(CommandError, match=r"law needs a number .* and an aircraft"):
        order("law", 9.0, None)  # two of the three do not say where it goes
    law = order("law", 9.0, 1)  # three views have the word now
    assert law.command == 0 and fit(law, "tanker")[0].text == "law spiral"
    assert fit(order("law", 1.0, 1), "gust")[0].text == "law alleviation"
    assert "tanker has 9 spiral" in fit(order("law", 1.0, 1), "tanker")[1]
    assert (
        len(offered()["law"]) == 3
        and "ballast: gust; kg; usual sysid 7" in CliRunner().invoke(app, ["send", "list"]).stdout
    )


@pytest.mark.parametrize(
    ("module", "entry", "says"),
    [
        ("VIEW = 1", "glider = glider_view:VIEW", "'glider': glider_view:VIEW is a int; allowed: a View"),
        ("", "glider = glider_view:VIEW", "'glider': cannot be imported"),
        (
            VIEW.replace("glider.climb_mean_mps", "loop.slips"),
            "glider = glider_view:VIEW",
            "'glider': figure 'loop.slips' is another's",
        ),
    ],
)
def test_a_view_that_cannot_be_had_is_named(
    installed: Installer, run: Path, module: str, entry: str, says: str
) -> None:
    installed(module, entry)
    with pytest.raises(ConfigError, match=f"wakefield.views = {says}"):
        compute(run)


def test_a_word_of_the_program_itself_is_not_a_views(installed: Installer) -> None:
    installed(VIEW.replace('"ballast"', '"inject"'), "glider = glider_view:VIEW")
    with pytest.raises(ConfigError, match="'glider': command 'inject' is one of `ground send` itself"):
        offered()


def test_a_view_that_fails_is_named(installed: Installer, run: Path) -> None:
    installed(VIEW.replace(".mean(dtype=np.float64)", ".no_such_thing()"), "glider = glider_view:VIEW")
    with pytest.raises(ViewError, match=r"wakefield\.views = 'glider': figures: AttributeError: .*no_such_thing"):
        compute(run)


def test_two_views_that_draw_one_path_are_refused(installed: Installer, run: Path, tmp_path: Path) -> None:
    installed(VIEW + "OTHER = Glider()\n", "glider = glider_view:VIEW\nother = glider_view:OTHER")
    with pytest.raises(ConfigError, match="nav/glider/climb is drawn twice"):
        convert(run, tmp_path / "a.rrd")


def test_times_that_count_come_from_the_first_view_that_says() -> None:
    from ground.columns import Columns
    from ground.views.refueling.view import VIEW as REFUELING

    t_us = np.arange(3, dtype=np.int64)
    assert REFUELING.counts(Columns(), 1, t_us) is None
    counts = REFUELING.counts(Columns(), 2, t_us)
    assert counts is not None and not counts.any()  # a receiver that does not measure
