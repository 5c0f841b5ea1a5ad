"""To be imported by the server that local workers are forked from (nursery.py), and by nobody else: it loads what the study named
in the environment needs."""

from __future__ import annotations

import contextlib
import gc
import importlib
import os


def load(what: str) -> None:
    """Import the modules named and call the functions named after ":", then keep the collector off all there is: a page that
    nobody writes to is shared."""
    for part in what.split():
        module, _, name = part.partition(":")
        with contextlib.suppress(Exception):  # the first run meets it again, and its reason is kept
            found = importlib.import_module(module)
            if name:
                getattr(found, name)()
    gc.collect()
    gc.freeze()


load(os.environ.get("WAKEFIELD_PRELOAD", ""))
