"""What a scenario sets and its world could not obey is refused by name: a table whose switch is off or whose member is not there
may hold its defaults only, so that nothing is on record as flown that was not.

An amplitude of zero is flown as zero: what shapes it may stand beside it.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from flightsw.strict import ConfigError, changed
from sim_plant.aircraft.kind import formation_models, kind_of
from sim_plant.sensors.config import Suite
from sim_plant.sensors.over import replaced_by_grade
from sim_plant.sensors.terms import FAMILIES, PAPER, grade_of, group_terms
from sim_plant.silence import END

if TYPE_CHECKING:
    from sim_plant.scenario import AircraftCfg, Scenario


def refuse(at: str, value: Any, why: str, but: tuple[str, ...] = (), default: Any = None) -> None:
    """Raise ConfigError naming the first key of table (or key) `at` that is not at its default; why: what would have to be there.

    default: of a key that is not a record, or of a record whose class has no defaults of its own.
    """
    found = changed(value, type(value)() if default is None else default, but)
    if found is not None:
        key = f"{at}.{found[0]}" if found[0] else at
        raise ConfigError(f"{key} = {found[1]!r}: nothing obeys it {why}")


def check_obeyed(sc: Scenario) -> None:
    """Raise ConfigError for a key of `sc` that its world has no use for."""
    for a in sc.aircraft:
        _aircraft(a)
        _sensors(sc, a)
    _wind(sc, sum(kind_of(a).formation for a in sc.aircraft), len(sc.aircraft))
    if sc.clock.silence == END:
        refuse(
            "clock.silence_end_s",
            sc.clock.silence_end_s,
            "with clock.silence = 'end'",
            default=type(sc.clock)().silence_end_s,
        )
    if len(sc.aircraft) < 2:
        link = sc.link
        for key, value, default in (("latency_ms", link.radio_latency_ms, 50.0), ("loss", link.radio_loss, 0.0)):
            refuse(f"link.radio_{key}", value, "with one aircraft: there is nobody to hear it", default=default)
    if not any(a.boom_to for a in sc.aircraft):
        refuse("refuel", sc.refuel, "without an aircraft that has boom_to")
    if not sc.traffic.on:
        refuse("traffic", sc.traffic, "while traffic.on = false")
        if not any(a.tacan_to for a in sc.aircraft):
            refuse("track", sc.track, "without [traffic] and without an aircraft that has tacan_to")
    elif not any(a.tacan_to == sc.traffic.name for a in sc.aircraft):
        raise ConfigError(f"traffic.on = true: allowed with an aircraft that has tacan_to = {sc.traffic.name!r}")
    if sc.clock.base_rate_hz % sc.clock.truth_hz:
        raise ConfigError(
            f"clock.truth_hz = {sc.clock.truth_hz}: allowed: base_rate_hz = {sc.clock.base_rate_hz} divided by a whole number"
        )


def _aircraft(a: AircraftCfg) -> None:
    at, st = f"aircraft.{a.name}", a.start
    if st.relative_to:
        refuse(
            f"{at}.start",
            st,
            f"with relative_to = {st.relative_to!r}: position and velocity are that aircraft's",
            ("relative_to", "xi_m", "upset"),
        )
    else:
        refuse(f"{at}.start.xi_m", st.xi_m, "without relative_to", default=(0.0, 0.0, 0.0))
    takes = kind_of(a).takes
    if "fuel_kg" not in takes:
        refuse(f"{at}.fuel_kg", a.fuel_kg, f"with model = {a.model!r}: its mass is that of the file", default=-1.0)
    if "aero_error_frac" not in takes:
        refuse(f"{at}.aero_error_frac", a.aero_error_frac, f"with model = {a.model!r}", default=0.0)
    if "airframe" not in takes:
        refuse(f"{at}.airframe", a.airframe, f"with model = {a.model!r}", default="derivatives")
    if "upset" not in takes and st.upset is not None:
        raise ConfigError(f"{at}.start.upset: nothing obeys it with model = {a.model!r}; allowed: left out")
    refuse(f"{at}.mismatch", a.mismatch, f"with model = {a.model!r}", kind_of(a).mismatch)


OF_THEIR_OWN = {  # period of the TACAN -> keys that belong to it, at their defaults
    "bearing_dt_s": {"bearing_tau_s": 5.0},
    "link_dt_s": {"link_tau_s": 5.0, "link_latency_ms": 0.0, "link_loss": 0.0},
}


def _sensors(sc: Scenario, a: AircraftCfg) -> None:
    """Groups an aircraft does not carry."""
    have = sc.groups(a)
    suite = sc.suite(a.name)
    for f in fields(Suite):
        if f.name not in have and f.name != "grade":
            refuse(
                f"sensors.{a.name}.{f.name}",
                getattr(suite, f.name),
                f"on an aircraft that carries {', '.join(sorted(have))}",
                ("grade",) if f.name in kind_of(a).carries else (),  # paper takes a radio altimeter out
            )
    for group in sorted(have & FAMILIES.keys()):
        cfg, at = getattr(suite, group), f"sensors.{a.name}.{group}"
        grade = grade_of(cfg.grade, suite.grade)
        group_terms(group, grade, cfg.terms, f"{at}.terms")
        if grade != PAPER:
            why = f"with {at} of grade {grade!r}: its terms have times of their own"
            refuse(f"{at}.tau_s", getattr(cfg, "tau_s", 0.0), why, default=0.0)
            refuse("noise.tau_s", sc.noise.tau_s, why, default=0.0)
            stands, kept = replaced_by_grade(group), {f.name for f in fields(cfg)}
            why = f"with {at} of grade {grade!r}, which stands in its place; set it as one of {at}.terms"
            refuse(at, cfg, why, tuple(sorted(kept - set(stands))))
    t, at = suite.tacan, f"sensors.{a.name}.tacan"
    for std, own in (("bearing_std_deg", "bearing_dt_s"), ("link_std_m", "link_dt_s")):
        if getattr(t, std) == 0.0:
            refuse(f"{at}.{own}", getattr(t, own), f"with {std} = 0: there is none", default=0.0)
        if getattr(t, own) == 0.0:
            for key, value in OF_THEIR_OWN[own].items():
                refuse(f"{at}.{key}", getattr(t, key), f"with {own} = 0: one comes with every range", default=value)
    if sc.traffic.on and a.tacan_to == sc.traffic.name:
        refuse(
            f"sensors.{a.name}.radar.sigma_m", suite.radar.sigma_m, "of a receiver in [traffic]: its y_sigma_m is the reading's",
            default=0.0,
        )  # fmt: skip


def _wind(sc: Scenario, formation: int, members: int) -> None:
    w = sc.wind
    if w.prevailing == "sounding":
        refuse("wind.constant_mps", w.constant_mps, "with wind.prevailing = 'sounding'", default=(0.0, 0.0))
    elif w.density != "sounding":
        refuse("wind.sounding", w.sounding, f"with wind.prevailing = {w.prevailing!r}", default=type(w)().sounding)
    d = w.dryden
    if d.level != "none":
        for key, value, default in (
            ("sigma_mps", d.sigma_mps, 0.0),
            ("L_m", d.L_m, type(d)().L_m),
            ("step", d.step, ()),
        ):
            refuse(f"wind.dryden.{key}", value, f"with wind.dryden.level = {d.level!r}", default=default)
    if d.over != "point" and members > formation:
        raise ConfigError(
            f"wind.dryden.over = {d.over!r}: allowed: with aircraft of model = {formation_models()} alone"
        )
    if members < 2:
        refuse("wind.dryden.independent", w.dryden.independent, "with one aircraft", default=False)
    if not w.wake.source:
        refuse("wind.wake", w.wake, "without wind.wake.source")
    elif w.wake.path == "straight":
        flown = type(w.wake)()
        for key in ("sink", "meander", "edr_m2ps3"):
            why = "with wind.wake.path = 'straight'"
            refuse(f"wind.wake.{key}", getattr(w.wake, key), why, default=getattr(flown, key))
    if not w.bow.source:
        refuse("wind.bow", w.bow, "without wind.bow.source")
    if w.wake.source and (formation < 2 or members > formation):
        who = (
            "another aircraft"
            if formation < 2
            else "aircraft of that model alone: the others would fly through it unmoved"
        )
        raise ConfigError(f"wind.wake.source = {w.wake.source!r}: allowed: with {who} (model = {formation_models()})")
