"""The append-only record of a campaign: one JSON line per run, on disk before the run counts as made.

A crash can only damage the last line; it is dropped at the next start and its run made again.
"""

from __future__ import annotations

import fcntl
import json
import os
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from hil_scripts.campaign.study import CampaignError
from hil_scripts.campaign.task import Row

FILE = "journal.jsonl"


def parse(data: bytes, where: object) -> tuple[list[Row], int]:
    """Rows of a journal's bytes and how many bytes of it are whole lines.

    Raises CampaignError naming the line when anything but the unfinished last line is damaged.
    """
    whole = data.rfind(b"\n") + 1
    rows: list[Row] = []
    for number, line in enumerate(data[:whole].splitlines(), 1):
        try:
            rows.append(Row(**json.loads(line)))
        except (ValueError, TypeError):
            raise CampaignError(f"{where}: line {number} is damaged; remove that line and resume") from None
    return rows, whole


def read(folder: Path) -> list[Row]:
    """Rows on record, without locking; none when there is no journal. Raises CampaignError, OSError."""
    path = folder / FILE
    return parse(path.read_bytes(), path)[0] if path.exists() else []


class Journal:
    """Context manager: the journal of folder `folder`, locked against a second campaign. `rows` is what it holds.

    Raises CampaignError when another process has it open, or it is damaged; OSError when it cannot be opened.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE
        self.rows: list[Row] = []
        self._file: BinaryIO | None = None

    def __enter__(self) -> Journal:
        f = open(self.path, "a+b")
        try:
            try:
                fcntl.flock(f, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise CampaignError(f"{self.path}: another campaign is writing to this folder") from None
            f.seek(0)
            self.rows, whole = parse(f.read(), self.path)
            f.truncate(whole)
        except BaseException:
            f.close()
            raise
        self._file = f
        return self

    def append(self, row: Row) -> None:
        """Write a row through to the disk. Raises OSError (disk full), the file then ends before or within this row."""
        assert self._file is not None
        self._file.write(json.dumps(asdict(row)).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        self.rows.append(row)

    def __exit__(self, tp: type[BaseException] | None, e: BaseException | None, tb: TracebackType | None) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None
