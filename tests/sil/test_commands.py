"""The command lines themselves: help, versions, lists, completion, and hints that are true."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

import flightsw.__main__
import sim_plant.__main__
from hil_scripts import shell, sil
from hil_scripts.campaign.registry import all_studies
from hil_scripts.launch import listing, screen
from hil_scripts.launch.places import PARAMS, SCENARIOS
from hil_scripts.launch.runfolder import resolve
from sim_plant.scenario import load_scenario

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = {"sil": sil.app, "flightsw": flightsw.__main__.app, "sim-plant": sim_plant.__main__.app}
COMMANDS = ("list", "run", "warmup", "replay", "bench", "campaign", "estimate", "identify")


def call(app: typer.Typer, *args: str) -> Result:
    return CliRunner().invoke(app, list(args), env={"COLUMNS": "200"})


@pytest.mark.parametrize("program", PROGRAMS)
def test_version(program: str) -> None:
    got = call(PROGRAMS[program], "--version")
    assert got.exit_code == 0 and re.fullmatch(r"wakefield \d+\.\d+\.\d+\n", got.output)


@pytest.mark.parametrize(("program", "args"), [*((p, ()) for p in PROGRAMS), *(("sil", (c,)) for c in COMMANDS)])
def test_help_by_either_name(program: str, args: tuple[str, ...]) -> None:
    short, long = (call(PROGRAMS[program], *args, flag) for flag in ("-h", "--help"))
    assert short.exit_code == long.exit_code == 0
    assert short.output == long.output and "Show this message and exit." in short.output


@pytest.mark.parametrize("program", PROGRAMS)
def test_completion_can_be_installed(program: str) -> None:
    assert "--install-completion" in call(PROGRAMS[program], "--help").output


def test_completion_knows_the_scenarios() -> None:
    assert shell.scenario_names("rend") == ["rendezvous", "rendezvous_to_contact"]


def test_help_keeps_square_brackets() -> None:
    """Of every program, however it is built: units in brackets are no markup."""
    for app in PROGRAMS.values():

        @app.command("probe-of-the-test", hidden=True)
        def probe(speed: float = typer.Option(0.0, help="speed [m/s] of event[0]")) -> None:
            """Angle [rad]."""

        try:
            text = call(app, "probe-of-the-test", "--help").output
        finally:
            app.registered_commands.pop()
        assert "speed [m/s] of event[0]" in text and "Angle [rad]." in text


def test_what_is_printed_keeps_square_brackets(capsys: pytest.CaptureFixture[str]) -> None:
    screen.console().print("event[0]: speed [m/s] [/] [bold]")
    screen.fail("list[str] [rad]")
    got = capsys.readouterr()
    assert got.out == "event[0]: speed [m/s] [/] [bold]\n" and got.err == "sil: list[str] [rad]\n"


def test_list_has_every_name_and_says_what_it_is() -> None:
    out = call(sil.app, "list").output
    for kind in listing.KINDS:
        assert f"{kind}: " in out
    rows = {kind: dict(rows()) for kind, (_, rows) in listing.KINDS.items()}
    assert set(rows["scenarios"]) == {p.stem for p in SCENARIOS.glob("*.toml")}
    assert set(rows["missions"]) == {p.stem for p in PARAMS.glob("*.toml")}
    assert set(rows["campaigns"]) == set(all_studies())
    assert {"kc135r", "learjet24", "alexis", "twinjet"} <= set(rows["aircraft"])
    for kind, names in rows.items():
        for name, text in names.items():
            assert name in out, (kind, name)
            assert len(text) > 10 and "\n" not in text, (kind, name, text)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("list", "aircaft"), "did you mean 'aircraft'?"),
        (("run", "refuelling"), "did you mean 'refueling'?"),
        (("campaign", "hofmann"), "did you mean 'hoffmann'?"),
        (("campaign", "lee_rotation", "--cases", "exakt"), "did you mean 'exact'?"),
        (("run", "refueling", "--set", "reciever.nav.q_wind=1"), "did you mean 'receiver'?"),
        (("run", "refueling", "--set", "plant.wind.dryden.sigma_mp=1"), "did you mean 'sigma_mps'?"),
        (("run", "refueling", "--set", "plant.wind.prevailing=soundng"), "did you mean 'sounding'?"),
        (("run", "refueling", "--set", "plant.aircraft.tanker.file=kc135"), "did you mean 'kc135r'?"),
        (("run", "refueling", "--set", "plant.aircraft.tankr.file=kc135r"), "did you mean 'tanker'?"),
        (("run", "refueling", "--set", "plant.aircraft.tanker.mission=tankr"), "did you mean 'tanker'?"),
        (("run", "refueling", "--set", "receiver.app.mission=reciever"), "did you mean 'receiver'?"),
        (("run", "refueling", "--set", "receiver.nav.q_wnd=0.4"), "did you mean 'q_wind'?"),
    ],
)
def test_a_misspelt_name_is_answered_with_the_closest(
    args: tuple[str, ...], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    got = call(sil.app, *args)
    assert got.exit_code == 2 and words in got.output and len(got.output.splitlines()) == 1, got.output
    assert not list(tmp_path.iterdir())


HINT = re.compile(
    r"\b(plant|tanker|receiver|alexis|reference|twinjet)\.((?:[A-Za-z]\w*\.)*[A-Za-z]\w*)=(\[.*\]|[^\s`\"']*[^\s`\"'.,)])"
)
HOME = {"alexis": "gust", "reference": "gust", "twinjet": "windshear"}  # scenario of an aircraft; else: refueling
TEXTS = (
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "README.md",
    ROOT / "hil_scripts" / "sil.py",
    ROOT / "hil_scripts" / "launch" / "runfolder.py",
)


def hints() -> list[tuple[str, tuple[str, ...]]]:
    """Scenario and the overrides shown for it, together where they stand in one command."""
    found = set()
    for path in TEXTS:
        for line in path.read_text().replace("\\\n", " ").splitlines():
            sets = [m for m in HINT.finditer(line) if "<" not in m[3]]
            if sets:
                named = re.search(r"sil run ([a-z_/.]+)", line)
                scenario = (
                    str(ROOT / named[1])
                    if named and "/" in named[1]
                    else named[1]
                    if named
                    else HOME.get(sets[0][1], "refueling")
                )
                found.add((scenario, tuple(f"{m[1]}.{m[2]}={m[3]}" for m in sets)))
    return sorted(found)


def test_there_are_hints_to_check() -> None:
    shown = {s for _, sets in hints() for s in sets}
    assert {"plant.wind.dryden.sigma_mps=1.0", "receiver.nav.q_wind=0.4", "twinjet.nav.turbulence=0"} <= shown


@pytest.mark.parametrize(("scenario", "sets"), hints())
def test_every_override_shown_to_the_user_is_accepted(
    scenario: str, sets: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "flightsw" / "aircraft" / "learjet24.toml", "my_jet.toml")  # docs/new-aircraft.md
    resolve(scenario, None, list(sets), 1.0)


def test_the_plants_own_hint_is_accepted() -> None:
    text = (ROOT / "sim_plant" / "__main__.py").read_text() + (ROOT / "sim_plant" / "README.md").read_text()
    shown = set(re.findall(r"\b([a-z]\w*(?:\.\w+)+)=([\w.]+)", text))
    assert shown
    load_scenario("refueling", dict(shown))


@pytest.mark.parametrize(
    "module, words",
    [
        ("flightsw.__main__", "--help"),
        ("sim_plant.__main__", "--help"),
        ("ground.__main__", "--help"),
        ("ground.__main__", "key --help"),
        ("hil_scripts.sil", "run --help"),
        ("hil_scripts.sil", "campaign --list"),
    ],
)
def test_a_help_or_a_list_needs_no_compiler(module: str, words: str) -> None:
    """Nor numpy: a tenth of a second instead of a half."""
    code = f"""
import sys
from {module} import main
sys.argv = ["program", *{words.split()}]
try:
    main()
except SystemExit:
    print("\\n", *{{"numba", "numpy", "scipy"}} & set(sys.modules))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    *said, needed = done.stdout.splitlines()
    assert len(said) > 5 and not needed.split()
