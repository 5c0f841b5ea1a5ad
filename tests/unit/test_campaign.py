"""The campaign engine: same bytes for any number of workers and any interruption; failures recorded; clear refusals."""

from __future__ import annotations

import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flightsw import plugins
from hil_scripts import sil as launcher
from hil_scripts.campaign import registry
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.journal import FILE, Journal, read
from hil_scripts.campaign.registry import all_studies
from hil_scripts.campaign.study import CampaignError, Case, RunResult, Study, run_seed
from tests.unit.campaign_demo import STUDY

ROOT = Path(__file__).resolve().parents[2]
FILES = ("runs.parquet", "summary.json", "traces/calm.npz", "traces/G_0.3.npz")


def _hashes(folder: Path) -> dict[str, str]:
    return {f: hashlib.sha256((folder / f).read_bytes()).hexdigest() for f in FILES}


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demonstration study, five runs, in this process."""
    return run_campaign(STUDY, 5, 7, tmp_path_factory.mktemp("c") / "plain", workers=0, progress=False).folder


def test_seeds_are_pinned() -> None:
    """The rule never changes: old campaigns can be extended. 63 bits, no case in it."""
    assert [run_seed(7, "demo", i) for i in range(3)] == PINNED
    assert run_seed(8, "demo", 0) != PINNED[0] and run_seed(7, "other", 0) != PINNED[0]
    assert all(0 <= run_seed(s, "demo", i) < 2**63 for s in (-1, 0, 2**70) for i in range(20))


PINNED = [3247847810549477220, 80793256907152773, 2031599048494821217]


@pytest.mark.parametrize("workers", [1, 2])
def test_bytes_do_not_depend_on_workers(plain: Path, tmp_path: Path, workers: int) -> None:
    """Table, summary and traces are equal to the byte with 1 and 2 worker processes and without any."""
    done = run_campaign(STUDY, 5, 7, tmp_path / "w", workers=workers, progress=False)
    assert done.complete and done.rows == 15
    assert _hashes(done.folder) == _hashes(plain)


def test_interrupted_run_resumes_to_the_same_bytes(plain: Path, tmp_path: Path) -> None:
    """Stopped after four runs, the last journal line torn as a crash would leave it: resuming gives the same bytes."""

    class After:
        n = 0

        def __bool__(self) -> bool:
            self.n += 1
            return self.n > 4

    folder = tmp_path / "c"
    first = run_campaign(STUDY, 5, 7, folder, workers=0, progress=False, stop=After())
    assert not first.complete and first.made == 4
    assert json.loads((folder / "meta.json").read_text())["complete"] is False
    data = (folder / FILE).read_bytes()
    (folder / FILE).write_bytes(data[:-20])
    second = run_campaign(STUDY, 5, 7, folder, workers=0, progress=False)
    assert second.complete and second.made == 12
    assert _hashes(folder) == _hashes(plain)
    assert run_campaign(STUDY, 5, 7, folder, workers=0, progress=False).made == 0


def test_more_runs_and_cases_join(plain: Path, tmp_path: Path) -> None:
    """A few runs of one case first, then all: the same bytes as all at once."""
    run_campaign(STUDY, 2, 7, tmp_path / "c", workers=0, progress=False, cases=["G_0.3"])
    done = run_campaign(STUDY, 5, 7, tmp_path / "c", workers=0, progress=False)
    assert done.made == 13 and _hashes(done.folder) == _hashes(plain)


def test_failed_runs_are_recorded_and_not_dropped(plain: Path) -> None:
    """Each run of the unreliable case is in the table; those of odd seeds failed, with the study's own words."""
    import pyarrow.parquet as pq

    rows = [r for r in pq.read_table(plain / "runs.parquet").to_pylist() if r["case"] == "unreliable"]
    assert [r["run"] for r in rows] == list(range(5))
    for r in rows:
        assert r["seed"] == run_seed(7, "demo", r["run"]) and r["master_seed"] == 7
        odd = r["seed"] % 2 == 1
        assert (r["status"], r["reason"]) == (("failed", f"ValueError: seed {r['seed']} is odd") if odd else ("ok", ""))
        assert (r["default.rms"] is None) == odd
    summary = json.loads((plain / "summary.json").read_text())
    assert summary["unreliable.failed"] == sum(r["status"] == "failed" for r in rows) > 0
    assert summary["unreliable.runs"] == 5 and summary["unreliable.default.rms.n"] == 5 - summary["unreliable.failed"]


def test_all_cases_see_the_same_noise(plain: Path) -> None:
    """Run i has one seed, whatever the case."""
    rows = read(plain)
    assert all(len({r.seed for r in rows if r.run == i}) == 1 for i in range(5))


def test_result_of_a_wrong_kind_is_a_failed_run(tmp_path: Path) -> None:
    """Values must be numbers, the result a RunResult."""
    study = Study("wrong", "t", "p", (Case("a"), Case("b")), _wrong)
    run_campaign(study, 1, 1, tmp_path / "c", workers=0, progress=False)
    reasons = {r.case: r.reason for r in read(tmp_path / "c")}
    assert reasons == {
        "a": "TypeError: value 'x' is list, not a number",
        "b": "TypeError: the study returned dict, not RunResult",
    }


def _wrong(case: Case, seed: int) -> RunResult:
    return RunResult({"x": [1]}) if case.name == "a" else {"x": 1}  # type: ignore[dict-item,return-value]


def _refused(says: str, tmp: Path, study: Study = STUDY, seed: int = 7, **kw: object) -> None:
    with pytest.raises(CampaignError, match=says):
        run_campaign(study, 1, seed, tmp, workers=0, progress=False, **kw)  # type: ignore[arg-type]


def test_a_pattern_chooses_the_cases_it_fits() -> None:
    names = [c.name for c in STUDY.choose(["un*", "G_0.?"])]
    assert names == ["G_0.3", "unreliable"] and STUDY.choose(["*"]) == STUDY.cases
    many = replace(STUDY, cases=tuple(Case(f"c{i}") for i in range(1000)))
    with pytest.raises(
        CampaignError, match=r"known: c0, .*, c19, \.\.\. \(1000: `sil campaign demo --list`\); did you mean 'c99'"
    ):
        many.choose(["d99"])
    with pytest.raises(CampaignError, match=r"case 'x\*': study demo has no such case"):
        STUDY.choose(["calm", "x*"])


def test_refusals_name_what_is_allowed(plain: Path, tmp_path: Path) -> None:
    """Unknown case, folder of another study or seed, changed parameters, strange or unwritable folder."""
    _refused("case 'x': study demo has no such case; known: calm, G_0.3, unreliable", tmp_path, cases=["x"])
    _refused("holds a campaign of study demo, not else", plain, replace(STUDY, name="else"))
    _refused("holds a campaign of seed 7, not 8", plain, seed=8)
    _refused("case calm was run with", plain, replace(STUDY, cases=(Case("calm", {"sigma": 9.0}),)))
    (tmp_path / "mine.txt").write_text("")
    _refused("not empty and not a campaign folder", tmp_path)
    _refused("Not a directory", tmp_path / "mine.txt" / "c")
    with pytest.raises(CampaignError, match="letters, digits"):
        Case_ = replace(STUDY, cases=(Case("../x"),))
        Case_.choose(None)


def test_other_code_is_not_mixed_in_unasked(plain: Path, tmp_path: Path) -> None:
    """Runs of other code join only on demand; --fresh discards the old ones and nothing else in the folder."""
    folder = tmp_path / "c"
    run_campaign(STUDY, 1, 7, folder, workers=0, progress=False)
    meta = json.loads((folder / "meta.json").read_text())
    meta["identity"][-1]["code"] = "0" * 16
    (folder / "meta.json").write_text(json.dumps(meta))
    _refused("made by other code .code 0000000000000000 ->", folder)
    assert run_campaign(STUDY, 2, 7, folder, workers=0, progress=False, mixed_code=True).made == 3
    assert len(json.loads((folder / "meta.json").read_text())["identity"]) == 2
    (folder / "notes.txt").write_text("mine")
    assert run_campaign(STUDY, 5, 7, folder, workers=0, progress=False, resume=False).made == 15
    assert (folder / "notes.txt").exists() and _hashes(folder) == _hashes(plain)


def test_second_writer_is_refused(tmp_path: Path) -> None:
    """A folder has one writer at a time."""
    run_campaign(STUDY, 1, 7, tmp_path / "c", workers=0, progress=False)
    with Journal(tmp_path / "c"), pytest.raises(CampaignError, match="another campaign is writing"):
        run_campaign(STUDY, 2, 7, tmp_path / "c", workers=0, progress=False)


def test_damaged_journal_names_the_line(tmp_path: Path) -> None:
    """Damage before the last line is not guessed away."""
    run_campaign(STUDY, 1, 7, tmp_path / "c", workers=0, progress=False)
    lines = (tmp_path / "c" / FILE).read_text().splitlines()
    (tmp_path / "c" / FILE).write_text("\n".join([lines[0], "{oops", *lines[2:]]) + "\n")
    _refused("line 2 is damaged", tmp_path / "c")


SLOW = """
from dataclasses import replace
from hil_scripts.campaign.study import Case
from tests.unit.campaign_demo import STUDY as BASE
STUDY = replace(BASE, name="slow", cases=(Case("a", {"sigma": 1.0, "slow_s": 0.1}), Case("b", {"sigma": 1.0, "slow_s": 0.1})))
"""


@pytest.fixture
def cli(tmp_path: Path) -> list[str]:
    """Argument vector of `sil` with an installed package's study: slow, two cases. It stands in place of ours, which are many."""
    install(tmp_path / "package", "wakefield", SLOW, "slow = wakefield_module:STUDY")
    return [sys.executable, "-m", "hil_scripts.sil", "campaign"]


def install(site: Path, name: str, module: str, entry: str) -> None:
    """A package of one module `<name>_module` as pip leaves it in the folder `site`."""
    info = site / f"{name}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[wakefield.studies]\n{entry}\n")
    (site / f"{name}_module.py").write_text(module)


def _env(tmp: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": f"{tmp / 'package'}:{ROOT}", "NUMBA_DISABLE_JIT": "1", "COLUMNS": "200"}


@pytest.mark.parametrize(
    ("args", "code", "says"),
    [
        (["--list"], 0, "slow   2      5     Noise with known statistics"),
        (["fast"], 2, "study 'fast': no such study; known: slow"),
        (["slow", "--scheduler", "localhost"], 2, "expected tcp://HOST:PORT"),
        (["slow", "--scheduler", "tcp://127.0.0.1:1"], 2, "no connection: Connection refused"),
        (
            ["slow", "--cases", "a", "--runs", "2", "--workers", "0"],
            0,
            "slow-1: 2 runs on record, 2 made now, 0 failed",
        ),
        (["slow", "--runs", "few"], 2, "--runs few: allowed a number from 1, small"),
        (["all", "--cases", "a"], 2, "--cases are those of one study"),
        (["all", "--runs", "small", "--workers", "0"], 0, "slow-1: 2 runs on record, 2 made now, 0 failed"),
    ],
)
@pytest.mark.usefixtures("cli")
def test_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, args: list[str], code: int, says: str) -> None:
    """Exit codes and messages; a refused campaign leaves no folder."""
    with monkeypatch.context() as m:
        m.chdir(tmp_path)
        m.setattr(sys, "path", [str(tmp_path / "package"), *sys.path])
        plugins.look_again()
        r = CliRunner().invoke(launcher.app, ["campaign", *args], env={"COLUMNS": "200"})
    plugins.look_again()
    sys.modules.pop("wakefield_module", None)
    assert r.exit_code == code, r.output
    assert says in r.output and "Traceback" not in r.output
    assert (tmp_path / "campaigns").exists() == ("made now" in says)


@pytest.mark.parametrize(
    ("module", "entry", "says"),
    [
        ("1 / 0", "bad = own_module:STUDY", "'bad': own_module:STUDY cannot be imported: ZeroDivisionError"),
        ("", "bad = own_module:STUDY", "'bad': cannot be imported: module 'own_module' has no attribute 'STUDY'"),
        ("STUDY = (1,)", "bad = own_module:STUDY", "'bad': own_module:STUDY has a int; allowed: a Study, or a tuple"),
        (SLOW, "one = own_module:STUDY\ntwo = own_module:OTHER", "study name 'slow' is used twice (second time in own"),
        (SLOW, "lee = own_module:STUDY", "'lee' is declared by"),
    ],
)
def test_a_package_whose_study_cannot_be_had_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, entry: str, says: str
) -> None:
    """Whatever is wrong with somebody's entry point."""
    install(tmp_path / "package", "own", module + "\nOTHER = replace(STUDY)" * ("two" in entry), entry)
    monkeypatch.syspath_prepend(str(tmp_path / "package"))
    plugins.look_again()
    try:
        with pytest.raises(CampaignError, match=re.escape(says)):
            all_studies()
    finally:
        sys.modules.pop("own_module", None)
        monkeypatch.undo()
        plugins.look_again()


def test_small_cases_are_cases() -> None:
    for study in all_studies().values():
        assert study.choose(list(study.small_cases) or None) and study.small_runs >= 1


def test_the_list_of_studies_says_what_the_studies_say() -> None:
    """`python -m hil_scripts.campaign.registry` writes it anew; naming them imports none."""
    assert registry.written() == {path: path.read_text() for path in (registry.LIST, registry.CASES)}
    assert {n: (len(s.cases), s.default_runs, s.title, s.purpose) for n, s in all_studies().items()} == {
        n: x[3:] for n, x in registry.listed().items()
    }
    code = (
        "import sys; from hil_scripts.campaign.registry import cases; print(len(cases('lee')), 'numpy' in sys.modules)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said == f"{len(all_studies()['lee'].cases)} False\n"


def test_ctrl_c_keeps_what_was_made_and_leaves_no_process(cli: list[str], tmp_path: Path) -> None:
    """SIGINT to the whole group, as a terminal sends it: exit 130, rows on record, all processes gone, resumable."""
    args = ["slow", "--runs", "400", "--out", str(tmp_path / "c")]
    p = subprocess.Popen(
        [*cli, *args], cwd=tmp_path, env=_env(tmp_path), stderr=subprocess.PIPE, text=True, process_group=0
    )
    end = time.monotonic() + 60
    while len(read(tmp_path / "c")) < 3 and time.monotonic() < end:
        time.sleep(0.1)
    os.killpg(p.pid, signal.SIGINT)
    stderr = p.communicate(timeout=60)[1]
    assert p.returncode == 130 and "Traceback" not in stderr
    made = len(read(tmp_path / "c"))
    assert 3 <= made < 800 and json.loads((tmp_path / "c" / "meta.json").read_text())["complete"] is False
    with pytest.raises(ProcessLookupError):  # helpers of the interpreter end a moment after it
        while time.monotonic() < end:
            os.killpg(p.pid, 0)
            time.sleep(0.05)
