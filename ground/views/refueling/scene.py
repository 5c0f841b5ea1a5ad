"""Shapes for the 3-D view, in metres and body axes (x forward, y right, z down) about the centre of gravity.

The silhouettes are drawn from the published overall dimensions (KC-135R: length 41.5, span 39.88; Learjet 24: length
13.2, span 10.36); everything between is by eye. Nothing here is used for anything but looking.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Boom

Array = NDArray[np.float64]
Point = tuple[float, float, float]
SIDES = 14  # of a fuselage section


@dataclass(frozen=True)
class Mesh:
    """Flat-shaded triangles: vertices (3n,3) [m], normals (3n,3), colours (3n,3) 0..255; three vertices a triangle."""

    vertices: Array
    normals: Array
    colors: NDArray[np.uint8]


def _tube(stations: list[tuple[float, float, float]], y: float = 0.0, sides: int = SIDES) -> Array:
    """Triangles (n,3,3) of a body of revolution along x: stations (x, radius, z of the axis), closed at both ends."""
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    rings = [
        np.stack([np.full(sides, x), y + r * np.cos(angle), z + r * np.sin(angle)], axis=1) for x, r, z in stations
    ]
    out: list[list[Array]] = []
    for a, b in pairwise(rings):
        for i in range(sides):
            j = (i + 1) % sides
            out += [[a[i], b[i], a[j]], [a[j], b[i], b[j]]]
    for ring, flip in ((rings[0], True), (rings[-1], False)):
        mid = ring.mean(axis=0)
        for i in range(sides):
            j = (i + 1) % sides
            out.append([mid, ring[i], ring[j]] if flip else [mid, ring[j], ring[i]])
    return np.array(out)


def _panel(root_le: Point, root_te: Point, tip_te: Point, tip_le: Point, thickness: float) -> Array:
    """Triangles of a flat tapered surface with a diamond-like section: thickest [m] at mid-chord of the root."""
    le0, te0, te1, le1 = (np.array(p) for p in (root_le, root_te, tip_te, tip_le))
    normal = np.cross(te0 - le0, le1 - le0)
    normal /= np.linalg.norm(normal)
    taper = np.linalg.norm(te1 - le1) / np.linalg.norm(te0 - le0)
    c0, c1 = 0.65 * le0 + 0.35 * te0, 0.65 * le1 + 0.35 * te1
    out: list[list[Array]] = []
    for side in (0.5 * thickness * normal, -0.5 * thickness * normal):
        p0, p1 = c0 + side, c1 + taper * side
        out += [[le0, p0, le1], [le1, p0, p1], [p0, te0, p1], [p1, te0, te1], [le1, p1, te1]]
    return np.array(out)


def _mirror(triangles: Array) -> Array:
    """The same on the other side: y -> -y, winding reversed."""
    return (triangles * np.array([1.0, -1.0, 1.0]))[:, ::-1]


def _both(triangles: Array) -> Array:
    return np.concatenate([triangles, _mirror(triangles)])


def _mesh(parts: list[tuple[Array, tuple[int, int, int]]]) -> Mesh:
    """One mesh of coloured parts, normals from the triangles, turned outwards from the part's middle line."""
    vertices, normals, colors = [], [], []
    for triangles, color in parts:
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        size = np.linalg.norm(normal, axis=1)
        keep = size > 1e-9
        triangles, normal = triangles[keep], normal[keep] / size[keep, None]
        vertices.append(triangles.reshape(-1, 3))
        normals.append(np.repeat(normal, 3, axis=0))
        colors.append(np.tile(np.array(color, dtype=np.uint8), (3 * len(triangles), 1)))
    return Mesh(np.concatenate(vertices), np.concatenate(normals), np.concatenate(colors))


GREY, DARK, LIGHT = (150, 158, 168), (84, 92, 104), (190, 197, 206)
WHITE, BLUE, NAVY = (232, 236, 240), (70, 130, 200), (40, 70, 120)


def tanker_mesh() -> Mesh:
    """Four-engine swept-wing transport to scale of the KC-135R."""
    fuselage = _tube(
        [
            (19.5, 0.15, 0.5), (18.6, 0.85, 0.35), (16.8, 1.5, 0.1), (14.0, 1.85, 0.0), (-8.0, 1.85, 0.0),
            (-13.0, 1.6, -0.25), (-18.0, 0.95, -0.8), (-22.0, 0.2, -1.3),
        ]
    )  # fmt: skip
    wing = _panel((7.4, 1.5, 0.9), (-2.6, 1.5, 0.9), (-10.4, 19.94, -1.2), (-7.9, 19.94, -1.2), 1.3)
    tail = _panel((-14.6, 0.6, -1.0), (-18.9, 0.6, -1.0), (-20.5, 6.13, -1.7), (-18.5, 6.13, -1.7), 0.45)
    fin = _panel((-12.0, 0.0, -1.0), (-19.5, 0.0, -1.2), (-21.4, 0.0, -9.6), (-18.4, 0.0, -9.6), 0.6)
    pod = _tube([(-12.0, 0.1, 0.9), (-14.0, 0.55, 0.75), (-19.0, 0.5, 0.6), (-22.3, 0.3, 1.4)])  # boom operator's pod
    nacelles = []
    for x, y, z in ((3.4, 8.4, 1.9), (-2.6, 14.0, 1.15)):
        nacelles.append(
            _both(_tube([(x + 2.4, 0.75, z), (x + 1.2, 1.05, z), (x - 0.9, 0.95, z), (x - 2.2, 0.5, z)], y))
        )
        pylon = _panel((x + 1.2, y, z - 0.9), (x - 1.8, y, z - 0.7), (x - 3.0, y, z - 1.6), (x - 0.6, y, z - 1.6), 0.25)
        nacelles.append(_both(pylon))
    return _mesh(
        [
            (fuselage, GREY),
            (_both(wing), LIGHT),
            (_both(tail), LIGHT),
            (fin, GREY),
            (pod, GREY),
            (np.concatenate(nacelles), DARK),
        ]
    )


def receiver_mesh() -> Mesh:
    """Twin-engine business jet with tip tanks and T-tail, to scale of the Learjet 24."""
    fuselage = _tube(
        [
            (6.6, 0.05, 0.25), (5.9, 0.32, 0.15), (4.6, 0.62, 0.0), (3.2, 0.8, -0.1), (-2.0, 0.8, -0.1),
            (-4.3, 0.55, -0.25), (-6.3, 0.15, -0.4),
        ]
    )  # fmt: skip
    canopy = _tube([(4.3, 0.15, -0.5), (3.6, 0.45, -0.52), (2.6, 0.5, -0.5), (1.8, 0.2, -0.5)])
    wing = _panel((1.5, 0.6, 0.45), (-1.3, 0.6, 0.45), (-1.2, 5.0, 0.2), (0.15, 5.0, 0.2), 0.32)
    tank = _tube([(1.9, 0.05, 0.15), (1.2, 0.27, 0.15), (-1.2, 0.27, 0.15), (-2.2, 0.05, 0.15)], 4.95, 10)
    fin = _panel((-4.0, 0.0, -0.5), (-6.3, 0.0, -0.5), (-6.9, 0.0, -2.5), (-5.5, 0.0, -2.5), 0.22)
    tail = _panel((-5.4, 0.0, -2.5), (-6.9, 0.0, -2.5), (-7.0, 2.2, -2.5), (-6.2, 2.2, -2.5), 0.15)
    engine = _tube([(-1.4, 0.3, -0.55), (-1.9, 0.4, -0.55), (-3.4, 0.38, -0.55), (-4.0, 0.24, -0.55)], 1.15, 10)
    return _mesh(
        [
            (fuselage, WHITE), (canopy, NAVY), (_both(wing), WHITE), (_both(tank), BLUE), (fin, BLUE),
            (_both(tail), WHITE), (_both(engine), DARK),
        ]
    )  # fmt: skip


def boom_point(boom: Boom, elevation: Array, azimuth: Array, length: Array | float) -> Array:
    """Points (n,3) [m] in tanker body axes at `length` from the pivot: elevation negative below the longitudinal axis,
    azimuth positive to the right (aircraft file, table boom)."""
    ce = np.cos(elevation)
    out = np.stack([-ce * np.cos(azimuth), ce * np.sin(azimuth), -np.sin(elevation)], axis=-1)
    return np.array(boom.pivot_m) + np.asarray(length)[..., None] * out


def envelope_lines(boom: Boom, steps: int = 12) -> list[Array]:
    """Polylines [m] of the sector the nozzle may be in: inner and outer arcs at the limits, corner spokes, mid arcs."""
    el = np.radians(np.linspace(*boom.elevation_deg, steps))
    az = np.radians(np.linspace(*boom.azimuth_deg, steps))
    near, far = (boom.length_retracted_m + e for e in boom.extension_m)
    lines: list[Array] = []
    for length in (near, far):
        for e in np.radians([*boom.elevation_deg, float(np.mean(boom.elevation_deg))]):
            lines.append(boom_point(boom, np.full(steps, e), az, np.full(steps, length)))
        for a in np.radians([*boom.azimuth_deg, float(np.mean(boom.azimuth_deg))]):
            lines.append(boom_point(boom, el, np.full(steps, a), np.full(steps, length)))
    for e in np.radians(boom.elevation_deg):
        for a in np.radians(boom.azimuth_deg):
            lines.append(boom_point(boom, np.full(2, e), np.full(2, a), np.array([near, far])))
    return lines


def boom_strips(boom: Boom, elevation: Array, azimuth: Array, extension: Array) -> tuple[Array, Array]:
    """Fixed tube and telescoping tube as two-point strips (n,2,3) each [m]; extension clamped to what exists."""
    ext = np.clip(extension, 0.0, boom.extension_m[1])
    pivot = np.broadcast_to(np.array(boom.pivot_m), (len(elevation), 3))
    mid = boom_point(boom, elevation, azimuth, np.full(len(elevation), boom.length_retracted_m))
    end = boom_point(boom, elevation, azimuth, boom.length_retracted_m + ext)
    return np.stack([pivot, mid], axis=1), np.stack([mid, end], axis=1)
