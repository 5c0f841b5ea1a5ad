"""What two runs were flown with, key by key: seed, length, scenario, onboard parameters."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from ground.tree import flatten

Difference = tuple[str, Any, Any]  # key, of the one and of the other; None: it is not there
BOUNDS = "plant.expect."  # what a run is judged by flies nothing
FROM_META = ("git_commit", "mode", "scenario", "cpu", "wakefield")


def _flat(value: Any, prefix: str) -> dict[str, Any]:
    """A table with its lists of tables as flat keys; a table of a list goes by its name, if it has one."""
    if isinstance(value, dict):
        out: dict[str, Any] = {}
        for key, v in value.items():
            out |= _flat(v, f"{prefix}{key}.")
        return out
    if isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
        out = {}
        for i, v in enumerate(value):
            out |= _flat(v, f"{prefix}{v.get('name', i)}.")
        return out
    return {prefix.removesuffix("."): value}


def settings(run: Path) -> dict[str, Any]:
    """Everything in the run's resolved files. Raises ValueError naming a file that is not TOML or JSON."""
    out: dict[str, Any] = {}
    for path, owner in [
        (run / "scenario.toml", "plant"),
        *((p, p.stem[7:]) for p in sorted(run.glob("flight_*.toml"))),
    ]:
        if path.exists():
            try:
                out |= _flat(tomllib.loads(path.read_text()), f"{owner}.")
            except ValueError as exc:
                raise ValueError(f"{str(path)!r} is not TOML: {exc}") from exc
    path = run / "meta.json"
    if path.exists():
        try:
            meta = flatten(json.loads(path.read_text()))
        except (ValueError, AttributeError) as exc:
            raise ValueError(f"{str(path)!r} is not JSON: {exc}") from exc
        out |= {f"run.{k.removeprefix('run.')}": v for k, v in meta.items() if k.split(".")[-1] in FROM_META}
    return {k: v for k, v in out.items() if not k.startswith(BOUNDS)}


def differences(a: Path, b: Path) -> list[Difference]:
    """Settings that differ, by key."""
    x, y = settings(a), settings(b)
    return [(k, x.get(k), y.get(k)) for k in sorted(x.keys() | y.keys()) if x.get(k) != y.get(k)]
