"""One rendezvous with the full aircraft over the real link, in process, and its kinematic twin.

The twin meets the same receiver with the same errors of the same TACAN (equal draws), flown by the same onboard classes; it
knows its own state, rolls at 5 deg/s and holds the speed commanded. What differs is the aircraft, its navigation and its
control law. Nothing measured here goes back to the onboard software.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.guidance import OwnState
from flightsw.missions.rendezvous.mission import RendezvousMission, RendezvousParams
from flightsw.missions.rendezvous.pilot import RendezvousPilot
from flightsw.process.config import load_flight
from flightsw.process.node import Node
from flightsw.strict import ConfigError, convert
from hil_scripts.launch.runfolder import RunPlan, make_folder, resolve
from sim_plant.couplings import traffic_kernel as tr
from sim_plant.couplings.traffic import Traffic
from sim_plant.scenario import Scenario, load_scenario
from sim_plant.sensors.rows import NoiseRows
from sim_plant.server import PlantServer

Array = np.ndarray
SCENARIO = "rendezvous"
WORKS_AIR = ("plant.wind.dryden.level=none", "plant.wind.dryden.over=point", "plant.wind.dryden.sigma_mps=0.39")
SAMPLE_S = (22.0, 62.0, 82.0, 122.0, 162.0, 182.0)  # just after the ranges at 21 s, 61 s, ...
LEVEL = math.radians(2.0)
STEP = 5  # ticks of a navigation step


@dataclass
class Meeting:
    """How one rendezvous went. SI, frame R; misses at wings level: x_m + tanker too far ahead, y_m receiver minus tanker."""

    done: bool = False
    x_m: float = math.nan
    y_m: float = math.nan
    turn_s: float = math.nan
    end_s: float = math.nan
    speed_mps: float = math.nan  # of the tanker at the end
    alarm_s: float = math.nan  # first warning
    nees3: list[float] = field(default_factory=list)  # of (x, v_x, y) at SAMPLE_S, over 3
    track: list[tuple[float, ...]] = field(default_factory=list)  # t, tanker x y, receiver x y, estimate x y

    def values(self, name: str) -> dict[str, float]:
        """Flat figures."""
        out = {
            f"{name}.{k}": float(getattr(self, k))
            for k in ("done", "x_m", "y_m", "turn_s", "end_s", "speed_mps", "alarm_s")
        }
        return out | {f"{name}.nees3.t{t:.0f}": v for t, v in zip(SAMPLE_S, self.nees3, strict=False)}


def plan_of(sets: tuple[str, ...], seed: int) -> RunPlan:
    """The scenario with overrides as of `sil run --set`. Raises ConfigError."""
    own = ("tanker.nav.gate.false_alarm=0", *WORKS_AIR)  # the work refuses no reading
    return resolve(SCENARIO, seed % 2**31, [*own, *sets], None)


def _nees3(e: Array, P: Array) -> float:
    return float(e @ np.linalg.solve(P, e)) / 3.0


def _to_r(sc: Scenario, v: Any, shift: bool) -> tuple[float, float]:
    h = math.radians(sc.track.heading_deg)
    n, e = (v[0] - sc.track.north_m, v[1] - sc.track.east_m) if shift else (v[0], v[1])
    return math.cos(h) * n + math.sin(h) * e, math.sin(h) * n - math.cos(h) * e


class _Watch:
    """Collects a Meeting from true positions and velocities in R."""

    def __init__(self, separation: float) -> None:
        self.m, self.separation = Meeting(), separation
        self.left = list(SAMPLE_S)

    def sample(self, t: float, own: Any, at: Any, v: Any, mean: Any, cov: Array, valid: bool, alarm: bool) -> None:
        """Once per navigation step, estimate included."""
        m = self.m
        if self.left and t >= self.left[0] - 1e-6:
            self.left.pop(0)
            e = np.array([at[0] - mean[0], v[0] - mean[1], at[1] - mean[2]])
            m.nees3.append(_nees3(e, cov[:3, :3]) if valid else math.nan)
        if alarm and math.isnan(m.alarm_s):
            m.alarm_s = t
        if round(t * 20.0) % 20 == 0:
            m.track.append((t, own[0], own[1], at[0], at[1], mean[0], mean[2]))

    def end(self, t: float, own: Any, at: Any, speed: float) -> None:
        """Wings level ahead of the receiver."""
        m = self.m
        m.done, m.end_s, m.speed_mps = True, t, speed
        m.x_m, m.y_m = at[0] - self.separation - own[0], at[1] - own[1]


def fly(plan: RunPlan) -> Meeting:
    """The flight; every byte of the plant link is made and read."""
    with tempfile.TemporaryDirectory(prefix="wakefield-rdv-") as tmp:
        run = make_folder(plan, Path(tmp) / "run")
        sc = load_scenario(str(run / "scenario.toml"))
        server = PlantServer(sc, plan.seed)
        node = Node(load_flight(run / f"flight_{plan.flights[0].name}.toml"))
    mission = node.app.mission  # type: ignore[attr-defined]
    assert isinstance(mission, RendezvousMission)
    w = _Watch(mission.pilot.p.guidance.separation_m)
    world = server.world
    cov, upper = np.zeros((4, 4)), np.triu_indices(4)
    while not server.done:
        t = server.t_us * 1e-6
        reply = node.step((server.begin_tick()[0],))
        if server.tick % STEP == 0:
            truth = world.truth(0)
            own = _to_r(sc, truth.pos_n, True)
            ((_, other),) = world.others()
            at, v = _to_r(sc, other.pos_n, True), _to_r(sc, other.vel_n, False)
            r = mission.track.out
            cov[upper] = r.cov
            cov.T[upper] = r.cov
            w.sample(t, own, at, v, r.mean, cov, r.valid, r.alarm)
            phase = mission.pilot.phase
            if phase == "turn" and math.isnan(w.m.turn_s):
                w.m.turn_s = t
            if phase in ("rollout", "done") and abs(truth.euler[2]) < LEVEL:
                w.end(t, own, at, truth.V)
                break
        server.end_tick([reply])
        node.after()
        node.take_heard()
    server.close()
    return w.m


def fly_twin(plan: RunPlan) -> Meeting:
    """The same rendezvous with the kinematic tanker. Raises ConfigError for a wind it cannot fly in."""
    sc = convert(plan.scenario, Scenario, "scenario")
    p = convert(plan.flights[0].config["rendezvous"], RendezvousParams, "rendezvous")
    craft = sc.aircraft[0]
    c = sc.suite(craft.name).tacan
    if sc.wind.prevailing != "constant":
        raise ConfigError(f"wind.prevailing = {sc.wind.prevailing!r}: the kinematic twin flies in a constant wind only")
    wind = sc.wind.constant_mps
    rate = sc.clock.base_rate_hz
    receiver = Traffic(sc.traffic, sc.track, wind, plan.seed, 1.0 / rate)
    errors = NoiseRows(plan.seed, f"{craft.name}.tacan", [c.std_m], [c.bias_std_m], c.tau_s, c.interval_s)
    own = OwnState(*_to_r(sc, craft.start.pos_n_m, True), 0.0, 0.0, craft.start.V_mps, *_to_r(sc, wind, False))
    psi0 = math.radians(sc.track.heading_deg - craft.start.psi_deg)
    tanker = np.array([own.x, own.y, math.remainder(psi0, 2.0 * math.pi), 0.0, own.speed])
    q = np.zeros(tr.Q_N)
    q[tr.Q_WX], q[tr.Q_WY], q[tr.Q_G] = own.wind_x, own.wind_y, 9.80665
    q[tr.Q_ROLL], q[tr.Q_ACC] = math.radians(p.pilot.roll_rate_degps), p.pilot.speed_rate_mps2
    est = RangeEstimator(p.track.estimator, own.wind_x, own.wind_y)
    # no lag to allow for: commands take effect at once
    pilot = RendezvousPilot(
        convert({**plan.flights[0].config["rendezvous"]["pilot"], "response_s": 0.0}, type(p.pilot), "")
    )
    w = _Watch(p.pilot.guidance.separation_m)
    every, first, dt = round(c.interval_s * rate), round(c.first_s * rate), STEP / rate
    seen = math.inf
    for k in range(0, round(sc.meta.duration_s * rate), STEP):
        t = k / rate
        if k:
            tr.tanker_step(tanker, pilot.bank, pilot.V, dt, q)
            est.predict(dt)
            for _ in range(STEP):
                receiver.advance()
        at = _to_r(sc, receiver.position, True)
        if k >= first and (k - first) % every == 0:
            flat = math.hypot(at[0] - tanker[0], at[1] - tanker[1])
            low = (
                receiver.position[2]
                - craft.start.pos_n_m[2]
                + c.earth_radius_m * (1.0 - math.cos(flat / c.earth_radius_m))
            )
            seen = math.hypot(flat, low) + errors.next()[0]
            if est.out.valid:
                est.update(seen, tanker[0], tanker[1])
            else:
                est.start(seen, tanker[0], tanker[1], sc.traffic.y_m, sc.traffic.y_sigma_m)
        own.x, own.y, own.psi, own.bank, own.speed = (float(v) for v in tanker)
        cov = est.covariance
        w.sample(
            t, (own.x, own.y), at, _to_r(sc, receiver.velocity, False), est.mean, cov, est.out.valid, est.out.alarm
        )
        pilot.step(
            own, est.mean if est.out.valid else None, seen, dt, est.last_covariance, est.out.left_plan, est.out.sided
        )
        if pilot.phase == "turn" and math.isnan(w.m.turn_s):
            w.m.turn_s = t
        if pilot.phase in ("rollout", "done") and abs(own.bank) < LEVEL:
            w.end(t, (own.x, own.y), at, own.speed)
            break
    return w.m
