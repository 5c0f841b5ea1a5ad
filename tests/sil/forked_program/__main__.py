"""A stand-in program: says what it was started with and what it holds."""

import importlib
import json
import os
import signal
import sys
from pathlib import Path


def main() -> None:
    held = [os.path.realpath(p) for p in Path("/proc/self/fd").iterdir() if int(p.name) > 2]
    closed = ""
    try:
        importlib.import_module("sim_plant.world")
    except ImportError as e:
        closed = str(e)
    others = sorted({h for h in held if h != "/dev/null" and not h.startswith("/proc/")})
    kept = [m for m in sys.modules if m.startswith("sim_plant")]
    handlers = [signal.getsignal(s) == signal.SIG_DFL for s in (signal.SIGTERM, signal.SIGHUP)]
    what = {"argv": sys.argv, "others": others, "closed": closed, "kept": kept, "group": os.getpgid(0) == os.getpid()}
    print(json.dumps(what | {"default": all(handlers), "env": os.environ["FORKED_TEST"]}))
    print("words", file=sys.stderr)
    sys.exit(5)
