"""A resolved scenario as TOML text."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from flightsw.strict import to_dict
from sim_plant.sensors.over import replaced_by_grade
from sim_plant.sensors.terms import PAPER, grade_of

if TYPE_CHECKING:
    from sim_plant.scenario import Scenario


def dump(sc: Scenario, seed: int) -> str:
    """The resolved scenario as TOML text that `load_scenario` reads back to an equal record, with the seed of the
    run. Left out is what a grade has put itself in the place of."""
    tree = to_dict(sc)
    tree["meta"]["seed"] = seed
    for suite in tree["sensors"].values():
        for group, g in suite.items():
            if isinstance(g, dict) and grade_of(g.get("grade", ""), suite["grade"]) != PAPER:
                for k in replaced_by_grade(group):
                    g.pop(k, None)
    out = [f"{_key(k)} = {_value(v)}" for k, v in tree.items() if isinstance(v, str)]
    for key, v in tree.items():
        if isinstance(v, str):
            continue
        tables = v if isinstance(v, (list, tuple)) else [v]
        for t in tables:
            out.append(f"[[{key}]]" if tables is v else f"[{key}]")
            out += [f"{_key(k)} = {_value(x)}" for k, x in t.items()]
            out.append("")
    return "\n".join(out)


def _key(k: str) -> str:
    return k if k.replace("_", "").replace("-", "").isalnum() else json.dumps(k)


def _value(v: Any) -> str:
    """One TOML value on one line; a JSON string is also a TOML string."""
    if isinstance(v, dict):
        return "{ " + ", ".join(f"{_key(k)} = {_value(x)}" for k, x in v.items()) + " }" if v else "{}"
    if isinstance(v, (list, tuple)):
        return "[" + ", ".join(_value(x) for x in v) + "]"
    return repr(v) if isinstance(v, float) else json.dumps(v)
