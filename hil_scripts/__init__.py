"""Launchers, campaigns, studies. `from hil_scripts import fly, Flight` flies from Python."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hil_scripts.launch.flying import Flight as Flight
    from hil_scripts.launch.flying import fly as fly

__all__ = ["Flight", "fly"]


def __getattr__(name: str) -> Any:
    if name in __all__:  # everything that flies is slow to import: the commands do without until they need it
        from hil_scripts.launch import flying

        return getattr(flying, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
