"""What a run holds, as signals: a path, times, values in SI, a unit. Pictures draw these, the arrays of `ground.Run` are these.

Paths mirror the data path: truth, nav, guid, ctrl, timing, sensors, then the aircraft's name. A vector is one signal with named
parts; `<path>/<part>` is a part of it. Beside them every field of every message as it was on the wire:
`message/<aircraft>/<MESSAGE>/<field>` of truth, telemetry and plant, `link/<aircraft>/<way>/<MESSAGE>/<field>` of the link log,
the way being one of `WAYS`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flightsw.icd.dialect import HOUSE
from flightsw.icd.tlog import GROUND_IN, GROUND_OUT, LINK_IN, LINK_OUT
from ground.columns import Columns, Table
from ground.geometry import quat_euler, wrap
from ground.link.packets import IDS, health_words, phase_name

if TYPE_CHECKING:
    from ground.run import Run

NED, XYZ, PQR, WXYZ = (("n", "e", "d"), ("x", "y", "z"), ("p", "q", "r"), ("w", "x", "y", "z"))
SURFACES = ("aileron", "elevator", "rudder")
WAYS = {
    LINK_IN: "in",
    LINK_OUT: "out",
    GROUND_IN: "ground_in",
    GROUND_OUT: "ground_out",
}  # link of a link log -> its name


@dataclass(frozen=True, eq=False)
class Signal:
    """One quantity. t_us [N] sample times [us], ascending; values [N] or [N,k] numbers in `unit`, or [N] texts; parts: names of
    the k columns; source: what it was read from. Unpacks to (times [s], values, unit)."""

    path: str
    t_us: NDArray[np.int64]
    values: NDArray
    unit: str = ""
    parts: tuple[str, ...] = ()
    source: str = ""

    def __iter__(self) -> Iterator[object]:
        return iter((self.t, self.values, self.unit))

    def __len__(self) -> int:
        return len(self.t_us)

    @property
    def t(self) -> NDArray[np.float64]:
        """Sample times [N] s."""
        return self.t_us / 1e6

    @property
    def rate_hz(self) -> float:
        """Samples per second by the median step; 0 for fewer than two."""
        step = float(np.median(np.diff(self.t_us))) if len(self) > 1 else 0.0
        return 1e6 / step if step > 0.0 else 0.0

    @property
    def is_text(self) -> bool:
        """Whether the values are words."""
        return self.values.dtype.kind in "OUS"

    @property
    def is_quaternion(self) -> bool:
        """Whether the values are rotations, scalar first."""
        return self.parts == WXYZ

    def thinned(self, period_us: int) -> Signal:
        """At most one sample per period [us]: the first in each."""
        keep = np.flatnonzero(np.diff(self.t_us // period_us, prepend=-1) != 0)
        return replace(self, t_us=self.t_us[keep], values=self.values[keep])

    def columns(self) -> dict[str, NDArray]:
        """Its parts by full path, or itself."""
        if not self.parts:
            return {self.path: self.values}
        return {f"{self.path}/{p}": self.values[:, i] for i, p in enumerate(self.parts)}

    def part(self, name: str) -> Signal:
        """One of its parts as a signal. Raises KeyError."""
        if name not in self.parts:
            raise KeyError(name)
        return replace(self, path=f"{self.path}/{name}", values=self.values[:, self.parts.index(name)], parts=())


@dataclass(frozen=True)
class _From:
    """Makes the signals of one table under `<group>/<aircraft>/`."""

    at: str
    source: str
    t_us: NDArray[np.int64]

    def __call__(self, key: str, values: NDArray, unit: str = "", parts: tuple[str, ...] = ()) -> Signal:
        if values.dtype.kind == "f":
            values = values.astype(np.float64)
        return Signal(f"{self.at}/{key}", self.t_us, values, unit, parts, self.source)


def _columns(table: Table, names: tuple[str, ...]) -> NDArray:
    return np.stack([table[n] for n in names], axis=1)


def truth(run: Run, sysid: int, name: str) -> Iterator[Signal]:
    """truth/<aircraft>/...: state, air data, wind, controls."""
    d = run.truth.get(sysid, "TRUTH")
    if d is None:
        return
    to, euler = _From(f"truth/{name}", "TRUTH", d.t_us), quat_euler(d["q_nb"])
    yield to("position", d["pos_n"], "m", NED)
    yield to("velocity", d["vel_n"], "m/s", NED)
    yield to("attitude", d["q_nb"], "", WXYZ)
    yield to("rates", d["w_b"], "rad/s", PQR)
    yield to("wind", d["wind_n"], "m/s", NED)
    yield to("wind_rotation", d["wind_rot"], "rad/s", PQR)
    yield to("V", d["V"], "m/s")
    yield to("altitude", -d["pos_n"][:, 2], "m")
    for key, values in (("bank", euler[:, 2]), ("pitch", euler[:, 1]), ("heading", euler[:, 0])):
        yield to(key, values, "rad")
    yield to("alpha", d["alpha"], "rad")
    yield to("beta", d["beta"], "rad")
    yield to("mass", d["mass"], "kg")
    for i, key in enumerate(SURFACES):
        yield to(f"controls/{key}", d["controls"][:, i], "rad")
    yield to("controls/thrust", d["controls"][:, 3], "N")


def nav(run: Run, sysid: int, name: str) -> Iterator[Signal]:
    """nav/<aircraft>/...: estimates and their 1-sigma, while valid."""
    table = run.tlm.get(sysid, "NAV_STATE")
    if table is not None:
        d = table.pick(table["valid"] != 0)
        to = _From(f"nav/{name}", "NAV_STATE", d.t_us)
        yield to("wind", d["wind"], "m/s", NED)
        yield to("wind_sigma", d["wind_sigma"], "m/s", NED)
        yield to("V", d["V"], "m/s")
        yield to("alpha", d["alpha"], "rad")
        yield to("beta", d["beta"], "rad")
        yield to("bank", d["phi"], "rad")
        yield to("pitch", d["theta"], "rad")
        yield to("heading", wrap(d["psi"].astype(np.float64)), "rad")
        yield to("rates", _columns(d, PQR), "rad/s", PQR)
        yield to("position_sigma", d["pos_sigma"], "m", NED)
        yield to("attitude_sigma", d["att_sigma"], "rad", ("heading", "pitch", "bank"))
        yield to("nis", d["nis"] / np.maximum(d["nis_dof"], 1))
    local = run.tlm.get(sysid, "LOCAL_POSITION_NED")
    if local is not None:
        to = _From(f"nav/{name}", "LOCAL_POSITION_NED", local.t_us)
        yield to("position", _columns(local, XYZ), "m", NED)
        yield to("velocity", _columns(local, ("vx", "vy", "vz")), "m/s", NED)


def guid(run: Run, sysid: int, name: str) -> Iterator[Signal]:
    """guid/<aircraft>/...: phase, references."""
    d = run.tlm.get(sysid, "MISSION_STATUS")
    if d is None:
        return
    to = _From(f"guid/{name}", "MISSION_STATUS", d.t_us)
    yield to("phase", _words(d["phase"], phase_name))
    if np.any(d["cmd_V"] > 0):
        yield to("V", d["cmd_V"], "m/s")
        yield to("altitude", d["cmd_alt"], "m")


def ctrl(run: Run, sysid: int, name: str) -> Iterator[Signal]:
    """ctrl/<aircraft>/...: commands of the actuators."""
    d = run.tlm.get(sysid, "MISSION_STATUS")
    if d is None:
        return
    to = _From(f"ctrl/{name}", "MISSION_STATUS", d.t_us)
    for key in SURFACES:
        yield to(key, d[key], "rad")
    yield to("throttle", d["throttle"])


def timing(run: Run, sysid: int, name: str) -> Iterator[Signal]:
    """timing/<aircraft>/...: execution time and lateness of the loop, slips."""
    d = run.tlm.get(sysid, "LOOP_TIMING")
    if d is None:
        return
    to = _From(f"timing/{name}", "LOOP_TIMING", d.t_us)
    for key in ("exec_mean", "exec_max", "late_p50", "late_p99", "late_max"):
        yield to(key, 1e-6 * d[key].astype(np.float64), "s")
    yield to("slips", d["slips"])


def sensors(run: Run, sysid: int, name: str) -> Iterator[Signal]:
    """sensors/<aircraft>/...: health, and what the onboard software was fed, from its link log."""
    d = run.tlm.get(sysid, "HEALTH_STATUS")
    if d is not None:
        to = _From(f"sensors/{name}", "HEALTH_STATUS", d.t_us)
        yield to("health", _words(d["failed"], health_words))
        yield to("bad_packets", d["bad_packets"])
        yield to("rejected", d["rejected"])
    log = run.link(name)
    if (d := _inbound(log, "HIL_SENSOR")) is not None:
        to = _From(f"sensors/{name}", "HIL_SENSOR", d.t_us)
        yield to("imu/acc", _columns(d, ("xacc", "yacc", "zacc")), "m/s^2", XYZ)
        yield to("imu/gyro", _columns(d, ("xgyro", "ygyro", "zgyro")), "rad/s", XYZ)
        yield to("baro/altitude", d["pressure_alt"], "m")
    if (d := _inbound(log, "AIR_DATA")) is not None:
        to, n = _From(f"sensors/{name}", "AIR_DATA", d.t_us), max(1, int(d["count"].max()))
        for key, field, unit in (("V", "airspeed", "m/s"), ("alpha", "alpha", "rad"), ("beta", "beta", "rad")):
            yield to(f"air/{key}", d[field][:, :n], unit, tuple(str(i + 1) for i in range(n)))
    if (d := _inbound(log, "REL_NAV")) is not None:
        yield _From(f"sensors/{name}", "REL_NAV", d.t_us)("relnav", _columns(d, XYZ), "m", XYZ)


Group = Callable[["Run", int, str], Iterator[Signal]]
GROUPS: Mapping[str, Group] = {f.__name__: f for f in (truth, nav, guid, ctrl, timing, sensors)}


def _inbound(log: Columns, message: str) -> Table | None:
    """Rows of a message that came from the plant, whatever system id it used."""
    for (_, kind), table in log.tables.items():
        if kind == message:
            rows = table.pick(table.link == LINK_IN)
            if len(rows):
                return rows
    return None


def _words(values: NDArray, word: Callable[[int], str]) -> NDArray:
    """Numbers in words, each looked up once."""
    kinds, which = np.unique(values, return_inverse=True)
    return np.array([word(int(k)) for k in kinds], dtype=object)[which]


def fields(log: Columns, sysids: Collection[int], top: str, link: int | None = None) -> Iterator[Signal]:
    """<top>/<MESSAGE>/<field> of everything a log has of some systems (and of one link of theirs), as it was on the wire; rows in
    the order of their time."""
    found: dict[str, list[Table]] = {}
    for (who, message), table in sorted(log.tables.items()):
        if who in sysids:
            found.setdefault(message, []).append(table if link is None else table.pick(table.link == link))
    for message, tables in sorted(found.items()):
        t_us, rows = np.concatenate([t.t_us for t in tables]), np.concatenate([t.rows for t in tables])
        if (np.diff(t_us) < 0).any():
            order = np.argsort(t_us, kind="stable")
            t_us, rows = t_us[order], rows[order]
        for f in HOUSE.messages[IDS[message]].fields if len(t_us) else ():
            values = rows[f.name]
            if values.dtype.kind == "S":
                values = np.array([b.decode("utf-8", "replace") for b in values.tolist()], dtype=object)
            parts = tuple(str(i) for i in range(values.shape[1])) if values.ndim > 1 else ()
            yield Signal(f"{top}/{message}/{f.name}", t_us, values, f.unit, parts, message)
