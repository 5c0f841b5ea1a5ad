"""The windshear mission's signals: flight in the vertical plane, estimate, 1-sigma and truth; hazard index, alert."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ground.run import Run
from ground.signals import Signal
from ground.views.windshear.read import (
    ABORT,
    ACCUSED,
    CAUTION,
    ESTIMATORS,
    GA,
    KD,
    KL,
    LAWS,
    VA,
    WH,
    WX,
    H,
    T,
    WindshearFlight,
    X,
    flights,
    names,
)

SOURCE = "windshear"
STATE = {"along": X, "height": H, "airspeed": VA, "path": GA, "thrust": T, "w_x": WX, "w_h": WH}
UNITS = {"along": "m", "height": "m", "path": "rad", "thrust": "N"}  # the others m/s
SCALES = {"lift": KL, "drag": KD}
KILO = 1e3  # the message and the flight have thrust in kN


def signals(run: Run) -> Iterator[Signal]:
    """{truth, nav}/<aircraft>/{along, height, airspeed, path, thrust, w_x, w_h}, nav's <key>_sigma; F_quick and F_slow of
    both: hazard index in the low-pass of the caution, of the abort; truth's climb; nav's scale/{lift, drag}, monitor,
    turbulence, nis, radio_height; guid's alert, law, climb; ctrl's thrust, elevator."""
    for f in flights(run.folder, run.truth, run.tlm):
        yield from of_flight(f)
    yield from radio_heights(run)


def radio_heights(run: Run) -> Iterator[Signal]:
    """nav/<aircraft>/radio_height of those that have a radio altimeter: as read, in no estimate."""
    for sysid, name in names(run.folder, run.tlm).items():
        radio = run.tlm.get(sysid, "DISTANCE_SENSOR")
        if radio is not None:
            height = 0.01 * radio["current_distance"].astype(np.float64)
            yield Signal(f"nav/{name}/radio_height", radio.t_us, height, "m", source=SOURCE)


def of_flight(f: WindshearFlight) -> Iterator[Signal]:
    """Of one aircraft."""
    a, s, m, th = f.name, f.state, f.valid, f.thresholds
    for key, column in STATE.items():
        unit, factor = UNITS.get(key, "m/s"), KILO if key == "thrust" else 1.0
        yield Signal(f"truth/{a}/{key}", f.t_us, factor * f.true[:, column], unit, source=SOURCE)
        for at, values in ((key, f.x), (f"{key}_sigma", f.sigma)):
            yield Signal(f"nav/{a}/{at}", f.t_us[m], factor * values[m, column], unit, source=SOURCE)
    climb = f.true[:, VA] * np.sin(f.true[:, GA]) + f.true[:, WH]
    yield Signal(f"truth/{a}/climb", f.t_us, climb, "m/s", source=SOURCE)
    for key, tau in (("quick", th["caution_s"]), ("slow", th["abort_s"])):
        yield Signal(f"truth/{a}/F_{key}", f.t_us, f.low(tau), source=SOURCE)
        yield Signal(f"nav/{a}/F_{key}", f.t_us, s[key].astype(np.float64), source=SOURCE)
    for key, column in SCALES.items():
        for at, values in ((key, f.x), (f"{key}_sigma", f.sigma)):
            yield Signal(f"nav/{a}/scale/{at}", f.t_us[m], values[m, column], source=SOURCE)
    monitor = np.column_stack([s["hazard_monitor"], s["wind_monitor"]]).astype(np.float64)
    for i, (key, unit) in enumerate((("F", ""), ("w_x", "m/s"), ("w_h", "m/s"))):
        good = np.isfinite(monitor[:, i])
        yield Signal(f"nav/{a}/{key}_monitor", f.t_us[good], monitor[good, i], unit, source=SOURCE)
    yield Signal(f"nav/{a}/turbulence", f.t_us, s["turbulence"].astype(np.float64), "m/s/sqrt(s)", source=SOURCE)
    yield Signal(f"nav/{a}/nis", f.t_us, s["nis"] / np.maximum(s["channels"], 1), source=SOURCE)
    words = np.select(
        [(s["alert"] & ABORT) > 0, (s["alert"] & CAUTION) > 0, (s["alert"] & ACCUSED) > 0],
        ["abort", "caution", "monitor differs"],
        "none",
    )
    yield Signal(f"guid/{a}/alert", f.t_us, words.astype(object), source=SOURCE)
    law = [
        f"{ESTIMATORS.get(int(e), '?')} {int(n)}, {LAWS.get(int(k), '?')}"
        for e, n, k in zip(s["estimator"], s["states"], s["law"], strict=True)
    ]
    yield Signal(f"guid/{a}/law", f.t_us, np.array(law, dtype=object), source=SOURCE)
    yield Signal(f"guid/{a}/climb", f.t_us, s["climb"].astype(np.float64), "m/s", source=SOURCE)
    yield Signal(f"ctrl/{a}/thrust", f.t_us, KILO * s["thrust"].astype(np.float64), "N", source=SOURCE)
    yield Signal(f"ctrl/{a}/elevator", f.t_us, s["elevator"].astype(np.float64), "rad", source=SOURCE)
