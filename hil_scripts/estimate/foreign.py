"""Logs of other formats as the columns of a flight log: which messages hold attitude, rates, velocity and airspeed in MAVLink, in
PX4's ULog and in ArduPilot's DataFlash, everything at the times of the airspeed.

Between its samples a sensor is interpolated (angles the short way), never over more than `GAP_US`. An airspeed that is calibrated
becomes a true one by the standard atmosphere's density at the logged height; a wind logged without a vertical part gets none.
Position is not read: units are the format's, there is nothing to check with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ground.align import align
from ground.columns import LogError as UnreadableError
from ground.export.sheets import Sheet
from ground.reading.log import Log, kind_of, read
from hil_scripts.estimate.columns import ATT, RATE, SPEED, TIME, VANES, VEL, WIND, Array, LogError

GAP_US = 1_000_000  # [us]
COVERS = 0.9  # of the samples: then those without it go, else it does
SUFFIXES = {"tlog": (".tlog",), "ulog": (".ulg", ".ulog"), "dataflash": (".bin", ".log")}
DEG, CM = np.pi / 180.0, 0.01


@dataclass(frozen=True)
class Source:
    """Where a log has some columns: sheet, columns, what one of theirs is in SI; then what makes of them those wanted."""

    sheet: str
    columns: tuple[str, ...]
    factor: float = 1.0
    make: Callable[[Array], Array] = lambda x: x
    calibrated: bool = False  # an airspeed


def _from_quaternion(q: Array) -> Array:
    """(psi, theta, phi) [n,3] of quaternions [n,4], scalar first."""
    return np.asarray(Rotation.from_quat(q, scalar_first=True).as_euler("ZYX"))


def _flat(wind: Array) -> Array:
    """Wind [n,3] of its horizontal part [n,2]."""
    return np.column_stack([wind, np.zeros(len(wind))])


def _blown(x: Array) -> Array:
    """Wind [n,3] NED of ArduPilot's WIND (from [deg], speed, down)."""
    return np.column_stack([-x[:, 1] * np.cos(x[:, 0] * DEG), -x[:, 1] * np.sin(x[:, 0] * DEG), x[:, 2]])


Q4 = tuple(f"q[{i}]" for i in range(4))
XYZ = tuple(f"xyz[{i}]" for i in range(3))
Sources = Mapping[str, tuple[Source, ...]]
MAVLINK: Sources = {
    "airspeed": (Source("AIR_DATA", ("airspeed/0",)), Source("VFR_HUD", ("airspeed",), calibrated=True)),
    "height": (Source("VFR_HUD", ("alt",)), Source("HIL_SENSOR", ("pressure_alt",))),
    "attitude": (Source("ATTITUDE_QUATERNION", ("q1", "q2", "q3", "q4"), make=_from_quaternion),
                 Source("ATTITUDE", ("yaw", "pitch", "roll"))),
    "rates": (Source("HIL_SENSOR", ("xgyro", "ygyro", "zgyro")), Source("ATTITUDE", ("rollspeed", "pitchspeed", "yawspeed"))),
    "velocity": (Source("LOCAL_POSITION_NED", ("vx", "vy", "vz")), Source("GLOBAL_POSITION_INT", ("vx", "vy", "vz"), CM)),
    "wind": (Source("WIND_COV", ("wind_x", "wind_y", "wind_z")), Source("WIND", ("direction", "speed", "speed_z"), make=_blown)),
    "beta": (Source("AIR_DATA", ("beta/0",)),),
    "alpha": (Source("AIR_DATA", ("alpha/0",)),),
}  # fmt: skip
ULOG: Sources = {
    "airspeed": (Source("airspeed_validated", ("true_airspeed_m_s",)), Source("airspeed", ("true_airspeed_m_s",))),
    "attitude": (Source("vehicle_attitude", Q4, make=_from_quaternion),),
    "rates": (Source("vehicle_angular_velocity", XYZ), Source("vehicle_attitude", ("rollspeed", "pitchspeed", "yawspeed"))),
    "velocity": (Source("vehicle_local_position", ("vx", "vy", "vz")),),
    "wind": (Source("wind", ("windspeed_north", "windspeed_east"), make=_flat),
             Source("wind_estimate", ("windspeed_north", "windspeed_east"), make=_flat)),
}  # fmt: skip


def _kalman(n: int, columns: tuple[str, ...], make: Callable[[Array], Array] = lambda x: x) -> tuple[Source, ...]:
    return tuple(Source(f"{name}{n}{core}", columns, make=make) for name in ("XKF", "NKF") for core in ("", "/0"))


DATAFLASH: Sources = {
    "airspeed": (Source("ARSP", ("Airspeed",), calibrated=True), Source("ARSP/0", ("Airspeed",), calibrated=True)),
    "height": (Source("GPS", ("Alt",)), Source("GPS/0", ("Alt",)), Source("AHR2", ("Alt",))),
    "attitude": (Source("ATT", ("Yaw", "Pitch", "Roll"), DEG),),
    "rates": (Source("IMU", ("GyrX", "GyrY", "GyrZ")), Source("IMU/0", ("GyrX", "GyrY", "GyrZ"))),
    "velocity": _kalman(1, ("VN", "VE", "VD")),
    "wind": _kalman(2, ("VWN", "VWE"), _flat),
}
KINDS: Mapping[str, Sources] = {"tlog": MAVLINK, "ulog": ULOG, "dataflash": DATAFLASH}
NAMES = {"attitude": ATT, "rates": RATE, "velocity": VEL, "airspeed": (SPEED,), "wind": WIND,
         "beta": VANES[:1], "alpha": VANES[1:]}  # fmt: skip
NEEDED = ("airspeed", "attitude", "rates", "velocity")


def is_foreign(path: Path) -> bool:
    """Whether a file is a log of another format than a table of columns."""
    kind = kind_of(path)
    return kind in ("ulog", "dataflash") or path.suffix.lower() in SUFFIXES["tlog"]


def columns(path: Path) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Columns [n] of a flight log by name, and what was noticed. Raises LogError naming what the log does not have."""
    try:
        log = read(path)
    except UnreadableError as e:
        raise LogError(str(e)) from None
    notes = [f"left out of the file: {log.lost}"] if log.lost else []
    systems = sorted({s.name.partition("/")[0] for s in log.sheets}) if log.kind == "tlog" else [""]
    missing: list[str] = []
    for system in systems:
        found = {what: _first(log, system, sources) for what, sources in KINDS[log.kind].items()}
        lacks = [what for what in NEEDED if found[what] is None]
        if not lacks:
            if system:
                notes.append(f"system {system}")
            return _together(path, {k: v for k, v in found.items() if v is not None}, notes)
        missing = lacks if not missing or len(lacks) < len(missing) else missing
    said = "; ".join(f"{what}: {', '.join(s.sheet for s in KINDS[log.kind][what])}" for what in missing or NEEDED)
    raise LogError(f"{path}: a {log.kind} log needs, and this has not: {said}")


def _first(log: Log, system: str, sources: tuple[Source, ...]) -> tuple[Source, Sheet] | None:
    """The first of the sources the log has, with its sheet."""
    for source in sources:
        sheet = log.get(f"{system}/{source.sheet}" if system else source.sheet)
        if sheet is not None and len(sheet) > 1 and all(c in sheet.columns for c in source.columns):
            return source, sheet
    return None


def _values(source: Source, sheet: Sheet) -> Array:
    raw = np.column_stack([sheet.columns[c].astype(np.float64) for c in source.columns]) * source.factor
    return source.make(raw)


def _together(
    path: Path, found: dict[str, tuple[Source, Sheet]], notes: list[str]
) -> tuple[dict[str, Array], tuple[str, ...]]:
    base = found["airspeed"][1].t_us
    rows = np.arange(len(base))
    fits = {what: align(sheet.t_us, base, GAP_US) for what, (_, sheet) in found.items()}
    values = {what: _values(*source) for what, source in found.items()}
    for what, fit in fits.items():
        if what in NEEDED or len(fit) >= COVERS * len(base):
            rows = np.intersect1d(rows, fit.at, assume_unique=True)
    known = np.any(fits["velocity"].of(values["velocity"]) != 0.0, axis=1)  # an estimator that has not begun says 0
    begun = np.intersect1d(rows, fits["velocity"].at[known], assume_unique=True)
    if len(begun) < len(rows):
        notes.append(f"velocity is exactly 0 in {len(rows) - len(begun)} samples: left out")
    rows = begun
    out: dict[str, Array] = {TIME.name: base[rows] / 1e6}
    for what, (source, _) in found.items():
        fit = fits[what]
        if len(np.setdiff1d(rows, fit.at)):
            notes.append(f"{what} ({source.sheet}) does not cover the flight: left out")
            continue
        at = fit.of(values[what], angle=what == "attitude")[np.searchsorted(fit.at, rows)]
        if what == "height":
            out[what] = at[:, 0]
            continue
        for i, column in enumerate(NAMES[what]):
            out[column.name] = at[:, i]
    height = out.pop("height", None)
    if found["airspeed"][0].calibrated:
        if height is None:
            raise LogError(f"{path}: its airspeed is calibrated, and no height says how thin the air was")
        out[SPEED.name] = out[SPEED.name] / np.sqrt(density_ratio(height))
        notes.append("airspeed: calibrated as logged, taken as equivalent and made true by the standard atmosphere")
    return out, tuple(notes)


def density_ratio(height: Array) -> Array:
    """Density over that at sea level at pressure altitudes [n] m up to 11 km: ICAO Doc 7488, troposphere (288 K at sea level)."""
    return np.asarray((1.0 - 0.0065 * np.clip(height, -1000.0, 11000.0) / 288.15) ** 4.2559)
