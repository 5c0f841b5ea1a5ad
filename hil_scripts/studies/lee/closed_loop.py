"""Station keeping at the contact point in closed loop, in process: plant, both onboard applications, the plant's radio.

The same applications as in flight; only the receiver's guidance is a fixed point, and its control law can be fed with its
estimates (default), with raw readings, or with the true state.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import flightsw
from flightsw.app import FlightApp
from flightsw.missions.receiver.mission import ReceiverMission
from flightsw.process.application import make_app
from flightsw.process.config import load_flight
from flightsw.strict import ConfigError
from flightsw.types import UPD_PEER, ActuatorCmd, GuidanceCmd, Health, NavState, PeerState, SensorFrame, Text
from hil_scripts.studies.lee.filters import wind_figures
from sim_plant.couplings.radio import Radio
from sim_plant.scenario import AircraftCfg, Scenario, load_scenario
from sim_plant.world import AircraftLostError, Truth, World

CONTACT = (-35.5, 0.0, 8.5)  # [m]
SETTLE_S = 30.0  # statistics start
LOST_M = 15.0  # any axis farther off ends the run as lost
PARAMS = Path(flightsw.__file__).parent / "params"
# the plant's keys this study sets itself
OWN = ("event", "expect", "traffic", "track", "aircraft.receiver.start", "aircraft.1.start")


@dataclass(frozen=True)
class LoopCase:
    """One closed-loop setting; overrides are dotted keys of the plant scenario and of the flight files."""

    duration_s: float = 150.0
    feedback: str = "estimated"  # measured, true
    plant: tuple[tuple[str, Any], ...] = ()
    tanker: tuple[tuple[str, Any], ...] = ()
    receiver: tuple[tuple[str, Any], ...] = ()
    turn_at_s: float = 0.0  # 0: straight flight only
    known_delay_ticks: int = 1  # transport delay the onboard actuator model allows for


class _HoldContact:
    """Guidance that asks for one fixed point from the first valid navigation on."""

    def __init__(self) -> None:
        self.phase = 5
        self.texts: list[Text] = []
        self.out = GuidanceCmd(phase=5, rel_pos_t=CONTACT)

    def step(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        return self.out

    def recapture(self, nav: NavState, why: str = "") -> None:
        """Nothing to do: the reference never moves."""


class _OtherFeedback:
    """The receiver's navigation with what the control law reads replaced by raw readings or by truth."""

    def __init__(self, nav: Any, kind: str, truth: list[Truth]) -> None:
        self.inner, self.kind, self.truth = nav, kind, truth
        self.peer, self.core, self.rejoined, self.out = nav.peer, nav.core, False, nav.out

    def step(self, f: SensorFrame, u: np.ndarray, health: Health, updated: int) -> NavState:
        """The real estimator runs (for its wind); the relative state comes from elsewhere."""
        o = replace(self.inner.step(f, u, health, updated))
        tk = np.zeros(18)
        if self.kind == "true":
            t, r = self.truth
            e, w = relative_motion(r.q_nb, dcm_of(t.q_nb), r.w_b, t.w_b)
            o.rel_pos_t, o.rel_vel_t = r.xi, r.xi_dot
        elif self.peer.t_us > 0:
            self.peer.stage(f.t_us, tk)
            e, w = relative_motion(f.att_q_nb, tk[:9].reshape(3, 3), f.gyro_mean_b, tuple(tk[9:12]))
            o.rel_pos_t, o.rel_vel_t = f.rel_pos_t, f.rel_vel_t
        else:
            return o
        o.rel_euler, o.rel_w_b = e, w
        return o


def dcm_of(q: tuple[float, float, float, float]) -> np.ndarray:
    """NED to body [3,3] of q_nb."""
    w, x, y, z = q
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z],
        ]
    )


def relative_motion(q_r: Any, C_t: np.ndarray, w_r: Any, w_t: Any) -> tuple[Any, Any]:
    """Relative Euler angles (tanker body to receiver body) and rates in receiver axes."""
    R = dcm_of(q_r) @ C_t.T
    e = (math.atan2(R[0, 1], R[0, 0]), -math.asin(max(-1.0, min(1.0, R[0, 2]))), math.atan2(R[1, 2], R[2, 2]))
    return e, tuple((np.array(w_r) - R @ np.array(w_t)).tolist())


def _scenario(c: LoopCase) -> Scenario:
    """Raises ConfigError for a key that the study sets itself."""
    for key in dict(c.plant):
        for own in OWN:
            if f"{key}.".startswith(f"{own}."):
                raise ConfigError(
                    f"closed loop: plant.{key}: set by the study, which holds the contact point from the start"
                )
    over: dict[str, Any] = {"meta.duration_s": c.duration_s, **dict(c.plant)}
    sc = load_scenario("refueling", over)
    start = replace(sc.aircraft[1].start, xi_m=CONTACT)
    craft: tuple[AircraftCfg, ...] = (sc.aircraft[0], replace(sc.aircraft[1], start=start))
    return replace(sc, aircraft=craft, event=())


def _app(name: str, over: dict[str, Any], delay_ticks: int) -> FlightApp:
    """The application of a flight file. Raises ConfigError for keys of the process around it, which this study does without."""
    for key in over:
        head = key.partition(".")[0]
        if head in ("link", "telemetry", "origin", "app"):
            raise ConfigError(
                f"closed loop: {name}.{key}: nothing obeys it in this study, which flies the application alone"
            )
    # the works refuse no reading, bound no position, and nothing takes the command from their laws
    works = {"nav.gate.false_alarm": 0.0, "recovery.on": False, "link.delay_ticks": delay_ticks}
    # how rough the air is goes by recovery's readings: asked of a tanker without it, the file's own noise_mps would be refused
    works |= {"integrity.on": False} if name == "receiver" else {"rough_air.on": False}
    app = make_app(load_flight(PARAMS / f"{name}.toml", works | over))
    assert isinstance(app, FlightApp)
    return app


def fly(c: LoopCase, seed: int) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """One run: figures and traces at 20 Hz. `lost` is 1 when the receiver left the neighbourhood of the contact point
    or an aircraft was lost."""
    sc = _scenario(c)
    world = World(sc, seed % 2**31)
    tanker_over = {"guid.first_leg_s": c.turn_at_s or 1e6, **dict(c.tanker)}
    n = c.known_delay_ticks
    apps = [_app("tanker", tanker_over, n), _app("receiver", dict(c.receiver), n)]
    truth: list[Truth] = []
    receiver = apps[1].mission
    assert isinstance(receiver, ReceiverMission)
    receiver.guid = _HoldContact()  # type: ignore[assignment]
    if c.feedback != "estimated":
        receiver.nav = _OtherFeedback(receiver.nav, c.feedback, truth)  # type: ignore[assignment]
    radio: Radio[PeerState] = Radio(
        [v.cfg.name for v in world.members], world.seed, sc.link.radio_latency_ms, sc.link.radio_loss, world.rate_hz
    )
    rows: list[list[float]] = []
    lost = False
    while not world.done and not lost:
        try:
            frames = world.sense()
        except AircraftLostError:
            lost = True
            break
        k = world.tick
        frames[1].commands = []
        for heard in radio.receive(1, k):
            frames[1].peer = heard
            frames[1].updated |= UPD_PEER
        slow = k % 5 == 0
        if slow:
            truth[:] = [world.truth(0), world.truth(1)]
        cmds: list[ActuatorCmd] = []
        snaps = []
        for app, f in zip(apps, frames, strict=True):
            cmd, snap = app.tick(f, world.dt_s)
            cmds.append(cmd)
            snaps.append(snap)
        if slow:
            o = snaps[0].nav
            if o.valid:
                p = PeerState(o.t_us, o.pos_n, o.vel_n, o.acc_n, o.q_nb, o.w_b, o.wind_n, True)
                radio.send(0, k, [p])
            r = truth[1]
            o = snaps[1].nav
            rows.append(
                [
                    k * world.dt_s,
                    *r.xi,
                    *r.wind_n,
                    *o.wind_n,
                    *o.wind_sigma,
                    *o.rel_pos_t,
                    *r.wind_rot,
                    *o.wind_rot,
                ]
            )
            err = max(abs(a - b) for a, b in zip(r.xi, CONTACT, strict=True))
            lost = err > LOST_M or not math.isfinite(err)
        world.step(cmds)
    return _figures(np.array(rows), lost)


def _figures(a: np.ndarray, lost: bool) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    t, xi = a[:, 0], a[:, 1:4] - np.array(CONTACT)
    out: dict[str, float] = {"lost": float(lost)}
    m = t >= SETTLE_S
    if not lost and m.any():
        for i, axis in enumerate("xyz"):
            e = xi[m, i]
            out[f"contact.rms_m.{axis}"] = float(np.sqrt(np.mean(e * e)))
            out[f"contact.p95_m.{axis}"] = float(np.percentile(np.abs(e), 95))
            out[f"contact.max_m.{axis}"] = float(np.abs(e).max())
            d = a[m, 13 + i] - a[m, 1 + i]
            out[f"estimate.rms_m.{axis}"] = float(np.sqrt(np.mean(d * d)))
        out |= wind_figures(t, a[:, 4:7], a[:, 7:10], a[:, 10:13], SETTLE_S)
    traces = {
        "t": t,
        "error": xi,
        "wind_true": a[:, 4:7],
        "wind": a[:, 7:10],
        "sigma": a[:, 10:13],
        "wind_rot": a[:, 16:19],
        "rot_estimate": a[:, 19:22],
    }
    return out, traces
