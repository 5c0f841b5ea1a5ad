"""Air-data messages in words and geometry: channels and alarms, the tanker's air-path axes, error ellipses, vortices.

Channel c = 3 variable + probe; variables V, beta, alpha; probes nose, left tip, right tip (WKF_AIR_CHANNEL).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import load_aircraft
from ground.align import GAP_US
from ground.columns import Columns
from ground.views.refueling.aircraft import RECEIVER, TANKER

Array = NDArray[np.float64]
VARIABLES = ("V", "beta", "alpha")
PROBES = ("nose", "left", "right")
NOT_CHECKED = "not checked"
CHANNELS = tuple(f"{v} {p}" for v in VARIABLES for p in PROBES)
# where a high reading of each probe points in the parity plane (orthonormal basis, equal noise)
DIRECTIONS = np.array(
    [[math.sqrt(2 / 3), 0.0], [-math.sqrt(1 / 6), math.sqrt(0.5)], [-math.sqrt(1 / 6), -math.sqrt(0.5)]]
)


def has_airdata(tlm: Columns) -> bool:
    """True if the receiver sent FDI_STATUS or WAKE_POSITION."""
    return tlm.get(RECEIVER, "FDI_STATUS") is not None or tlm.get(RECEIVER, "WAKE_POSITION") is not None


def channel_words(mask: int, negative: int | None = None) -> str:
    """Channels of a 9-bit mask by name, "" if none; with `negative` each is called high or low."""
    names = []
    for c, name in enumerate(CHANNELS):
        if mask >> c & 1:
            sign = "" if negative is None else " low" if negative >> c & 1 else " high"
            names.append(name + sign)
    return ", ".join(names)


def alarm_words(fdi: Mapping[str, Any]) -> str:
    """What a FDI_STATUS complains of now: variables in alarm and the channels blamed; "" if nothing."""
    if not fdi["alarm"]:
        return ""
    names = " ".join(v for i, v in enumerate(VARIABLES) if fdi["alarm"] >> i & 1)
    blamed = channel_words(fdi["isolated"], fdi["negative"])
    return f"{names} ({blamed})" if blamed else f"{names} (not isolated)"


def unchecked_words(fdi: Mapping[str, Any], wake: Mapping[str, Any] | None) -> str:
    """Why a FDI_STATUS without alarm says nothing, "" if it does: readings are judged against a wake estimate (None: the
    aircraft sends none)."""
    if not fdi["valid"]:
        return NOT_CHECKED
    if wake is not None and not wake["valid"]:
        return f"{NOT_CHECKED}: wake position not valid: {wake['reason'] or 'no reason given'}"
    return ""


def fdi_words(fdi: Mapping[str, Any], wake: Mapping[str, Any] | None = None) -> str:
    """One line on a FDI_STATUS and the WAKE_POSITION of its time: alarm, what is kept out of navigation, how many exclusions
    so far."""
    parts = []
    if words := alarm_words(fdi):
        parts.append(f"ALARM {words}")
    elif words := unchecked_words(fdi, wake):
        parts.append(words)
    if fdi["excluded"]:
        parts.append(f"EXCLUDED {channel_words(fdi['excluded'])}")
    if fdi["exclusions"]:
        parts.append(f"{fdi['exclusions']} exclusions so far")
    return "; ".join(parts) or "ok"


def wake_words(wake: Mapping[str, Any]) -> str:
    """One line on a WAKE_POSITION: lateral and vertical position with 2 sigma, or why there is none."""
    if not wake["valid"]:
        return f"not valid: {wake['reason'] or 'no reason given'}"
    (_, y, z), (yy, _, zz) = wake["pos"], wake["cov"]
    words = f"y {y:+.2f} z {z:+.2f} m (2 sigma {2 * math.sqrt(max(yy, 0.0)):.2f} {2 * math.sqrt(max(zz, 0.0)):.2f})"
    words += f", wake x{wake['scale'][0]:.2f} {wake['scale'][1]:.2f}"
    return words + (f", {wake['restarts']} restarts" if wake["restarts"] else "")


def to_air_path(xi: Array, alpha: Array, beta: Array) -> Array:
    """Vectors (n,3) from tanker body axes to its air-path axes (x along its air velocity, y right, z down in its plane
    of symmetry), alpha and beta (n,) [rad] of the tanker (Etkin, Dynamics of Atmospheric Flight, eq. 4.2.4).
    """
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    x, y, z = np.asarray(xi, dtype=np.float64).T
    forward = ca * x + sa * z
    return np.stack([cb * forward + sb * y, cb * y - sb * forward, ca * z - sa * x], axis=-1)


@dataclass(frozen=True)
class TruePosition:
    """True receiver position in the tanker's air-path axes: t_us (n,) [us], pos (n,3) [m], and the tanker's alpha, beta
    (n,) [rad] that made it."""

    t_us: NDArray[np.int64]
    pos: Array
    alpha: Array
    beta: Array

    def at(self, t_us: NDArray[np.int64]) -> tuple[NDArray[np.bool_], Array]:
        """(inside, pos (n,3)): positions at other times, linear between samples; `inside` False beyond the log and in gaps."""
        if not len(self.t_us):
            return np.zeros(len(t_us), dtype=bool), np.zeros((len(t_us), 3))
        k = np.searchsorted(self.t_us, t_us, side="right") - 1
        left, right = self.t_us[np.maximum(k, 0)], self.t_us[np.minimum(k + 1, len(self.t_us) - 1)]
        inside = (k >= 0) & ((t_us == left) | ((t_us < right) & (right - left <= GAP_US)))
        return inside, np.stack([np.interp(t_us, self.t_us, self.pos[:, i]) for i in range(3)], axis=1)

    def turn(self, t_us: NDArray[np.int64], vector: Array) -> Array:
        """Vectors (n,3) in tanker body axes at times t_us, in air-path axes."""
        if not len(self.t_us):
            return np.asarray(vector, dtype=np.float64)
        alpha, beta = (np.interp(t_us, self.t_us, a) for a in (self.alpha, self.beta))
        return to_air_path(vector, alpha, beta)


def true_position(truth: Columns) -> TruePosition:
    """TRUTH.xi of the receiver turned by the tanker's true incidence and sideslip of the same instant."""
    rows, lead = truth.get(RECEIVER, "TRUTH"), truth.get(TANKER, "TRUTH")
    if rows is None or lead is None:
        empty = np.empty(0)
        return TruePosition(np.empty(0, dtype=np.int64), np.empty((0, 3)), empty, empty)
    t_us, i, j = np.intersect1d(rows.t_us, lead.t_us, return_indices=True)
    alpha, beta = lead["alpha"][j].astype(np.float64), lead["beta"][j].astype(np.float64)
    return TruePosition(t_us, to_air_path(rows["xi"][i], alpha, beta), alpha, beta)


def ellipses(centre: Array, cov: Array, factor: float = 2.0, points: int = 40) -> Array:
    """Closed error ellipses (n, points+1, 2) about centres (n,2) [m]: `factor` sigma of covariances (n,3) yy, yz, zz
    [m^2] (Cholesky factor of each times the unit circle; a covariance that is none gives a dot)."""
    angle = np.linspace(0.0, 2.0 * np.pi, points + 1)
    yy, yz, zz = np.asarray(cov, dtype=np.float64).T
    a = np.sqrt(np.maximum(yy, 0.0))
    b = np.divide(yz, a, out=np.zeros_like(a), where=a > 0.0)
    c = np.sqrt(np.maximum(zz - b * b, 0.0))
    y = a[:, None] * np.cos(angle)
    z = b[:, None] * np.cos(angle) + c[:, None] * np.sin(angle)
    return np.asarray(centre, dtype=np.float64)[:, None, :] + factor * np.stack([y, z], axis=-1)


@dataclass(frozen=True)
class Vortices:
    """What to draw of the tanker on the map, air-path axes [m]: surfaces as (y, z) end points (2,2), trailing vortices
    as centre (n,2) and core radius (n,)."""

    wing: Array
    tail: Array
    centre: Array
    core: Array


def vortices(run: Path, alpha: float) -> Vortices | None:
    """Surfaces and trailing vortices of the run's tanker at incidence alpha [rad], spacing pi/4 of the span.

    From RUN/scenario.toml (plant's wake); None if the file or the wake is missing or cannot be read.
    """
    try:
        scenario = tomllib.loads((run / "scenario.toml").read_text())
        wake = scenario["wind"]["wake"]
        [leader] = [a for a in scenario["aircraft"] if a["name"] == wake["source"]]
        own = run / leader["file"]  # a run folder keeps the files it was flown with
        ac = load_aircraft(str(own) if own.is_file() else leader["file"])
        cores = [float(wake["core_wing_m"])] * 2 + [float(wake["core_tail_m"])] * 2
    except (OSError, ValueError, KeyError, TypeError):
        return None
    at = to_air_path(np.array([ac.wake.wing_ac_m, ac.wake.tail_ac_m]), np.full(2, alpha), np.zeros(2))
    spans = (ac.geometry.b_m, ac.wake.tail_span_m or ac.geometry.b_m / 3.0)
    surface, centre = [], []
    for (_, y, z), span in zip(at, spans, strict=True):
        surface.append(np.array([[y - span / 2, z], [y + span / 2, z]]))
        centre += [[y - math.pi * span / 8, z], [y + math.pi * span / 8, z]]
    return Vortices(surface[0], surface[1], np.array(centre), np.array(cores))
