"""The complete dialect is one that stock tools load: its module decodes ours and theirs, mavutil takes it by name."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pymavlink
import pytest

from flightsw.icd import wire
from flightsw.icd.tlog import GROUND_OUT, TlogWriter
from ground.dialect import DialectError, complete, merged, stock_folder

from .conftest import extreme
from .generated import module


@pytest.fixture(scope="module")
def made() -> str:
    return complete(".py")


def test_its_module_decodes_every_message_of_ours_and_those_of_common(made: str) -> None:
    m = module("wakefield_complete", made)
    for name in wire.BY_NAME:
        [got] = m.MAVLink(None, 1, 1).parse_buffer(wire.Sender(3, 1).named(name, **extreme(name, 1)))
        assert got.get_type() == name
    assert m.MAVLINK_MSG_ID_BATTERY_STATUS == 147  # of common, not of ours


def test_mavlogdump_takes_it_by_its_name(made: str, tmp_path: Path) -> None:
    (tmp_path / "wakefield.py").write_text(made)
    log = TlogWriter(tmp_path / "a.tlog")
    for k in range(3):
        log.write(1_000_000 * k, wire.Sender(1, 1).named("TRUTH", time_usec=1_000_000 * k, V=195.5), GROUND_OUT)
    log.close()
    tool = Path(pymavlink.__file__).parent.parent / "pymavlink" / "tools" / "mavlogdump.py"
    tool = tool if tool.exists() else Path(sys.executable).parent / "mavlogdump.py"
    code = (
        "import os, runpy, sys; os.environ['MAVLINK20'] = '1'; import pymavlink.dialects.v20 as d;"
        "d.__path__.append(sys.argv[1]); log, tool = sys.argv[2:];"
        "sys.argv = ['mavlogdump.py', '--dialect', 'wakefield', '--robust', log]; runpy.run_path(tool, run_name='__main__')"
    )
    r = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path), str(tmp_path / "a.tlog"), str(tool)],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert r.returncode == 0, r.stderr
    lines = [line for line in r.stdout.splitlines() if "TRUTH {" in line]
    assert len(lines) == 3 and "V : 195.5" in lines[0]


def test_what_common_has_is_left_to_it_and_other_files_are_refused() -> None:
    text = merged(stock_folder())
    assert 'name="HEARTBEAT"' not in text and 'name="TRUTH"' in text and 'name="MAV_CMD_USER_1"' not in text
    with pytest.raises(DialectError, match=r"allowed: a file that ends in \.py, \.lua, \.xml"):
        complete(".txt")
