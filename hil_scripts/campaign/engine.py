"""Run a campaign: decide what is missing, make it, write it down, sum it up."""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from hil_scripts.campaign import folder as fo
from hil_scripts.campaign import table
from hil_scripts.campaign.journal import Journal, read
from hil_scripts.campaign.pool import Pool, make_pool
from hil_scripts.campaign.study import CampaignError, Study, run_seed
from hil_scripts.campaign.task import Job, Row
from hil_scripts.launch import screen

POLL_S = 0.2  # [s] also the reaction time to Ctrl-C
PLAIN_EVERY_S = 15.0  # [s] between progress lines when the output is not a terminal
LOCAL_WORKERS = 2


@dataclass(frozen=True)
class Outcome:
    """How a campaign stands: rows on record, how many of them failed, how many this session made, whether all are there."""

    folder: Path
    rows: int
    failed: int
    made: int
    complete: bool


class _Board:
    """Progress bar on a terminal, a line every few seconds elsewhere, nothing when not wanted."""

    def __init__(self, console: Console, wanted: list[Job], rows: list[Row], show: bool) -> None:
        keys = {(j.case.name, j.run) for j in wanted}
        have = [r for r in rows if (r.case, r.run) in keys]
        self._console, self._show, self._total, self._done = console, show, len(keys), len(have)
        self._failed = sum(r.status != "ok" for r in have)
        self._before, self._began = self._done, time.monotonic()
        self._last = self._began
        columns = (BarColumn(bar_width=30), MofNCompleteColumn(), TextColumn("runs {task.fields[text]}"))
        self._bar = Progress(*columns, TimeElapsedColumn(), console=console, transient=True)
        self._task = self._bar.add_task("runs", total=self._total, completed=self._done, text="")

    def __enter__(self) -> _Board:
        if self._show and self._console.is_terminal:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._show and self._console.is_terminal:
            self._bar.stop()

    def took(self, row: Row) -> None:
        """Count a finished run."""
        self._done += 1
        self._failed += row.status != "ok"
        text = pace(self._done - self._before, self._total - self._done, time.monotonic() - self._began)
        text += f", {self._failed} failed" if self._failed else ""
        self._bar.update(self._task, completed=self._done, text=text)
        if not self._show or self._console.is_terminal:
            return
        if time.monotonic() - self._last > PLAIN_EVERY_S:
            self._last = time.monotonic()
            self._console.print(f"{self._done}/{self._total} runs, {text}")


def pace(made: int, left: int, elapsed_s: float) -> str:
    """Runs a minute of `made` in elapsed_s [s], and the local time at which `left` more are made at that rate."""
    rate = made / max(elapsed_s, 1e-3)
    return f"{60.0 * rate:.3g} a minute, ends about {datetime.now() + timedelta(seconds=left / rate):%H:%M}"


def run_campaign(
    study: Study,
    runs: int | None,
    master_seed: int,
    out_dir: Path | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    resume: bool = True,
    progress: bool = True,
    *,
    cases: list[str] | None = None,
    mixed_code: bool = False,
    stop: Any = None,
    console: Console | None = None,
) -> Outcome:
    """Make the missing runs of `study`, `runs` per case, into the campaign folder `out_dir`.

    scheduler: address of a Dask cluster; without it `workers` local processes (2; 0 makes the runs in this process).
    resume: go on with what the folder holds; False discards it. mixed_code: go on although the code has changed.
    stop: something true once the campaign shall end early (StopFlag); what was made is kept and summed up.
    Results depend on (study, code, master_seed, run index, case) only. Raises CampaignError on bad input, a folder that
    cannot be used, or a lost cluster; every run finished until then is on record.
    """
    runs = study.default_runs if runs is None else runs
    workers = LOCAL_WORKERS if workers is None else workers
    if runs < 1 or workers < 0:
        raise CampaignError(f"runs = {runs}, workers = {workers}: at least 1 run and 0 workers")
    chosen = study.choose(cases)
    out = fo.default_folder(study, master_seed) if out_dir is None else out_dir
    old = fo.read_meta(out)
    if old is not None:
        fo.check_owner(out, old, study, master_seed)
        if resume:
            fo.check_same(out, old, chosen, mixed_code)
    keep = old if resume else None
    wanted = [Job(c, i, run_seed(master_seed, study.name, i), keep=i == 0) for i in range(runs) for c in chosen]
    pool: Pool | None = None
    try:
        missing = _missing(wanted, read(out) if keep else [])
        if missing:  # before anything is written: a cluster that does not answer leaves no trace
            pool = make_pool(study, min(workers, len(missing)), scheduler)
        out.mkdir(parents=True, exist_ok=True)
        if not resume:
            with Journal(out):  # nobody else is writing to what is about to go
                fo.clear(out)
        with Journal(out) as journal:
            meta = fo.new_meta(keep, study, master_seed, runs, chosen)
            fo.write_meta(out, meta)
            board = _Board(console or screen.console(), wanted, journal.rows, progress)
            return _run(study, wanted, pool, out, journal, meta, stop, board)
    except OSError as e:
        raise CampaignError(f"campaign folder {out}: {e.strerror or e} ({e.filename or 'writing'})") from None
    finally:
        if pool is not None:
            pool.close()


def _missing(wanted: list[Job], rows: list[Row]) -> list[Job]:
    have = {(r.case, r.run) for r in rows}
    return [j for j in wanted if (j.case.name, j.run) not in have]


def _run(
    study: Study,
    wanted: list[Job],
    pool: Pool | None,
    out: Path,
    journal: Journal,
    meta: dict[str, Any],
    stop: Any,
    board: _Board,
) -> Outcome:
    before, t0 = len(journal.rows), time.monotonic()
    try:
        if pool is not None:
            with board:
                _work(_missing(wanted, journal.rows), pool, out, journal, stop, board)
    finally:  # also after Ctrl-C or a lost cluster: the files say what there is
        meta["wall_s"] += time.monotonic() - t0
        rows = table.ordered(journal.rows)
        every = {(c, i) for c in meta["cases"] for i in range(meta["runs"])}
        meta["complete"] = every <= {(r.case, r.run) for r in rows}
        table.write_parquet(out / table.PARQUET, rows, meta["master_seed"])
        table.write_summary(out / table.SUMMARY, rows, study.binary, study.pool)
        fo.write_meta(out, meta)
    failed = sum(r.status != "ok" for r in rows)
    return Outcome(out, len(rows), failed, len(journal.rows) - before, not _missing(wanted, rows))


def _work(todo: list[Job], pool: Pool, out: Path, journal: Journal, stop: Any, board: _Board) -> None:
    left, waiting = todo[::-1], 0
    while (left or waiting) and not stop:
        for _ in range(min(pool.room(), len(left))):
            pool.submit(left.pop())
            waiting += 1
        for row, traces in pool.poll(POLL_S):
            waiting -= 1
            if traces:
                fo.write_traces(out, row.case, traces)  # before its row: a run on record has its traces
            journal.append(row)
            board.took(row)
