"""Compiled kernels are executed only from a folder nobody else can have written to."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from hil_scripts.launch import kernel_cache
from hil_scripts.shell import EXIT_CONFIG
from tests.sil.launch import sil as call


def test_a_folder_everybody_writes_to_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel_cache.refuse_foreign(tmp_path)
    tmp_path.chmod(0o777)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    with pytest.raises(OSError, match=r"everybody may write there \(mode 777\)"):
        kernel_cache.cache_dir()
    ended = call("list", "missions")
    assert ended.code == EXIT_CONFIG and "everybody may write there" in ended.text


def test_a_folder_of_another_user_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: own + 1)
    with pytest.raises(OSError, match=rf"compiled kernels of another user \(id {own}\) are not executed"):
        kernel_cache.refuse_foreign(tmp_path)
