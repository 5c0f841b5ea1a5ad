"""Damage of logs, and saying it; apart from what reads them, so that a program says it before it needs numpy."""

from __future__ import annotations

import sys
import warnings
from typing import Any


class LogDamageWarning(UserWarning):
    """Part of a log was left out: damaged or cut. The text names the file and says how much."""


def say_damage(program: str) -> None:
    """Have damage of logs said in one plain line on stderr, once, in the name of `program`."""
    show = warnings.showwarning

    def line(message: Warning | str, category: type[Warning], *rest: Any, **more: Any) -> None:
        if issubclass(category, LogDamageWarning):
            print(f"{program}: {message}", file=sys.stderr)
        else:
            show(message, category, *rest, **more)

    warnings.showwarning = line
    warnings.simplefilter("once", LogDamageWarning)
