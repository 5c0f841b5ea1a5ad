"""Files named by configurations, files written whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightsw.files import beside, write_whole
from flightsw.icd.overrun import overrun
from flightsw.strict import near


def test_a_path_lies_beside_its_configuration_then_in_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cfg").mkdir()
    (tmp_path / "cwd").mkdir()
    for folder in ("cfg", "cwd"):
        (tmp_path / folder / "both.toml").touch()
    (tmp_path / "cwd" / "only.toml").touch()
    monkeypatch.chdir(tmp_path / "cwd")
    config = tmp_path / "cfg" / "c.toml"
    assert beside(config, "both.toml") == str(tmp_path / "cfg" / "both.toml")
    assert beside(config, "only.toml") == str(tmp_path / "cwd" / "only.toml")
    assert beside(config, str(tmp_path / "cwd" / "both.toml")) == str(tmp_path / "cwd" / "both.toml")
    assert beside(config, "none.toml") == "none.toml"
    (tmp_path / "cfg" / "kc135r").touch()
    assert beside(config, "kc135r") == "kc135r"  # a name, whatever lies about


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "summary.json"
    write_whole(path, "old")
    write_whole(path, "new")
    assert path.read_text() == "new"

    def full(self: Path, text: str, encoding: str) -> int:
        self.touch()  # as open() does
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OSError, match=rf"{path}: cannot be written: No space left on device"):
        write_whole(path, "newer")
    with pytest.raises(OSError, match="cannot be written"):
        write_whole(tmp_path / "other.json", "first")
    assert [p.name for p in tmp_path.iterdir()] == ["summary.json"] and path.read_text() == "new"


def test_a_folder_that_is_gone_is_named(tmp_path: Path) -> None:
    with pytest.raises(OSError, match=r"gone/x\.json: cannot be written: No such file or directory"):
        write_whole(tmp_path / "gone" / "x.json", "")


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("sigma_mp", "; did you mean 'sigma_mps'?"),
        ("SIGMA_MPS", "; did you mean 'sigma_mps'?"),
        ("lm", "; did you mean 'L_m'?"),
        ("zzz", ""),
        (3, ""),
    ],
)
def test_the_closest_name_is_suggested(word: object, text: str) -> None:
    assert near(word, ["sigma_mps", "L_m", "axes"]) == text


def test_datagrams_the_kernel_dropped_are_counted(tmp_path: Path) -> None:
    """A socket nobody reads: what does not fit its buffer is lost, and told."""
    import socket

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as a, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as b:
        a.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        a.bind(("127.0.0.1", 0))
        assert overrun(a) == 0
        sent = 200
        for _ in range(sent):
            b.sendto(bytes(1000), a.getsockname())
        a.setblocking(False)
        got = 0
        with pytest.raises(BlockingIOError):
            while a.recv(2000):
                got += 1
        assert 0 < got < sent and overrun(a) == sent - got
        assert overrun(a, tmp_path / "none") == 0
