"""acting.toml: the keys found to act (or refused by name), per context, as `python -m tests.keys` found them."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

from tests.keys.flights import try_key
from tests.keys.keys import Key, others, toml
from tests.keys.rigs import RIGS, meeting
from tests.keys.situations import Context, of
from tests.keys.values import VALUES

FILE = Path(__file__).parent / "acting.toml"


def tried(c: Context, k: Key) -> str:
    """What a key does in its situation; "": nothing."""
    if k.cls in RIGS:
        return "acts in its rig"  # tests/keys/test_rigs.py
    sets, duration_s = of(c, k)
    got = try_key(k, c.scenario, sets, duration_s, VALUES.get(k.place, ()))
    if not got and k.name.startswith("tanker.rendezvous."):
        before = meeting(sets)
        for v in VALUES.get(k.place, ()) or others(k)[:3]:
            if meeting((*sets, f"{k.name}={toml(v)}")) != before:
                return "acts in a whole rendezvous"
    return got


def read() -> dict[str, dict[str, str]]:
    """Context -> key -> what it did."""
    if not FILE.exists():
        return {}
    tree = tomllib.loads(FILE.read_text())
    return {c: {f"{at}.{k}": how for how, tables in by.items() for at, ks in tables.items() for k in ks.split()}
            for c, by in tree.items()}  # fmt: skip


def write(found: dict[str, dict[str, str]]) -> None:
    """The file anew: context, answer, table, keys."""
    out = ["# Written by `python -m tests.keys`: every key tried, by what it did and the table it is in."]
    for c, keys in sorted(found.items()):
        for how in ("acts", "refused"):
            tables: dict[str, list[str]] = {}
            for name, answer in sorted(keys.items()):
                if ("refused" if answer == "refused" else "acts") == how:
                    at, _, leaf = name.rpartition(".")
                    tables.setdefault(at, []).append(leaf)
            out += ["", f"[{c}.{how}]"] + [
                f"{json.dumps(at)} = {json.dumps(' '.join(ks))}" for at, ks in tables.items()
            ]
    FILE.write_text("\n".join(out) + "\n")
