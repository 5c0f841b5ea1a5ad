"""To be imported by the server that local workers are forked from (nursery.py), and by nobody else: it loads what the study named
in the environment needs."""

from __future__ import annotations

import contextlib
import gc
import importlib
import os

PROGRAMS = ("flightsw", "sim_plant")


def load(what: str) -> None:
    """Import the modules named, call the functions named after ":" and load what is compiled of all that came with them.

    The collector is kept off all there is then: a page that nobody writes to is shared."""
    for part in what.split():
        module, _, name = part.partition(":")
        with contextlib.suppress(Exception):  # the first run meets it again, and its reason is kept
            found = importlib.import_module(module)
            if name:
                getattr(found, name)()
                preload = importlib.import_module("flightsw.preload").preload  # not for a study that flies nothing
                for program in PROGRAMS:
                    preload(program)
    gc.collect()
    gc.freeze()


load(os.environ.get("WAKEFIELD_PRELOAD", ""))
