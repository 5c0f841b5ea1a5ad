"""The aircraft file's derivatives fitted to what a bench reads: least squares in the form of aircraft/sixdof/aero.py."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hil_scripts.identify.bench import Bench, Point, Read
from hil_scripts.identify.regress import CONSTANT, Equation, least_squares

Arr = NDArray[np.float64]
POINTS, SEED = 1500, 1
# half widths of the box around the trim: alpha, beta [rad]; rates [rad/s]; surfaces [rad]; pitch and roll that tell the rate of
# incidence from the pitch rate, as gravity is all they change
ALPHA, BETA, RATES, SURFACE, PITCH, ROLL = math.radians(2.0), math.radians(3.0), (0.05, 0.03, 0.03), 0.1, 0.2, 1.2
DRAG_BETA = math.radians(0.1)


def sample(bench: Bench, trim: Point, rng: np.random.Generator, n: int = POINTS) -> list[tuple[Point, Read]]:
    """Points spread evenly over the box around a trim, and what is read there."""
    out = []
    for _ in range(n):
        u = rng.uniform(-1.0, 1.0, 10)
        x = Point(
            trim.V,
            trim.alpha + ALPHA * u[0],
            BETA * u[1],
            (RATES[0] * u[2], RATES[1] * u[3], RATES[2] * u[4]),
            (SURFACE * u[5], trim.surfaces[1] + SURFACE * u[6], SURFACE * u[7]),
            (trim.attitude[0] + PITCH * u[8], ROLL * u[9]),
        )
        out.append((x, bench.read(x)))
    return out


def derivatives(bench: Bench, trim: Point) -> dict[str, Equation]:
    """Equations of CL, CD, Cm, CY, Cl, Cn. Raises ValueError for what cannot be told apart."""
    rng = np.random.default_rng(SEED)
    points = sample(bench, trim, rng)
    one = [1.0] * len(points)
    al, be = [x.alpha for x, _ in points], [x.beta for x, _ in points]
    da, de, dr = ([x.surfaces[i] for x, _ in points] for i in range(3))
    p, q, r, ad = ([getattr(y, k) for _, y in points] for k in ("p", "q", "r", "alphadot"))

    def longitudinal(name: str) -> Mapping[str, Sequence[float]]:
        return {
            f"{name}0": one, f"{name}_alpha": al, f"{name}_alphadot": ad, f"{name}_q": q, f"{name}_de": de,
        }  # fmt: skip

    def lateral(name: str, aileron: bool) -> Mapping[str, Sequence[float]]:
        columns: dict[str, Sequence[float]] = {CONSTANT: one, f"{name}_beta": be, f"{name}_p": p, f"{name}_r": r}
        return columns | ({f"{name}_da": da} if aileron else {}) | {f"{name}_dr": dr}

    out = {}
    for name in ("CL", "Cm"):
        out[name] = least_squares(name, longitudinal(name), [getattr(y, name) for _, y in points])
    for name in ("CY", "Cl", "Cn"):
        out[name] = least_squares(name, lateral(name, name != "CY"), [getattr(y, name) for _, y in points])
    out["CD"] = polar(bench, trim, out["CL"], rng, points)
    return out


def static_lift(lift: Equation, x: Point) -> float:
    """CL0 + CL_alpha alpha + CL_de de."""
    v = lift.values
    return v["CL0"] + v["CL_alpha"] * x.alpha + v["CL_de"] * x.surfaces[1]


def polar(
    bench: Bench, trim: Point, lift: Equation, rng: np.random.Generator, box: list[tuple[Point, Read]]
) -> Equation:
    """CD0 and K where it is flown: without sideslip, the elevator that of the trim; `rest`: RMS left over the whole box."""
    near = []
    for _ in range(POINTS // 5):
        u = rng.uniform(-1.0, 1.0, 2)
        x = replace(trim, alpha=trim.alpha + ALPHA * u[0], beta=DRAG_BETA * u[1])
        near.append((x, bench.read(x)))
    columns = {"CD0": [1.0] * len(near), "K": [static_lift(lift, x) ** 2 for x, _ in near]}
    e = least_squares("CD", columns, [y.CD for _, y in near])
    left = np.array([y.CD - e.values["CD0"] - e.values["K"] * static_lift(lift, x) ** 2 for x, y in box])
    return replace(e, rest=float(np.sqrt(np.mean(left**2))))
