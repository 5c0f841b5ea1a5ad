"""Local workers are forked from a server that has loaded what their study needs: they start in a moment and share its memory.

Nothing depends on it: what cannot be had in the server a worker imports for itself, and says so.
"""

from __future__ import annotations

import os
import sys
from multiprocessing import forkserver

from hil_scripts.campaign.study import Study
from hil_scripts.launch.procs import SINGLE_THREAD

WHAT = "WAKEFIELD_PRELOAD"  # modules to import; after ":" a function there to call
PRELOAD = [  # the middle ones: what a worker would import for itself as it starts
    "distributed", "distributed.nanny", "distributed.worker",
    "email.contentmanager", "email.headerregistry", "email.policy", "importlib_metadata", "tornado.platform.asyncio",
    "hil_scripts.campaign.preloaded",
]  # fmt: skip
ALLOCATOR = {
    "MALLOC_ARENA_MAX": "1",
    "MALLOC_TRIM_THRESHOLD_": "65536",
}  # one heap for all threads, and what is free goes back
METHOD = "distributed.worker.multiprocessing-method"


def possible() -> bool:
    """Whether this system forks safely: elsewhere its libraries start threads of their own."""
    return sys.platform == "linux"


def open_for(study: Study) -> None:
    """Start the server for a study. There is one a process: where it runs already, for another study, it stays as it is."""
    from distributed.utils import get_mp_context

    warm = () if study.warm is None else (f"{study.warm.__module__}:{study.warm.__name__}",)
    mine = {WHAT: " ".join((study.run.__module__, *warm)), **SINGLE_THREAD, **ALLOCATOR}
    get_mp_context()  # dask names what it would load, all it knows of, on the first call
    forkserver.set_forkserver_preload(PRELOAD)
    before = {k: os.environ.get(k) for k in mine}
    os.environ.update(mine)
    try:
        forkserver.ensure_running()
    finally:
        for k, v in before.items():
            os.environ.pop(k) if v is None else os.environ.update({k: v})
