"""Workers of a campaign: what they are forked with, what becomes of one that dies, what is said of their pace."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

from hil_scripts.campaign.engine import pace, run_campaign
from hil_scripts.campaign.journal import read
from hil_scripts.campaign.study import Case
from tests.unit.campaign_demo import STUDY


def test_pace_says_rate_and_end() -> None:
    """30 runs in 60 s and 90 to go: 30 a minute, three minutes more, whatever the hour."""
    for _ in range(2):  # the minute may change under way
        then = datetime.now() + timedelta(minutes=3)
        said = pace(30, 90, 60.0)
        if said == f"30 a minute, ends about {then:%H:%M}":
            return
    raise AssertionError(said)


def test_a_worker_has_what_the_study_warmed(tmp_path: Path) -> None:
    """Workers are forked from a server that has called `warm`; one that raises costs nothing but the start."""
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "if __name__ == '__main__':\n"
        "    from pathlib import Path; import warmed\n"
        "    from hil_scripts.campaign.engine import run_campaign\n"
        "    run_campaign(warmed.STUDY, 2, 1, Path(sys.argv[1]) / 'c', workers=2, progress=False)\n"
    )
    (tmp_path / "warmed.py").write_text(
        "import os\n"
        "from hil_scripts.campaign.study import Case, RunResult, Study\n"
        "BY = []\n"
        "def warm():\n    BY.append(os.getpid())\n    raise OSError('nothing there')\n"
        "def run(case, seed):\n    return RunResult({'by': float(BY[0]), 'here': float(os.getpid())})\n"
        "STUDY = Study('warmed', 't', 'p', (Case('a'),), run, warm=warm)\n"
    )
    (tmp_path / "main.py").write_text(code)
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    subprocess.run([sys.executable, str(tmp_path / "main.py"), str(tmp_path)], check=True, timeout=120, env=env)
    rows = read(tmp_path / "c")
    assert [r.status for r in rows] == ["ok", "ok"]
    assert len({r.values["by"] for r in rows}) == 1 and all(r.values["by"] != r.values["here"] for r in rows)


def test_a_worker_that_dies_costs_one_run(tmp_path: Path) -> None:
    """A run that takes its process with it is a failed run; the others are made."""
    study = replace(STUDY, cases=(Case("dies", {"sigma": 1.0, "die": True}), Case("calm", {"sigma": 0.5})))
    done = run_campaign(study, 1, 7, tmp_path / "c", workers=1, progress=False)
    assert {r.case: r.status for r in read(done.folder)} == {"dies": "failed", "calm": "ok"}
    assert done.complete and done.failed == 1
