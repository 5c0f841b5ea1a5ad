"""Where runs are made: in this process, on local worker processes, or on a Dask cluster that is already running."""

from __future__ import annotations

import asyncio
import logging
import queue
import re
import shutil
import signal
import socket
import tempfile
import time
import uuid
from collections.abc import Callable
from multiprocessing import resource_tracker
from typing import Any, Protocol
from urllib.parse import urlsplit

from numpy.typing import NDArray

from hil_scripts.campaign import nursery
from hil_scripts.campaign.study import CampaignError, Study
from hil_scripts.campaign.task import Job, Row, execute, identity
from hil_scripts.launch.procs import SINGLE_THREAD

ADDRESS = re.compile(r"(tcp|tls)://[^:/\s]+:\d{1,5}|(tcp|tls)://\[[0-9a-fA-F:]+\]:\d{1,5}")
ANSWER_S = 10.0  # [s] a scheduler has this long to answer
WORKERLESS_S = 60.0  # [s] a cluster may be without a worker this long before the campaign gives up
# nobody reads a worker's profile nor its pages: a hundred looks a second at its stack would write to memory that is shared
OWN_WORKERS = {
    "distributed.scheduler.allowed-failures": 1,
    "distributed.worker.profile.enabled": False,
    "distributed.worker.http.routes": [],
}
Done = tuple[Row, dict[str, NDArray[Any]]]


class Pool(Protocol):
    """Takes jobs and hands back what became of them, in any order."""

    def room(self) -> int:
        """How many more jobs are worth submitting now."""

    def submit(self, job: Job) -> None:
        """Start a job."""

    def poll(self, timeout_s: float) -> list[Done]:
        """Jobs finished since the last call; waits at most `timeout_s` for the first. Raises CampaignError."""

    def close(self) -> None:
        """Stop everything, running jobs included."""


class InlinePool:
    """No parallelism: runs are made one after another in this process, for looking into a study."""

    def __init__(self, study: Study) -> None:
        self._study = study
        self._done: list[Done] = []

    def room(self) -> int:
        """One at a time."""
        return 1 - len(self._done)

    def submit(self, job: Job) -> None:
        """Make the run at once."""
        self._done.append(execute(self._study.run, job))

    def poll(self, timeout_s: float) -> list[Done]:
        """The run just made."""
        out, self._done = self._done, []
        return out

    def close(self) -> None:
        """Nothing runs."""


class DaskPool:
    """Runs on Dask workers: an own LocalCluster of processes, or the cluster at `scheduler`.

    As many jobs as there are worker threads are in flight, so that the death of a worker hits the run it was making
    and no queue behind it. Raises CampaignError when the cluster does not answer, has no worker or runs other code.
    """

    def __init__(self, study: Study, workers: int, scheduler: str | None) -> None:
        self._study = study
        self._pending: dict[str, tuple[Job, Any]] = {}
        self._finished: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._cluster: Any = None
        self._client: Any = None
        self._tmp: str | None = None
        self._alive = time.monotonic()
        self._campaign = uuid.uuid4().hex[:8]
        try:
            if scheduler is None:
                self._start_local(workers)
            else:
                self._connect(scheduler)
        except BaseException:
            self.close()
            raise

    def _start_local(self, workers: int) -> None:
        import dask
        from distributed import Client, LocalCluster

        forks = nursery.possible()
        dask.config.set(OWN_WORKERS | {nursery.METHOD: "forkserver" if forks else "spawn"})
        self._tmp = tempfile.mkdtemp(prefix="wakefield-campaign-")
        resource_tracker.ensure_running()  # before the mask: its start unblocks SIGINT
        # Ctrl-C goes to the whole process group. Workers inherit this mask: they end when they are told to, not by it
        old = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            if forks:
                nursery.open_for(self._study)
            self._cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address="127.0.0.1:0",
                memory_limit=0,
                local_directory=self._tmp,
                silence_logs=logging.CRITICAL,
                env=dict(SINGLE_THREAD),
            )
            self._client = Client(self._cluster, timeout=ANSWER_S)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, old)

    def _connect(self, scheduler: str) -> None:
        if not ADDRESS.fullmatch(scheduler):
            raise CampaignError(f"--scheduler {scheduler!r}: expected tcp://HOST:PORT or tls://HOST:PORT")
        from distributed import Client

        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        _knock(scheduler)
        try:
            asyncio.run(asyncio.wait_for(_greet(scheduler), ANSWER_S))
            self._client = Client(scheduler, timeout=ANSWER_S)
            self._client.wait_for_workers(1, timeout=ANSWER_S)
            others = self._client.run(identity)
        except (OSError, TimeoutError) as e:
            what = "no worker has joined it" if self._client is not None else f"no answer within {ANSWER_S:.0f} s"
            raise CampaignError(f"scheduler {scheduler}: {what} ({type(e).__name__})") from None
        except ImportError as e:
            raise CampaignError(
                f"scheduler {scheduler}: its workers do not have this project installed ({e})"
            ) from None
        mine = identity()
        for worker, other in others.items():
            differs = [f"{k} {other.get(k)}, here {v}" for k, v in mine.items() if other.get(k) != v]
            if differs:
                raise CampaignError(f"worker {worker} would give other results: {'; '.join(differs)}")

    def _threads(self) -> int:
        return sum(w["nthreads"] for w in self._client.scheduler_info(n_workers=-1)["workers"].values())

    def room(self) -> int:
        """Free worker threads; at least one job is kept in flight, it waits for a worker to come back."""
        return max(1, self._threads()) - len(self._pending)

    def submit(self, job: Job) -> None:
        """Send a job to the cluster."""
        key = f"wakefield-{self._campaign}-{job.case.name}-{job.run}"
        future = self._client.submit(execute, self._study.run, job, key=key, pure=False)
        self._pending[key] = (job, future)
        future.add_done_callback(lambda f: self._finished.put(f.key))

    def poll(self, timeout_s: float) -> list[Done]:
        """Collect what has finished; a run whose worker process died twice is a failed run."""
        keys = []
        try:
            keys.append(self._finished.get(timeout=timeout_s))
            while True:
                keys.append(self._finished.get_nowait())
        except queue.Empty:
            pass
        if keys or self._threads() > 0:
            self._alive = time.monotonic()
        elif time.monotonic() - self._alive > WORKERLESS_S:
            raise CampaignError(
                f"the cluster has had no worker for {WORKERLESS_S:.0f} s; what was made is kept, resume later"
            )
        return [self._collect(k) for k in keys if k in self._pending]

    def _collect(self, key: str) -> Done:
        from distributed import KilledWorker

        job, future = self._pending.pop(key)
        try:
            row, traces = future.result(timeout=ANSWER_S)
        except KilledWorker:
            return Row(job.case.name, job.run, job.seed, "failed", "the worker process died while making this run"), {}
        except Exception as e:
            if future.cancelled() or future.status != "error":
                raise CampaignError(
                    f"the cluster was lost ({type(e).__name__}); what was made is kept, resume later"
                ) from None
            text = " ".join(f"{type(e).__name__}: {e}".split())[:300]
            return Row(job.case.name, job.run, job.seed, "failed", text), {}
        return row, traces

    def close(self) -> None:
        """Cancel what is pending; end own workers, also busy ones, within seconds."""
        if self._client is not None:
            _quietly(lambda: self._client.cancel([f for _, f in self._pending.values()], force=True))
            _quietly(lambda: self._client.close(timeout=2))
        self._pending.clear()
        if self._cluster is not None:
            _quietly(lambda: self._cluster.close(timeout=5))
        if self._tmp is not None:
            shutil.rmtree(self._tmp, ignore_errors=True)


def _knock(scheduler: str) -> None:
    """Raises CampaignError at once where nothing listens: the client would go on trying."""
    url = urlsplit(scheduler)
    try:
        socket.create_connection((url.hostname or "", url.port or 0), ANSWER_S).close()
    except OSError as e:
        raise CampaignError(f"scheduler {scheduler}: no connection: {e.strerror or e}") from None


async def _greet(scheduler: str) -> None:
    """Ask the scheduler who it is: Client alone waits for ever on a port where something listens and never answers."""
    from distributed.core import rpc

    async with rpc(scheduler) as peer:
        await peer.identity(n_workers=0)


def _quietly(action: Callable[[], Any]) -> None:
    """Ending must go on to its end whatever the cluster does meanwhile."""
    try:
        action()
    except Exception:
        logging.getLogger(__name__).debug("while closing", exc_info=True)


def make_pool(study: Study, workers: int, scheduler: str | None) -> Pool:
    """The pool for `scheduler` (an address), or for `workers` local processes; 0: this process. Raises CampaignError."""
    if scheduler is None and workers == 0:
        return InlinePool(study)
    return DaskPool(study, workers, scheduler)
