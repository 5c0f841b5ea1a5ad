"""A run folder holds everything it was flown with: it flies again, and replays, from anywhere."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

import pytest

from flightsw import aircraft
from flightsw.process.config import load_flight
from flightsw.strict import ConfigError
from hil_scripts.launch import inproc, keep, screen, tomlout
from hil_scripts.launch.procs import StopFlag
from hil_scripts.launch.replay_cmd import replay_run
from hil_scripts.launch.runfolder import RunPlan, make_folder, resolve
from sim_plant.scenario import load_scenario
from sim_plant.wind.prevailing import DATA

SECONDS = 1.0
LOGS = ("link_tanker.tlog", "link_receiver.tlog", "tlm.tlog", "truth.tlog")


def fly(plan: RunPlan, run: Path) -> dict[str, bytes]:
    with StopFlag() as stop:
        inproc.fly(plan, make_folder(plan, run), screen.console(quiet=True), stop)
    return logs(run)


def logs(run: Path) -> dict[str, bytes]:
    return {name: (run / name).read_bytes() for name in LOGS}


def user_files(folder: Path) -> Path:
    """A scenario with files of its own beside it: an aircraft based on another file, a sounding, a flight file on a base."""
    folder.mkdir()
    shutil.copy(aircraft.find("learjet24"), folder / "bare.toml")
    (folder / "mine.toml").write_text('base = "bare.toml"\n[limits]\nV_max_mps = 241.5\n')
    shutil.copy(DATA / "sounding_oun_20181222_12z_uwyo.txt", folder / "ascent.txt")
    (folder / "own_receiver.toml").write_text(
        f'base = "{Path(__file__).parents[2]}/flightsw/params/receiver.toml"\n[app]\naircraft = "mine.toml"\n'
    )
    text = (Path(__file__).parents[2] / "sim_plant/scenarios/refueling.toml").read_text()
    for old, new in (
        ('file = "learjet24"', 'file = "mine.toml"'),
        ('mission = "receiver"', 'mission = "own_receiver.toml"'),
        ('"sounding_oun_20181222_12z_uwyo.txt"', '"ascent.txt"'),
    ):
        assert old in text
        text = text.replace(old, new)
    (folder / "mine_too.toml").write_text(text)
    return folder / "mine_too.toml"


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, bytes]]:
    """A run with the user's files, moved elsewhere after the flight, the originals gone."""
    base = tmp_path_factory.mktemp("kept")
    scenario = user_files(base / "user")
    out = fly(resolve(str(scenario), 3, [], SECONDS), base / "run")
    shutil.rmtree(base / "user")
    shutil.move(base / "run", base / "elsewhere")
    return base / "elsewhere", out


def test_the_folder_names_and_holds_what_was_flown(flown: tuple[Path, dict[str, bytes]]) -> None:
    run, _ = flown
    names = {str(p.relative_to(run)) for p in run.rglob("*.t*") if p.parent != run}
    assert names == {"aircraft/kc135r.toml", "aircraft/mine.toml", "soundings/ascent.txt"}
    sc = tomllib.loads((run / "scenario.toml").read_text())
    assert [a["file"] for a in sc["aircraft"]] == ["aircraft/kc135r.toml", "aircraft/mine.toml"]
    assert sc["wind"]["sounding"] == "soundings/ascent.txt"
    flight = tomllib.loads((run / "flight_receiver.toml").read_text())
    assert (flight["app"]["aircraft"], flight["tanker"]) == ("aircraft/mine.toml", "aircraft/kc135r.toml")
    kept = tomllib.loads((run / "aircraft/mine.toml").read_text())
    assert kept["limits"]["V_max_mps"] == 241.5 and kept["geometry"] and "base" not in kept


def test_it_flies_again_from_another_folder_to_the_same_bytes(
    flown: tuple[Path, dict[str, bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, before = flown
    monkeypatch.chdir(tmp_path)
    plan = resolve(str(run / "scenario.toml"), None, [], None)
    assert plan.scenario_name == "refueling"
    assert fly(plan, tmp_path / "again") == before
    for name in ("scenario.toml", "flight_receiver.toml", "flight_tanker.toml", "aircraft/mine.toml"):
        assert (tmp_path / "again" / name).read_text() == (run / name).read_text()


def test_replay_repeats_it(
    flown: tuple[Path, dict[str, bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert all(r.ok for r in replay_run(flown[0]).values())


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("aircraft/kc135r.toml", "CD0 =", "CD0 = 0.0300 #"),
        ("aircraft/mine.toml", "CD0 =", "CD0 = 0.0300 #"),
        ("soundings/ascent.txt", None, None),
    ],
)
def test_the_files_in_the_folder_are_the_ones_flown(
    flown: tuple[Path, dict[str, bytes]], tmp_path: Path, name: str, old: str | None, new: str | None
) -> None:
    """And no others: whatever the package holds, a change in the folder changes the run."""
    run = tmp_path / "run"
    shutil.copytree(flown[0], run)
    text = (run / name).read_text()
    if old is None:  # the wind backs by 10 deg
        rows = [
            f"{x[:42]}{(float(x[42:49]) + 350) % 360:7.0f}{x[49:]}" if _is_level(x) else x for x in text.splitlines()
        ]
        changed = "\n".join(rows)
    else:
        changed = text.replace(old, str(new), 1)
    assert changed != text
    (run / name).write_text(changed)
    after = fly(resolve(str(run / "scenario.toml"), None, [], None), tmp_path / "again")
    assert {k for k, v in after.items() if v != flown[1][k]} == set(LOGS)


def _is_level(line: str) -> bool:
    try:
        return bool(float(line[42:49]) + float(line[49:56]) >= 0.0)
    except ValueError:
        return False


@pytest.mark.parametrize("name", ["aircraft/mine.toml", "soundings/ascent.txt"])
def test_a_file_missing_from_the_folder_is_named_and_not_replaced(
    flown: tuple[Path, dict[str, bytes]], tmp_path: Path, name: str
) -> None:
    run = tmp_path / "run"
    shutil.copytree(flown[0], run)
    (run / name).unlink()
    with pytest.raises(ConfigError, match=Path(name).name):
        make_folder(resolve(str(run / "scenario.toml"), None, [], None), tmp_path / "again")
    assert not (tmp_path / "again").exists()


def test_two_files_of_one_name_are_both_kept(tmp_path: Path) -> None:
    kept = keep.Kept()
    a, b = tmp_path / "a" / "x.toml", tmp_path / "b" / "x.toml"
    assert kept.name("aircraft", a, b"1") == kept.name("aircraft", a, b"1") == "aircraft/x.toml"
    assert kept.name("aircraft", b, b"2") == "aircraft/x-2.toml"
    kept.write(tmp_path)
    assert [(tmp_path / n).read_bytes() for n in kept.files] == [b"1", b"2"]


def test_programs_of_their_own_find_files_beside_the_configuration(
    flown: tuple[Path, dict[str, bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """sim-plant and flightsw started by hand, from another folder."""
    run = flown[0]
    monkeypatch.chdir(tmp_path)
    assert load_flight(run / "flight_receiver.toml").app.aircraft == str(run / "aircraft/mine.toml")
    sc = load_scenario(str(run / "scenario.toml"))
    assert [a.file for a in sc.aircraft] == [str(run / "aircraft/kc135r.toml"), str(run / "aircraft/mine.toml")]
    assert sc.load_aircraft()[1].limits.V_max_mps == 241.5


def test_a_folder_that_cannot_be_filled_is_not_left_half_filled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_tree: object) -> str:
        raise OSError(28, "No space left on device")

    plan = resolve("gust", None, [], 1.0)
    monkeypatch.setattr(tomlout, "dumps", full)
    with pytest.raises(ConfigError, match="No space left on device"):
        make_folder(plan, tmp_path / "run")
    assert not (tmp_path / "run").exists()
