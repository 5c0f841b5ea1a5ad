"""Programs started as a fork of the launcher: as if their command had been given, and with nothing of the launcher's."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]

LAUNCHER = """
import json, sys, time
import sim_plant.scenario  # something the child may not have
from hil_scripts.launch import forked
from hil_scripts.launch.procs import StopFlag, Supervisor
forked.prepare()
forked.STRANGERS["tests.sil.forked_program"] = ("sim_plant",)
secret = open(sys.argv[1])
with StopFlag() as stop, Supervisor() as sup:
    got = []
    assert forked.possible()
    first = sup.start("first", [sys.executable, "-m", "tests.sil.forked_program"], env={"FORKED_TEST": "0"})
    child = sup.start("second", [sys.executable, "-m", "tests.sil.forked_program", "--x", "1"], got.append, {"FORKED_TEST": "7"})
    assert isinstance(child.popen, forked.Forked)
    assert sup.wait([first, child], 30.0)
    sup.newly_ended()
    print(json.dumps({"code": child.popen.returncode, "said": got[0], "tail": list(child.tail)}))
"""


def test_a_forked_program_is_what_its_command_would_start(tmp_path: Path) -> None:
    secret = tmp_path / "launcher_file"
    secret.write_text("x")
    r = subprocess.run([sys.executable, "-c", LAUNCHER, secret], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert r.returncode == 0, r.stderr
    answer = json.loads(r.stdout)
    assert answer["code"] == 5 and answer["tail"] == ["words"]
    said = answer["said"]
    assert said["argv"] == ["tests.sil.forked_program", "--x", "1"] and said["env"] == "7"
    assert said["group"] and said["default"]
    assert said["others"] == [], "a file of the launcher's, or a pipe of its sibling's"
    assert said["kept"] == [] and said["closed"] == "sim_plant is not for this program"


# a second thread in the launcher: it may not fork, and starts interpreters instead
THREADED = """
import sys, threading
threading.Thread(target=threading.Event().wait, daemon=True).start()
from hil_scripts.launch import forked
assert not forked.possible()
from hil_scripts.sil import main
main()
"""


def test_forked_and_started_afresh_leave_the_same_bytes(tmp_path: Path, port_offset: int) -> None:
    args = [
        "run",
        "windshear",
        "--duration",
        "0.5",
        "--no-rrd",
        "--seed",
        "3",
        "--port-offset",
        str(port_offset),
        "--out",
    ]
    for name, program in (("forked", ["-m", "hil_scripts.sil"]), ("afresh", ["-c", THREADED])):
        argv = [sys.executable, *program, *args, tmp_path / name]
        r = subprocess.run(argv, cwd=ROOT, capture_output=True, text=True, timeout=120)
        assert r.returncode == 0, r.stdout + r.stderr
    logs = sorted(p.name for p in (tmp_path / "forked").glob("*.tlog"))
    assert len(logs) == 3
    for name in logs:
        assert (tmp_path / "forked" / name).read_bytes() == (tmp_path / "afresh" / name).read_bytes(), name
