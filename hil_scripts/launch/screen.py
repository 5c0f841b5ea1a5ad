"""Consoles of the launcher: square brackets in a text are text ([m/s], event[0]), never markup, and numbers are not coloured.

Every command line has them at hand, and showing its help needs none: what draws them is imported with the first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text


def console(stderr: bool = False, quiet: bool = False) -> Console:
    """Where the commands write."""
    from rich.console import Console

    return Console(stderr=stderr, quiet=quiet, markup=False, highlight=False)


def fail(text: object) -> None:
    """One line of the launcher on stderr, in red where there are colours."""
    console(stderr=True).print(f"sil: {text}", style="red", soft_wrap=True)


def verdict(ok: bool, good: str, bad: str) -> Text:
    """`good` in green or `bad` in red."""
    from rich.text import Text

    return Text(good if ok else bad, style="green" if ok else "red")
