"""What a flight is identified from: sensor samples as they were received and commands as they were sent, on the grid of base
ticks. The link log of a run folder; never its truth."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft, load_as
from flightsw.icd.codec_plant import PlantCodec
from flightsw.icd.codec_receive import FlightReceiver
from flightsw.icd.texts import Joiner
from flightsw.icd.wire import Counters, split, table
from flightsw.process.config import FlightConfig, load_flight
from flightsw.process.replay import read_ticks
from flightsw.strict import ConfigError
from flightsw.types import UPD_AIR, UPD_ATT, UPD_BARO, UPD_FUEL, UPD_GNSS, UPD_IMU, SensorFrame

Arr = NDArray[np.float64]
Ints = NDArray[np.int64]
_TEXTS = table(("STATUSTEXT",))
BEGINS, ENDS, STOPPED = "excitation begins", "excitation ends", "excitation stopped"
NEEDED = ("imu", "air", "att", "gnss")
TOLD = {
    "imu": "body rates and specific force", "air": "airspeed, alpha, beta", "att": "attitude", "gnss": "ground velocity",
    "baro": "height", "fuel": "fuel on board",
}  # fmt: skip


@dataclass(frozen=True)
class Samples:
    """Of one sensor: tick each was taken at [m], values [m, c] in SI."""

    at: Ints
    values: Arr


@dataclass(frozen=True)
class Flight:
    """A flight on its grid: period [s]; command in force during the step from each tick, surfaces [n,3] rad and throttle [n];
    samples by sensor; tick at which test inputs began and ended (-1: not told); `measured`: the
    surfaces are deflections, not commands."""

    name: str
    dt_s: float
    surfaces: Arr
    throttle: Arr
    samples: dict[str, Samples]
    began: int = -1
    ended: int = -1
    measured: bool = False

    @property
    def ticks(self) -> int:
        """Length of the grid."""
        return len(self.throttle)

    def needs(self) -> None:
        """Raise ConfigError naming the sensors that are not in it."""
        lacking = [f"{k} ({TOLD[k]})" for k in NEEDED if k not in self.samples]
        if lacking:
            raise ConfigError(f"{self.name}: not in the log: {', '.join(lacking)}")


class Gatherer:
    """Takes the datagrams of a flight tick by tick; `flight` gives what they add up to."""

    def __init__(self, cfg: FlightConfig, ac: Aircraft) -> None:
        self._period, self._delay = cfg.period_us, cfg.link.delay_ticks
        self._in = FlightReceiver(cfg.app.sysid, cfg.origin.origin(), 0)
        self._out = PlantCodec(ac, cfg.app.sysid, cfg.origin.origin())
        self._frame, self._texts, self._lost = SensorFrame(), Joiner(), Counters()
        self._kept: dict[str, list[tuple[int, tuple[float, ...]]]] = {}
        self._sent: list[tuple[int, tuple[float, float, float, float]]] = []
        self._told: list[tuple[int, str]] = []

    def take(self, datagrams: Iterable[bytes], reply: bytes, telemetry: bytes = b"") -> None:
        """What came in one tick, what went back, and what was told."""
        f = self._frame
        for d in datagrams:
            self._in.decode(d, f)
            self._keep(f)
        cmd = self._out.decode_reply(reply).cmd
        if cmd is not None and cmd.armed:
            self._sent.append((f.t_us, (cmd.aileron, cmd.elevator, cmd.rudder, cmd.throttle)))
        for spec, v, system, component, *_ in split(telemetry, _TEXTS, self._lost):
            text = spec.to_dict(v)
            whole = self._texts.take(system, component, text["text"], text["id"], text["chunk_seq"])
            if whole:
                self._told.append((f.t_us, whole))

    def _keep(self, f: SensorFrame) -> None:
        up = f.updated
        whole = (1 << len(f.air_V)) - 1
        rows: tuple[tuple[int, str, int, tuple[float, ...]], ...] = (
            (UPD_IMU, "imu", f.t_us, (*f.gyro_b, *f.acc_b)),
            (UPD_ATT, "att", f.att_t_us, f.att_q_nb),
            (UPD_GNSS, "gnss", f.gnss_t_us, f.gnss_vel_n),
            (UPD_BARO, "baro", f.t_us, (f.baro_alt_m,)),
            (UPD_FUEL, "fuel", f.fuel_t_us, (f.fuel_kg,)),
        )
        for bit, name, t, values in rows:
            if up & bit:
                self._kept.setdefault(name, []).append((t, values))
        if up & UPD_AIR and f.air_mask == whole and whole:  # a sample with a probe missing has another width
            row = [x for probe in zip(f.air_V, f.air_alpha, f.air_beta, strict=True) for x in probe]
            self._kept.setdefault("air", []).append((f.air_t_us, tuple(row)))

    def flight(self, name: str) -> Flight:
        """The flight so far. Raises ConfigError for one without samples or commands."""
        if not self._sent or "imu" not in self._kept:
            raise ConfigError(f"{name}: no {'commands' if not self._sent else 'sensor samples'} in the link log")
        t0 = self._kept["imu"][0][0]
        last = max(t for rows in self._kept.values() for t, _ in rows)

        def tick(t: int) -> int:
            return round((t - t0) / self._period)

        n = tick(last) + 1
        u = np.full((n, 4), np.nan)
        for t, row in self._sent:
            if 0 <= (k := tick(t) + self._delay) < n:
                u[k] = row
        first = int(np.flatnonzero(np.isfinite(u[:, 0]))[0])
        u[:first] = u[first]
        held = np.maximum.accumulate(
            np.where(np.isfinite(u[:, 0]), np.arange(n), 0)
        )  # a tick without a command holds the last
        u = u[held]
        samples = {}
        for sensor, rows in self._kept.items():
            at = np.array([tick(t) for t, _ in rows])
            good = at >= 0
            samples[sensor] = Samples(at[good], np.array([v for _, v in rows], dtype=float)[good])
        began = next((tick(t) for t, s in self._told if s.startswith(BEGINS)), -1)
        ended = next((tick(t) for t, s in self._told if s.startswith((ENDS, STOPPED))), -1)
        return Flight(name, self._period / 1e6, u[:, :3].copy(), u[:, 3].copy(), samples, began, ended)


def run_of(text: str) -> tuple[Path, str]:
    """Run folder and aircraft of FOLDER[/AIRCRAFT]. Raises ConfigError naming what there is."""
    path = Path(text)
    folder, name = (path, "") if path.is_dir() else (path.parent, path.name)
    have = sorted(p.stem.removeprefix("link_") for p in folder.glob("link_*.tlog")) if folder.is_dir() else []
    if not have:
        raise ConfigError(f"run:{text}: no run folder with a link log; expected run:FOLDER or run:FOLDER/AIRCRAFT")
    if not name and len(have) == 1:
        name = have[0]
    if name not in have:
        raise ConfigError(f"run:{text}: which aircraft? Allowed: {', '.join(f'run:{folder}/{h}' for h in have)}")
    return folder, name


def sixdof_of(folder: Path, name: str) -> tuple[FlightConfig, Aircraft]:
    """Flight configuration and aircraft record of a run's aircraft. Raises ConfigError for one of other equations."""
    cfg = load_flight(folder / f"flight_{name}.toml")
    return cfg, load_as(cfg.app.aircraft, Aircraft, "sixdof")


def read_run(folder: Path, name: str, cfg: FlightConfig, ac: Aircraft) -> Flight:
    """The flight of an aircraft of a run folder. Raises ConfigError for one without samples or commands, TlogError."""
    g = Gatherer(cfg, ac)
    for tick in read_ticks(folder / f"link_{name}.tlog"):
        g.take(tick.plant, tick.reply, tick.telemetry)
    return g.flight(f"{folder}/{name}")


def window(f: Flight, span_s: Sequence[float] | None) -> tuple[int, int]:
    """Ticks [from, to) that are identified from: span_s [s] of the flight, or where test inputs were told. Raises ConfigError."""
    if span_s is not None:
        lo, hi = (round(s / f.dt_s) for s in span_s)
        if not 0 <= lo < hi <= f.ticks:
            raise ConfigError(
                f"--from {span_s[0]:g} --to {span_s[1]:g}: allowed for {f.name}: within 0 to {f.ticks * f.dt_s:g} s"
            )
    elif f.began < 0:
        raise ConfigError(
            f"{f.name}: nobody told of test inputs ('{BEGINS}'); fly with --set AIRCRAFT.excitation.on=true, or say --from "
            "and --to"
        )
    else:
        lo, hi = f.began, f.ended if f.ended > f.began else f.ticks
    return lo, hi
