"""Workers of a campaign: what they are forked with, what becomes of one that dies, what is said of their pace."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from urllib.parse import urlsplit

from hil_scripts.campaign.engine import pace, run_campaign
from hil_scripts.campaign.journal import read
from hil_scripts.campaign.study import Case
from tests.unit.campaign_demo import STUDY

ROOT = Path(__file__).resolve().parents[2]


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


def test_a_cluster_of_two_hosts_makes_the_same_rows(tmp_path: Path) -> None:
    """Dask's own scheduler and workers, as another would start them, the workers at two addresses of this machine."""
    port = socket.create_server(("127.0.0.1", 0)).getsockname()[1]
    at, env = f"tcp://127.0.0.1:{port}", {**os.environ, "PYTHONPATH": str(ROOT)}
    dask = (sys.executable, "-m")
    each = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(tmp_path))
    commands = [("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")]
    commands += [("distributed.cli.dask_worker", at, "--host", f"127.0.0.{h}", *each) for h in (2, 3)]
    running = [subprocess.Popen((*dask, *c), env=env, stderr=subprocess.DEVNULL) for c in commands]
    try:
        from distributed import Client  # slow to import: only where it is needed

        with Client(at, timeout=60) as client:
            client.wait_for_workers(2, timeout=60)
            hosts = {urlsplit(w).hostname for w in client.scheduler_info(n_workers=-1)["workers"]}
        assert hosts == {"127.0.0.2", "127.0.0.3"}
        there = run_campaign(STUDY, 3, 7, tmp_path / "there", scheduler=at, progress=False)
    finally:
        for p in running:
            p.kill()
            p.wait(30)
    here = run_campaign(STUDY, 3, 7, tmp_path / "here", workers=0, progress=False)
    assert there.complete and there.failed == here.failed
    assert (there.folder / "runs.parquet").read_bytes() == (here.folder / "runs.parquet").read_bytes()
