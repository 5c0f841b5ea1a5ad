"""Nested tables, as TOML and JSON files hold them, in other shapes."""

from __future__ import annotations

from typing import Any


def flatten(nested: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested mapping as flat dotted keys."""
    out: dict[str, Any] = {}
    for key, value in nested.items():
        if isinstance(value, dict):
            out |= flatten(value, f"{prefix}{key}.")
        else:
            out[f"{prefix}{key}"] = value
    return out


def by_name(tree: dict[str, Any]) -> dict[str, Any]:
    """Nested tables in which arrays of tables are tables by the name, or else the place, of their entries."""
    out: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            value = {str(v.get("name", i)): v for i, v in enumerate(value)}
        out[key] = by_name(value) if isinstance(value, dict) else value
    return out
