"""What is wrong with the small UAV of a case: servos, lift, moments, stall, sensors of a grade, a failed vane or surface."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flightsw.missions.gust.model import published
from hil_scripts.studies.hoffmann import flight as hf
from sim_plant.aircraft.alexis import dynamics as ka
from sim_plant.aircraft.alexis.flight import Alexis, AlexisParams, AlexisSensors, AlexisServo
from sim_plant.kernels.atmosphere import isa
from sim_plant.rng import generator
from sim_plant.sensors.errors import Draw
from sim_plant.sensors.terms import PAPER, Terms, group_terms
from sim_plant.wind.planar import Gust

TICKS = 4
NONE = AlexisSensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
# channel -> sensor and family of a grade
FAMILIES = {
    ka.R_RATE: ("imu", "gyro"), ka.R_VANE: ("air", "alpha"), ka.R_AIRSPEED: ("air", "V"), ka.R_PITCH: ("att", "tilt"),
    ka.R_HEIGHT: ("baro", "alt"), ka.R_GROUND: ("gnss", "vel_h"), ka.R_VERTICAL: ("imu", "acc"),
}  # fmt: skip


class Graded:
    """Readings of a grade's sensors for one flight: play of a vane's bearing, lag, scale, what is drawn, latency."""

    def __init__(self, grade: str, seed: int, samples: int, dt: float) -> None:
        self._late: list[list[float]] = [[] for _ in range(ka.NR)]
        self._held = np.full(ka.NR, np.nan)
        self._lagged = np.full(ka.NR, np.nan)
        self._rows, self._of, self._scale, self._delay = np.zeros((samples, ka.NR)), {}, np.ones(ka.NR), [0] * ka.NR
        for c, (group, family) in FAMILIES.items():
            g = group_terms(group, grade, {}, "grade")
            assert g is not None
            t = g.columns[family]
            self._of[c] = t
            self._scale[c] += t.scale * generator(seed, f"{group}.{family}.scale").standard_normal()
            self._delay[c] = round((g.latency_ms or 0.0) * 1e-3 / dt)
            self._rows[:, c] = _drawn(t, seed, f"{group}.{family}", samples, dt)
        self._dt = dt

    def read(self, clean: np.ndarray, k: int, height: float) -> np.ndarray:
        """Readings [7] of a sample number k from what is true there [7], at a height [m]."""
        out = np.zeros(ka.NR)
        for c, t in self._of.items():
            x = float(clean[c])
            if t.friction > 0.0:
                play = t.friction / (0.5 * isa(height)[2] * float(clean[ka.R_AIRSPEED]) ** 2)
                was = x if math.isnan(self._held[c]) else self._held[c]
                x = self._held[c] = min(max(was, x - play), x + play)
            if t.lag_s > 0.0:
                was = x if math.isnan(self._lagged[c]) else self._lagged[c]
                x = self._lagged[c] = x + (was - x) * math.exp(-self._dt / t.lag_s)
            line = self._late[c]
            line.append(x * self._scale[c] + self._rows[k, c])
            out[c] = line.pop(0) if len(line) > self._delay[c] else line[0]
        return out


def _drawn(t: Terms, seed: int, name: str, samples: int, dt: float) -> np.ndarray:
    gm, white, walk, once = (generator(seed, f"{name}.{x}") for x in ("gm", "white", "walk", "constant"))
    draw = Draw(
        (white, gm, walk), math.hypot(t.white, t.density / math.sqrt(dt)), t.gm, math.exp(-dt / t.tau_s),
        t.walk * math.sqrt(dt), t.constant * once.standard_normal(1) + t.common * once.standard_normal(1), gm.standard_normal(1),
        np.zeros(1),
    )  # fmt: skip
    return np.asarray(draw.block(samples))[:, 0]


class Faulty(Alexis):
    """The aircraft of a case: sensors of a grade instead of the paper's, and what goes wrong at `at_s`."""

    def __init__(self, p: dict[str, Any], seed: int) -> None:
        self._fault: dict[str, Any] = p.get("fault", {})
        self._graded: Graded | None = None
        self._stuck: float | None = None
        T, dt, grade = float(p["duration_s"]), hf.DT, str(p.get("grade", PAPER))
        plant = AlexisParams(
            servo=AlexisServo(wn_radps=float(p.get("servo_wn_radps", published().servo_wn_radps))),
            lift_factor=float(p.get("lift_factor", 1.0)), moment_factor=float(p.get("moment_factor", 1.0)),
            stall_deg=p.get("stall_deg"), sensors=AlexisSensors() if grade == PAPER else NONE,
        )  # fmt: skip
        gusts = tuple(Gust("down", size, at, 0.5, "one_cosine") for at, size in p.get("gusts", ()))
        super().__init__(plant, hf.wind(float(p["scale"]), gusts=gusts), seed % 2**31, T, dt, TICKS)
        if grade != PAPER:
            self._graded = Graded(grade, seed % 2**31, self.samples, dt)
            self._observe()

    @property
    def true_alpha(self) -> float:
        """Incidence [rad] at this sample."""
        return float(self._clean[ka.R_VANE])

    def step(self, command: np.ndarray) -> None:
        jam = self._fault.get("jam")
        if jam and (self.k + 0.5) * self.dt > float(self._fault["at_s"]):
            self.freeze(elevator=jam == "elevator", flap=jam == "flap")
        super().step(command)

    def _observe(self) -> None:
        super()._observe()
        if self._graded is not None:
            self.reading[:] = self._graded.read(self._clean, self.k, float(self.f[ka.F_HEIGHT]))
        f, t = self._fault, self.k * self.dt
        if not f or t < float(f["at_s"]) - 1e-9:
            return
        self.reading[ka.R_AIRSPEED] += float(f.get("V_mps", 0.0))
        self.reading[ka.R_VANE] += math.radians(float(f.get("vane_deg", 0.0)))
        self.reading[ka.R_VANE] += math.radians(float(f.get("vane_degps", 0.0))) * (t - float(f["at_s"]))
        if f.get("vane") == "stuck":
            self._stuck = float(self.reading[ka.R_VANE]) if self._stuck is None else self._stuck
            self.reading[ka.R_VANE] = self._stuck
        elif f.get("vane") == "off":
            self.reading[ka.R_VANE] = math.nan
