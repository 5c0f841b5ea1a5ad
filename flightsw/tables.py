"""Tables of TOML texts, each text parsed once in a process: scenario, checks, plant and every aircraft read the same files."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from typing import Any

KEPT = 64  # texts; a scenario with everything it names is two dozen


def tables(text: bytes) -> dict[str, Any]:
    """What a TOML text holds, the caller's own to change. Raises tomllib.TOMLDecodeError, UnicodeDecodeError."""
    return _own(_parsed(text))


@lru_cache(KEPT)
def _parsed(text: bytes) -> dict[str, Any]:
    return tomllib.loads(text.decode())


def _own(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _own(v) for k, v in value.items()}
    return [_own(v) for v in value] if isinstance(value, list) else value
