"""Write a plain tree of dicts, lists and scalars as TOML (the standard library only reads it).

Only what configuration files hold: tables, arrays of tables, lists of scalars or of lists, strings, numbers, booleans.
Floats are written by `repr`, so that a resolved file reads back to the same bits.
"""

from __future__ import annotations

import json
import re
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def dumps(tree: dict[str, Any]) -> str:
    """TOML text of `tree`; None values are left out. Raises TypeError naming the key of anything TOML cannot hold."""
    lines: list[str] = []
    _table(tree, "", lines)
    return "\n".join(lines).strip() + "\n"


def _key(k: str) -> str:
    return k if _BARE.fullmatch(k) else json.dumps(k)


def _is_table_list(v: Any) -> bool:
    return isinstance(v, (list, tuple)) and len(v) > 0 and all(isinstance(x, dict) for x in v)


def _table(tree: dict[str, Any], prefix: str, lines: list[str]) -> None:
    nested = {k: v for k, v in tree.items() if isinstance(v, dict) or _is_table_list(v)}
    for k, v in tree.items():
        if k not in nested and v is not None:
            lines.append(f"{_key(k)} = {value(v, prefix + k)}")
    for k, v in nested.items():
        path = prefix + _key(k)
        for item in [v] if isinstance(v, dict) else v:
            lines += ["", f"[{path}]" if isinstance(v, dict) else f"[[{path}]]"]
            _table(item, path + ".", lines)


def value(v: Any, key: str) -> str:
    """A scalar or a list as TOML. Raises TypeError naming the key of anything else."""
    if isinstance(v, bool):
        return "true" if v else "false"
    if isinstance(v, (int, float)):
        return repr(v)
    if isinstance(v, str):
        return json.dumps(v, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(v, (list, tuple)):
        return "[" + ", ".join(value(x, key) for x in v) + "]"
    raise TypeError(f"{key}: {type(v).__name__} cannot be written as TOML")
