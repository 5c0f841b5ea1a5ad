"""Run tools of the stock library one after the other in this process, as their command lines would: argument 1 is a folder with
the complete dialect, argument 2 a JSON list of [output file, tool, argument, ...].

mavgraph draws by a method that matplotlib no longer has: it is given back.
"""

from __future__ import annotations

import contextlib
import json
import os
import runpy
import sys
from typing import Any

import matplotlib.axes
import pymavlink.dialects.v20 as dialects


def plot_date(self: Any, x: Any, y: Any, fmt: str = "o", tz: Any = None, **more: Any) -> Any:
    """Points over dates."""
    return self.plot(x, y, fmt, **more)


def main() -> None:
    """The tools of the command line."""
    os.environ["MAVLINK20"], os.environ["MPLBACKEND"] = "1", "agg"
    dialects.__path__.append(sys.argv[1])
    if not hasattr(matplotlib.axes.Axes, "plot_date"):
        matplotlib.axes.Axes.plot_date = plot_date
    for out, tool, *args in json.loads(sys.argv[2]):
        sys.argv = [tool, *args]
        with open(out, "w") as f, contextlib.redirect_stdout(f), contextlib.suppress(SystemExit):
            runpy.run_path(tool, run_name="__main__")


if __name__ == "__main__":
    main()
