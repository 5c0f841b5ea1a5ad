"""Tables of digests: the same flight twice gives the same one; other bytes, other flights and what is no table are told apart."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightsw.strict import ConfigError
from hil_scripts.launch import hashes
from hil_scripts.launch.procs import StopFlag
from tests.sil.launch import sil


@pytest.fixture(scope="module")
def made() -> list[hashes.Table]:
    """Two tables of one second of one scenario, and one of another seed."""
    with StopFlag() as stop:
        return [hashes.table(["gust"], 1.0, seed, stop, lambda _: None) for seed in (3, 3, 4)]


def test_one_seed_one_table(made: list[hashes.Table], tmp_path: Path) -> None:
    hashes.write(tmp_path / "t.json", made[0])
    kept = hashes.read(tmp_path / "t.json")
    assert sorted(kept["logs"]) == [f"gust/{n}.tlog" for n in ("link_alexis", "link_reference", "tlm", "truth")]
    assert hashes.differences(kept, made[1]) == []
    assert hashes.differences({**kept, "seed": 4}, made[2]) == sorted(kept["logs"])


def test_only_what_flew_is_compared(made: list[hashes.Table]) -> None:
    more = {**made[0], "logs": {**made[0]["logs"], "windshear/truth.tlog": "0"}}
    assert hashes.differences(more, made[1]) == []
    less = {**made[0], "logs": {k: v for k, v in made[0]["logs"].items() if "truth" not in k}}
    assert hashes.differences(less, made[1]) == ["gust/truth.tlog"]


def test_tables_of_other_flights_are_refused(made: list[hashes.Table], tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="seed = 4: the table has seed = 3"):
        hashes.differences(made[0], made[2])
    (tmp_path / "t.json").write_text("[]")
    for args, words in (
        (["gust", "--against", tmp_path / "none.json"], "none.json: No such file"),
        (["gust", "--against", tmp_path / "t.json"], "t.json: not a table of digests"),
        (["gusts"], "did you mean 'gust'"),
    ):
        ended = sil("hash", *args)
        assert ended.code == 2 and words in ended.text
