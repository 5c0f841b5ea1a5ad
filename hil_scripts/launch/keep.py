"""The files a run is flown with, kept in its folder: aircraft, sounding and data beside the configurations that name them, and
the dialect its logs are written in.

The tables written to the folder name the copies, so that the run flies again from anywhere, whatever becomes of the originals.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flightsw import aircraft
from flightsw.app import check
from flightsw.icd import dialect
from flightsw.missions.base import find_mission
from flightsw.process.config import flight_of
from flightsw.strict import ConfigError, convert, read_toml, to_dict
from hil_scripts.launch import tomlout
from sim_plant.wind.prevailing import sounding_path

AIRCRAFT, SOUNDINGS, DIALECT, DATA = "aircraft", "soundings", "dialect", "data"  # folders of a run folder


@dataclass
class Kept:
    """Relative name in the run folder -> bytes, and which original each came from."""

    files: dict[str, bytes] = field(default_factory=dict)
    _of: dict[Path, str] = field(default_factory=dict)

    def name(self, folder: str, original: Path, data: bytes) -> str:
        """Name of the copy of `original`; two originals of one name get two copies."""
        original = original.resolve()
        if original not in self._of:
            n, name = 1, f"{folder}/{original.name}"
            while name in self.files:
                n += 1
                name = f"{folder}/{original.stem}-{n}{original.suffix}"
            self.files[name] = data
            self._of[original] = name
        return self._of[original]

    def write(self, run: Path) -> None:
        """Put the copies into the run folder. Raises OSError."""
        for name, data in self.files.items():
            (run / name).parent.mkdir(exist_ok=True)
            (run / name).write_bytes(data)


def _aircraft(kept: Kept, name: str) -> str:
    path = aircraft.find(name)
    data = path.read_bytes()
    if "base" in tomllib.loads(data.decode()):
        data = tomlout.dumps(read_toml(path)).encode()  # whole: what it is based on is not kept
    return kept.name(AIRCRAFT, path, data)


def _flight(kept: Kept, f: dict[str, Any]) -> dict[str, Any]:
    app = f["app"]
    own = {**f, "app": {**app, "aircraft": _aircraft(kept, app["aircraft"])}}
    spec = find_mission(app["mission"], app["name"])
    for key in spec.files:
        own[key] = _aircraft(kept, f[key] if key in f else to_dict(convert({}, spec.params, app["name"]))[key])
    cfg = flight_of(f, app["name"])
    params = check(app["mission"], cfg.tables, cfg.app.base_rate_hz, cfg.app.mission_rate_hz, app["name"]).params
    for key, paths in spec.data(params).items():
        first, *_ = [kept.name(DATA, path, path.read_bytes()) for path in paths]
        own = _with(own, key.split("."), first)
    return own


def _with(tree: dict[str, Any], key: list[str], value: str) -> dict[str, Any]:
    """The tree with one value changed."""
    head, *rest = key
    return {**tree, head: _with(tree.get(head, {}), rest, value) if rest else value}


def keep(scenario: dict[str, Any], flights: list[dict[str, Any]]) -> tuple[Kept, dict[str, Any], list[dict[str, Any]]]:
    """What to keep, and the tables of a scenario and its flights changed to name it. Raises ConfigError naming a file that
    cannot be read."""
    kept = Kept()
    for path in dialect.files():
        kept.name(DIALECT, path, path.read_bytes())
    own = {**scenario, "aircraft": [{**a, "file": _aircraft(kept, a["file"])} for a in scenario["aircraft"]]}
    wind = own["wind"]
    if wind["prevailing"] == "sounding":
        path = sounding_path(wind["sounding"])
        try:
            data = path.read_bytes()
        except OSError as e:
            raise ConfigError(f"wind.sounding = {wind['sounding']!r}: {path} cannot be read: {e.strerror}") from None
        own["wind"] = {**wind, "sounding": kept.name(SOUNDINGS, path, data)}
    return kept, own, [_flight(kept, f) for f in flights]
