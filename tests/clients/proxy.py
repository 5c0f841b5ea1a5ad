"""MAVProxy in a process of its own, spoken to by its command line."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from tests.sil.launch import wait_for

PROGRAM = Path(sys.executable).parent / "mavproxy.py"


class Proxy:
    """Connected to telemetry ports; `before`: what runs it instead of Python alone; `ready`: what it says once it may be asked.
    Raises AssertionError if it does not."""

    def __init__(
        self, folder: Path, *ports: int, modules: str, before: Sequence[str] = (), ready: str = "Received"
    ) -> None:
        self._words, self._ready = folder / "said.txt", ready
        masters = [f"--master=udpout:127.0.0.1:{port}" for port in ports]
        options = ["--mav20", "--default-modules", modules, "--streamrate", "2", "--state-basedir", str(folder)]
        with self._words.open("wb") as f:
            self._process = subprocess.Popen(
                [sys.executable, *before, str(PROGRAM), *masters, *options],
                stdin=subprocess.PIPE, stdout=f, stderr=subprocess.STDOUT, cwd=folder,
            )  # fmt: skip

    def __enter__(self) -> Self:
        try:
            assert wait_for(lambda: self._ready in self.said(), 60.0), self.said()
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def said(self) -> str:
        """Everything it has printed."""
        return self._words.read_text(errors="replace")

    def ask(self, line: str, answer: str) -> None:
        """A line of its command line; AssertionError if what it prints does not match the pattern in 30 s."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n".encode())
        self._process.stdin.flush()
        assert wait_for(lambda: bool(re.search(answer, self.said())), 30.0), (line, self.said()[-3000:])

    def _end(self) -> None:
        self._process.kill()
        self._process.wait()
