"""Keys of a scenario's sensor table beside a grade other than paper.

A noise key (`*_std`, `*_bias_std`, `latency_ms`) that is asked for together with the grade is laid over it, as the single term it
stands for (`terms`, terms.py). One that belongs to a file of paper sensors goes with what the grade replaces: whoever sets the
grade from outside asks for the grade's numbers, not for those of the file.
"""

from __future__ import annotations

from typing import Any

from flightsw.strict import ConfigError, Tree, apply_overrides, convert
from sim_plant.sensors.config import Suite
from sim_plant.sensors.terms import GRADES, PAPER

LATENCY = "latency_ms"
DOWN = "vel_down_factor"
# noise key of a group -> (family, term) it stands for; white is all of it: a density goes
KEYS: dict[str, dict[str, tuple[tuple[str, str], ...]]] = {
    "imu": {
        "gyro_std": (("gyro", "white"),),
        "acc_std": (("acc", "white"),),
        "gyro_bias_std": (("gyro", "constant"),),
        "acc_bias_std": (("acc", "constant"),),
    },
    "baro": {"alt_std_m": (("alt", "white"),), "alt_bias_std_m": (("alt", "constant"),)},
    "mag": {"std_gauss": (("field", "white"),), "bias_std_gauss": (("field", "constant"),)},
    "gnss": {
        "pos_std_m": (("pos_h", "white"), ("pos_v", "white")),
        "vel_std_mps": (("vel_h", "white"), ("vel_v", "white")),
        "pos_bias_std_m": (("pos_h", "constant"), ("pos_v", "constant")),
        "vel_bias_std_mps": (("vel_h", "constant"), ("vel_v", "constant")),
    },
    "air": {
        "V_std_mps": (("V", "white"),),
        "alpha_std": (("alpha", "white"),),
        "beta_std": (("beta", "white"),),
        "V_bias_std_mps": (("V", "constant"),),
        "alpha_bias_std": (("alpha", "constant"),),
        "beta_bias_std": (("beta", "constant"),),
    },
    "att": {
        "std": (("tilt", "white"), ("heading", "white")),
        "bias_std": (("tilt", "constant"), ("heading", "constant")),
    },
    "rel": {
        "pos_std_m": (("pos", "white"),),
        "vel_std_mps": (("vel", "white"),),
        "pos_bias_std_m": (("pos", "constant"),),
        "vel_bias_std_mps": (("vel", "constant"),),
    },
    "fuel": {"std_kg": (("mass", "white"),), "bias_std_kg": (("mass", "constant"),)},
    "boom": {},
    "radalt": {},
}


def replaced_by_grade(group: str) -> tuple[str, ...]:
    """Keys of a sensor's table in whose place a grade other than paper stands."""
    return (LATENCY, *KEYS[group], *((DOWN,) if group == "gnss" else ())) if group in KEYS else ()


def _table(tree: Any, *path: str) -> Tree:
    for key in path:
        tree = tree.get(key, {}) if isinstance(tree, dict) else {}
    return tree if isinstance(tree, dict) else {}


def _grade(tree: Tree, aircraft: str, group: str) -> Any:
    suite = _table(tree, "sensors", aircraft)
    return _table(suite, group).get("grade") or suite.get("grade", PAPER)


def asked(overrides: dict[str, Any]) -> Tree:
    """What of the sensors overrides (dotted keys) set, as a tree."""
    out: Tree = {}
    mine = {k: v for k, v in overrides.items() if k.split(".")[0] == "sensors"}
    apply_overrides(out, mine, "")
    return out


def lay_over(tree: Tree, file: Tree, user: Tree, where: str) -> None:
    """Move the noise keys of graded sensors in `tree` (the scenario, overrides in it) to their `terms`, in place.

    file: the scenario before the overrides; user: the overrides. Raises ConfigError for a key and a term that say the same.
    """
    suite = Suite()
    for aircraft, table in _table(tree, "sensors").items():
        for group in KEYS:
            g, grade = _table(table, group), _grade(tree, aircraft, group)
            if not g or grade == PAPER or grade not in GRADES:
                continue
            own = _grade(file, aircraft, group) != PAPER
            said = _table(user, "sensors", aircraft, group)
            at = f"sensors.{aircraft}.{group}"
            set_here = {k: g[k] for k in replaced_by_grade(group) if k in g and (own or k in said)}
            convert(set_here, type(getattr(suite, group)), f"{where}: {at}")
            keep = set_here.keys() & {DOWN}
            for k in replaced_by_grade(group):
                if k not in keep or "vel_std_mps" in set_here:
                    g.pop(k, None)
            if set_here.keys() - keep:
                g["terms"] = _over(_table(g, "terms"), set_here, group, f"{where}: {at}")


def _over(terms: Tree, keys: Tree, group: str, at: str) -> Tree:
    out = {k: dict(v) if isinstance(v, dict) else v for k, v in terms.items()}

    def put(table: Tree, term: str, value: Any, key: str, name: str) -> None:
        if term in table:
            raise ConfigError(f"{at}.{key} and {at}.terms.{name}: both set; allowed: one of the two")
        table[term] = value

    for key, value in keys.items():
        if key == LATENCY:
            put(out, LATENCY, value, key, LATENCY)
        for family, term in KEYS[group].get(key, ()):
            fam = out.setdefault(family, {})
            if isinstance(fam, dict):
                down = keys.get(DOWN, 1.0) if family == "vel_v" and term == "white" else 1.0
                put(fam, term, value * down, key, f"{family}.{term}")
                if group == "imu" and term == "white":
                    put(fam, "density", 0.0, key, f"{family}.density")
    return out
