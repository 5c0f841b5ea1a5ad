"""The flight as a function of what is sought: coefficients, initial state, wind, and the lasting errors of the sensors."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aero, Aircraft
from flightsw.sixdof import params as pv
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.layout import NX, X_WN, X_Z
from flightsw.strict import Tree
from hil_scripts.identify.flight import inputs
from hil_scripts.identify.flight.gusts import Gusts
from hil_scripts.identify.flight.kernel import Y_EULER, Y_FORCE, Y_PROBE, Y_RATE, Y_VEL, lead
from hil_scripts.identify.flight.readings import Flight

Arr = NDArray[np.float64]
COEFFICIENTS = tuple(f.name for f in fields(Aero))
STATE = (
    "V",
    "beta",
    "alpha",
    "p",
    "q",
    "r",
    "psi",
    "theta",
    "phi",
    "wind_n",
    "wind_e",
    "height",
    "thrust",
    "shear_n",
    "shear_e",
)
AXES = ("x", "y", "z")
NC, NS = len(COEFFICIENTS), len(STATE)
S_WIND, S_HEIGHT, S_THRUST, S_SHEAR = 9, 11, 12, 13
STEP = np.array(
    [1e-2, 1e-5, 1e-5, *[1e-5] * 3, *[1e-5] * 3, 1e-2, 1e-2, 1.0, 10.0, 1e-4, 1e-4]
)  # of STATE, for differences
GUST_STEP = 0.05  # [m/s]
COEFFICIENT_STEP, LEAST = 1e-4, 0.02  # [-] of a coefficient, and of what it is taken to be at least
# 1 sigma: [m/s^2] of an accelerometer, [m] of a pressure height, [-] of thrust at the begin, [1/s] of the wind's change with
# height
ACC, BARO, THRUST, SHEAR = 0.02, 5.0, 0.02, 0.01


@dataclass(frozen=True)
class Lasting:
    """1 sigma of what each sensor is off for the whole flight: gyro [rad/s], accelerometer [m/s^2], velocity [m/s], attitude
    [rad], airspeed [m/s], vanes [rad], pressure height [m]. Known before the flight; what the flight says is added to it."""

    gyro: float
    acc: float
    vel: float
    att: float
    V: float
    flow: float
    height: float


def lasting(tables: Tree) -> Lasting:
    """What the flight file's [nav] says of the sensors that are fitted; what it does not say, as by default."""
    p, said = NavParams(), tables.get("nav", {})

    def of(key: str) -> float:
        return float(said.get(key, getattr(p, key)))

    return Lasting(of("bias_gyro"), ACC, of("bias_vel"), of("bias_att"), of("bias_V"), of("bias_flow"), BARO)


@dataclass(frozen=True)
class Channel:
    """One measured quantity: its name, ticks of the window [m], values [m] and, for all but attitude, the output it is read
    from."""

    name: str
    at: NDArray[np.int64]
    values: Arr
    output: int


def quaternions(e: Arr) -> Arr:
    """Quaternions [m,4] (body to navigation) of psi, theta, phi [m,3] rad."""
    c, s = np.cos(0.5 * e), np.sin(0.5 * e)
    (cz, cy, cx), (sz, sy, sx) = c.T, s.T
    return np.column_stack(
        [
            cx * cy * cz + sx * sy * sz,
            sx * cy * cz - cx * sy * sz,
            cx * sy * cz + sx * cy * sz,
            cx * cy * sz - sx * sy * cz,
        ]
    )


def turn(a: Arr, b: Arr) -> Arr:
    """Rotation vectors [m,3] rad about the axes of a that lead from quaternions a to b [m,4], small."""
    w = (a * b).sum(axis=1)
    v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
    return np.asarray(2.0 * v * np.sign(w)[:, None])


class FlightModel:
    """Ticks lo to hi of a flight of the aircraft `like`. A vector of parameters holds coefficients [26], state at the first tick
    [15] (STATE), then one constant per channel, then gusts at
    knots, north, east and down of each, where there are any."""

    def __init__(
        self, f: Flight, like: Aircraft, lo: int, hi: int, known: Lasting, gusts: Gusts | None = None
    ) -> None:  # fmt: skip
        f.needs()
        self.like, self.lo, self.n, self.dt = like, lo, hi - lo, f.dt_s
        self.probes = np.array([p.position_m for p in like.probe])
        self.channels: list[Channel] = []
        self._quaternions = np.zeros((0, 4))
        for name, values, at in self._inside(f, lo, hi):
            self._add(name, values, at)
        self.names = (*COEFFICIENTS, *STATE, *(c.name for c in self.channels))
        self.gusts, self._first = gusts, len(self.names)
        if gusts is not None:
            gusts.spread(self.n, self.dt)
            self.names += tuple(f"gust_{a}{j}" for j in range(gusts.knots) for a in "ned")
        self.size = len(self.names)
        V = float(np.mean(self._of("V0")))
        baro = f.samples.get("baro")
        near = np.abs(baro.at - lo) < 5.0 / self.dt if baro is not None else np.zeros(0, dtype=bool)
        h = float(np.mean(baro.values[near, 0])) if baro is not None and near.any() else 0.0
        self.engine = inputs.engine(like, V, h)
        deflected = inputs.as_measured if f.measured else inputs.deflections
        self.surf = deflected(f.surfaces[:hi], like, f.dt_s)[lo:]
        self.throttle = f.throttle[lo:hi].copy()
        self.mass = inputs.masses(f, like, lo, hi)
        self.P = pv.parameter_vector(like, float(self.mass[0, 0]))
        thrust = float(inputs.thrust_at(f.throttle[:hi], self.engine, f.dt_s)[lo])
        self.known = np.zeros((self.size, self.size))  # information before the flight
        self.mean = np.zeros(self.size)
        self._start(V, h, thrust, known)

    def _inside(self, f: Flight, lo: int, hi: int) -> list[tuple[str, Arr, NDArray[np.int64]]]:
        out = []
        for group in ("imu", "gnss", "att", "air"):
            s = f.samples[group]
            inside = (s.at >= lo) & (s.at < hi)
            out.append((group, s.values[inside], s.at[inside] - lo))
        return out

    def _add(self, group: str, values: Arr, at: NDArray[np.int64]) -> None:
        if group == "imu":
            for j, (what, first) in enumerate((("gyro", Y_RATE), ("acc", Y_FORCE))):
                for i, axis in enumerate(AXES):
                    self.channels.append(Channel(f"{what}_{axis}", at, values[:, 3 * j + i], first + i))
        elif group == "gnss":
            for i, axis in enumerate("ned"):
                self.channels.append(Channel(f"vel_{axis}", at, values[:, i], Y_VEL + i))
        elif group == "att":
            self._quaternions = values
            self.channels += [Channel(f"att_{axis}", at, np.zeros(len(at)), -1 - i) for i, axis in enumerate(AXES)]
        else:
            for i in range(len(self.probes)):
                for j, what in enumerate(("V", "alpha", "beta")):
                    self.channels.append(Channel(f"{what}{i}", at, values[:, 3 * i + j], Y_PROBE + 3 * i + j))

    def _of(self, name: str) -> Arr:
        return next(c.values for c in self.channels if c.name == name)

    def _start(self, V: float, h: float, thrust: float, known: Lasting) -> None:
        """Start values and what is known before: the first second of each sensor."""
        x = self.mean
        x[:NC] = astuple(self.like.aero)

        def first(name: str) -> float:
            c = next(c for c in self.channels if c.name == name)
            return float(np.mean(c.values[c.at < 1.0 / self.dt]))

        s = x[NC : NC + NS]
        s[:3] = V, first("beta0"), first("alpha0")
        q = self._quaternions[0]
        s[6] = math.atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] ** 2 + q[3] ** 2))
        s[7] = math.asin(2 * (q[0] * q[2] - q[3] * q[1]))
        s[8] = math.atan2(2 * (q[0] * q[1] + q[2] * q[3]), 1 - 2 * (q[1] ** 2 + q[2] ** 2))
        s[S_HEIGHT], s[S_THRUST] = h, thrust
        out = self.outputs(x)
        for i, axis in enumerate("ne"):
            s[S_WIND + i] = first(f"vel_{axis}") - float(np.mean(out[: round(1.0 / self.dt), Y_VEL + i]))
        prior = np.zeros(self.size)  # 1 / sigma^2
        prior[NC + S_HEIGHT], prior[NC + S_THRUST] = known.height**-2, (THRUST * thrust) ** -2
        prior[NC + S_SHEAR : NC + S_SHEAR + 2] = SHEAR**-2
        sigma = {"gyro": known.gyro, "acc": known.acc, "vel": known.vel, "att": known.att, "V": known.V,
                 "alpha": known.flow, "beta": known.flow}  # fmt: skip
        for i, c in enumerate(self.channels):
            prior[NC + NS + i] = sigma[c.name.rstrip("0123456789").partition("_")[0]] ** -2
        self.known = np.diag(prior)
        self.expect_gusts()

    def expect_gusts(self) -> None:
        """Into what is known, gusts of their intensity."""
        if self.gusts is not None:
            self.known[self._first :, self._first :] = self.gusts.information()

    def outputs(self, x: Arr) -> Arr:
        """Outputs [n, Y_*] of the kernel for parameters x, sensors without error."""
        s = x[NC : NC + NS]
        state = np.zeros(NX)
        state[:9] = s[:9]
        w = np.zeros((self.n + 1, 3)) if self.gusts is None else self.gusts.along(x[self._first :])
        state[X_Z], state[X_WN : X_WN + 3] = -s[S_HEIGHT], w[0] + (s[S_WIND], s[S_WIND + 1], 0.0)
        out = np.empty((self.n, Y_PROBE + 3 * len(self.probes)))
        lead(
            state, float(s[S_THRUST]), x[:NC], self.surf, self.throttle, self.mass, self.engine, s[S_SHEAR:], np.diff(w, axis=0),
            self.probes, self.P, self.dt, out
        )  # fmt: skip
        return out

    def residuals(self, x: Arr) -> list[Arr]:
        """Measured less modelled, per channel."""
        out = self.outputs(x)
        att = next((c for c in self.channels if c.output < 0), None)
        e = (
            turn(quaternions(out[att.at, Y_EULER : Y_EULER + 3]), self._quaternions)
            if att is not None
            else np.zeros((0, 3))
        )
        return [
            (e[:, -1 - c.output] if c.output < 0 else c.values - out[c.at, c.output]) - x[NC + NS + i]
            for i, c in enumerate(self.channels)
        ]

    def steps(self, x: Arr) -> Arr:
        """Steps of the differences; of the constants none are needed."""
        return np.concatenate([
            COEFFICIENT_STEP * np.maximum(np.abs(x[:NC]), LEAST), STEP, np.ones(len(self.channels)),
            np.full(self.size - self._first, GUST_STEP),
        ])  # fmt: skip

    def slopes(self, x: Arr, residuals: list[Arr] | None = None) -> list[Arr]:
        """Change of the modelled readings by parameter, per channel [m, size]: differences to one side of residuals(x), the
        constants exactly."""
        h = self.steps(x)
        base = self.residuals(x) if residuals is None else residuals
        out = [np.zeros((len(c.at), self.size)) for c in self.channels]
        for j in (*range(NC + NS), *range(self._first, self.size)):
            moved = x.copy()
            moved[j] += h[j]
            for o, a, b in zip(out, base, self.residuals(moved), strict=True):
                o[:, j] = (a - b) / h[j]
        for i, o in enumerate(out):
            o[:, NC + NS + i] = 1.0
        return out
