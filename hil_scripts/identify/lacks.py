"""What of a model the aircraft file's form cannot hold, each with its size at the condition."""

from __future__ import annotations

import math
from dataclasses import replace

from flightsw.aircraft import Aircraft
from hil_scripts.identify.bench import Bench, Point
from hil_scripts.identify.engines import Step
from hil_scripts.identify.fit import BETA, SURFACE
from hil_scripts.identify.regress import Equation
from sim_plant.kernels.layout import G0

MACH_STEP = 0.05


def thrust_below_m(bench: Bench) -> float:
    """How far the thrust line lies below the centre of gravity [m]."""
    return bench.centre_m(bench.c.fuel_kg)[2] - bench.stock.thrust_m[2]


def thrust_Cm(bench: Bench, V: float, thrust_N: float) -> float:
    """Pitching-moment coefficient of a thrust [N] on its line."""
    return thrust_below_m(bench) * thrust_N / (0.5 * bench.rho * V * V * bench.S_m2 * bench.c_m)


def _slope(bench: Bench, x: Point, name: str, surface: int) -> float:
    """Change of a coefficient per radian of aileron, elevator or rudder."""
    ends = []
    for sign in (-1.0, 1.0):
        moved = list(x.surfaces)
        moved[surface] += sign * 0.02
        ends.append(getattr(bench.read(replace(x, surfaces=(moved[0], moved[1], moved[2]))), name))
    return (ends[1] - ends[0]) / 0.04


def lacks(
    bench: Bench,
    trim: Point,
    thrust_N: float,
    fitted: dict[str, Equation],
    step: Step,
    like: Aircraft,
    top: float,
) -> list[str]:
    """Lines of text; top: incidence [rad] of the greatest lift."""
    at = bench.read(trim)
    off = bench.read(replace(trim, beta=BETA)).CD / at.CD - 1.0
    a, e, r = trim.surfaces
    by_elevator = bench.read(replace(trim, surfaces=(a, e - SURFACE, r))).CD / at.CD - 1.0
    below = thrust_below_m(bench)
    tenth = thrust_Cm(bench, trim.V, 0.1 * bench.mass_kg * G0) / fitted["Cm"].values["Cm_de"]
    moment, size = thrust_Cm(bench, trim.V, thrust_N), math.degrees(SURFACE)
    out = [
        (
            f"thrust line {below:+.2f} m below the centre of gravity: Cm0 holds its {moment:+.4f} at the trim's thrust; a tenth "
            f"of the weight more thrust moves the elevator by {math.degrees(-tenth):+.2f} deg"
        ),
        (
            f"drag of sideslip {100 * off:+.0f} % at {math.degrees(BETA):.0f} deg, of the elevator {100 * by_elevator:+.0f} % at "
            f"{size:.0f} deg more; over all points CD is {fitted['CD'].rest:.4f} off, RMS, of {at.CD:.4f}"
        ),
    ]
    slower, faster = (replace(trim, V=trim.V + s * MACH_STEP * bench.sound_mps) for s in (-1.0, 1.0))
    for name, k, key in (("Cm", 1, "Cm_de"), ("Cl", 0, "Cl_da"), ("CL", 1, "CL_de")):
        lo, hi = _slope(bench, slower, name, k), _slope(bench, faster, name, k)
        if abs(hi - lo) > 1e-3 * abs(hi):
            out.append(f"Mach number: {key} {100 * (hi / lo - 1.0):+.1f} % per 0.1")
    wave = bench.read(faster).CD / at.CD - 1.0
    if abs(wave) > 0.005:
        out.append(f"Mach number: CD {100 * wave:+.1f} % at {faster.V / bench.sound_mps:.2f}")
    empty, full = (bench.centre_m(f)[0] for f in (0.0, sum(bench.stock.tanks_kg)))
    if abs(full - empty) > 1e-3:
        moved = (empty - full) / bench.c_m * fitted["CL"].values["CL_alpha"]
        out.append(
            f"centre of gravity {empty - full:+.2f} m ahead with full tanks against empty: Cm_alpha {-moved:+.2f}; fitted with "
            f"{bench.c.fuel_kg:.0f} kg"
        )
    for name in ("CY", "Cl", "Cn"):
        if abs(fitted[name].rest) > 1e-4:
            out.append(f"{name} of {fitted[name].rest:+.5f} in straight symmetric flight")
    out += [
        (
            f"engine: one lag of {step.up_63_s:.2f} s; it is at 63 % after that, at 90 % after {step.up_90_s:.2f} s, and down "
            f"63 % after {step.down_63_s:.2f} s; the throttle is the share of the thrust available, not its lever"
        ),
        f"wing beyond the straight part: its lift ends at {math.degrees(top):.1f} deg, the file's goes on",
        f"dropped: {', '.join(bench.stock.dropped)}; flaps, gear and spoilers stay in",
        f"not in the model, taken from {like.meta.name}: servos and their rates, structure, boom, probes, stations of the wake",
    ]
    return out
