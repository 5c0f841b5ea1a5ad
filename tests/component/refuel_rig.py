"""Plant world and both onboard applications in one process, receiver held at the contact point, data link 50 ms late.

Several receiver estimators can ride along on the same sensor frames ("shadows"); only the first one flies.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np

from flightsw.app import FlightApp
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.sixdof.estimator import AirframeNav
from flightsw.strict import apply_overrides, read_toml
from flightsw.types import UPD_PEER, GuidanceCmd, Health, NavState, PeerState, SensorFrame, Text
from sim_plant.failures.script import Event
from sim_plant.scenario import load_scenario
from sim_plant.world import World
from tests.keys.flights import designs_kept

CONTACT = (-35.5, 0.0, 8.5)  # [m]
DESIGNS: dict[Any, Any] = {}  # of control: estimators that ride along need none of their own
LINK_TICKS = 5


class Hold:
    """Guidance that asks for the contact point."""

    def __init__(self) -> None:
        self.phase = 5
        self.texts: list[Text] = []
        self.out = GuidanceCmd(phase=5, rel_pos_t=CONTACT)

    def step(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        return self.out

    def recapture(self, nav: NavState, why: str = "") -> None:
        pass


class Together:
    """Estimators on the same frames; the first one's output flies the aircraft."""

    def __init__(self, navs: list[Any]) -> None:
        self.navs = navs
        self.core = navs[0].core

    def __getattr__(self, name: str) -> Any:
        return getattr(self.navs[0], name)

    def step(self, f: SensorFrame, u: np.ndarray, h: Health, updated: int) -> NavState:
        for n in self.navs:
            n.step(f, u, h, updated)
        return self.navs[0].out


def app(name: str, **over: Any) -> FlightApp:
    """The application of the shipped flight file with `over` (dotted keys with __ for the dot)."""
    t = read_toml(f"flightsw/params/{name}.toml")
    apply_overrides(t, {k.replace("__", "."): v for k, v in over.items()}, name)
    t.pop("integrity", None)  # no raw fixes come over this link
    a = t.pop("app")
    t.pop("link", None)
    with designs_kept(DESIGNS):
        return FlightApp(a["mission"], a["aircraft"], t, mission_rate_hz=a["mission_rate_hz"])


class Rig:
    """One closed-loop flight. `log` rows are per estimator; see `run`."""

    def __init__(
        self, seed: int, duration_s: float, *, plant: dict[str, Any] | None = None, mismatch: float = 0.0,
        receiver: dict[str, Any] | None = None, tanker: dict[str, Any] | None = None,
        shadows: dict[str, dict[str, Any]] | None = None, tanker_shadows: dict[str, dict[str, Any]] | None = None,
        events: tuple[Event, ...] = (),
    ) -> None:  # fmt: skip
        sc = load_scenario("refueling", {"meta.duration_s": duration_s, **(plant or {})})
        craft = tuple(replace(a, aero_error_frac=mismatch) for a in sc.aircraft)
        craft = (craft[0], replace(craft[1], start=replace(craft[1].start, xi_m=CONTACT)))
        self.world = World(replace(sc, aircraft=craft, event=events), seed)
        self.apps = [app("tanker", guid__first_leg_s=1e6, **(tanker or {})), app("receiver", **(receiver or {}))]
        self.apps[1].mission.guid = Hold()
        self.texts: list[tuple[float, int, str]] = []  # time, aircraft, text
        self.names: list[list[str]] = []
        for a, own in zip(self.apps, (tanker_shadows or {}, shadows or {}), strict=True):
            first = a.mission.nav
            navs: list[AirframeNav | RelativeNav] = [first]
            for over in own.values():
                navs.append(app(("tanker", "receiver")[self.apps.index(a)], **over).mission.nav)
            a.mission.nav = Together(navs)
            self.names.append(["flown", *own])

    def run(self) -> dict[str, dict[str, np.ndarray]]:
        """Fly. Per receiver estimator: wind, wind_rot, rel_pos, rel_vel errors [N,3], rot [N,3] estimate, sigmas, nis per
        row; under "truth": t, xi error, wind_rot; tanker estimators under "tanker.<name>"."""
        w, link = self.world, deque[tuple[int, PeerState]]()
        log: dict[str, dict[str, list[Any]]] = {}

        def put(name: str, **kw: Any) -> None:
            for k, v in kw.items():
                log.setdefault(name, {}).setdefault(k, []).append(v)

        while not w.done:
            frames = w.sense()
            frames[1].commands = []
            if link and link[0][0] <= w.tick:
                frames[1].peer = link.popleft()[1]
                frames[1].updated |= UPD_PEER
            tr = [w.truth(0), w.truth(1)] if w.tick % 5 == 0 else []
            both = [a.tick(f, w.dt_s) for a, f in zip(self.apps, frames, strict=True)]
            cmds = [c for c, _ in both]
            self.texts += [(w.t_us * 1e-6, i, t.text) for i, (_, s) in enumerate(both) for t in s.texts]
            if tr:
                n = self.apps[0].nav
                if n.valid:
                    state = (n.t_us, n.pos_n, n.vel_n, n.acc_n, n.q_nb, n.w_b, n.wind_n, n.wind_valid, n.pos_sigma)
                    link.append((w.tick + LINK_TICKS, PeerState(*state)))
                put("truth", t=w.t_us * 1e-6, xi=np.subtract(tr[1].xi, CONTACT), wind_rot=tr[1].wind_rot)
                for side, prefix in ((0, "tanker."), (1, "")):
                    t = tr[side]
                    for name, nav in zip(self.names[side], self.apps[side].mission.nav.navs, strict=True):
                        o = nav.out
                        put(
                            prefix + name, valid=o.valid, wind=np.subtract(o.wind_n, t.wind_n), wind_sigma=o.wind_sigma,
                            nis=o.nis / max(o.nis_dof, 1), q=nav.core.q_wind,
                            pos=np.subtract(o.pos_n, t.pos_n), pos_sigma=o.pos_sigma, att_sigma=o.att_sigma,
                            att=turn(o.q_nb, t.q_nb), refused=self.apps[side].health.out.refused,
                            flags=self.apps[side].health.out.flags,
                        )  # fmt: skip
                        if side:
                            put(
                                name, rot=o.wind_rot, rot_sigma=o.wind_rot_sigma, rel=np.subtract(o.rel_pos_t, t.xi),
                                vel=np.subtract(o.rel_vel_t, t.xi_dot), w_b=np.subtract(o.w_b, t.w_b), rel_sigma=o.rel_sigma,
                            )  # fmt: skip
            w.step(cmds)
        return {k: {a: np.array(b) for a, b in v.items()} for k, v in log.items()}


def turn(a: tuple[float, ...], b: tuple[float, ...]) -> np.ndarray:
    """Small rotation [3] [rad] from attitude b to a, body axes z, y, x: about psi, theta, phi of level flight."""
    p0, p1, p2, p3 = a
    q0, q1, q2, q3 = b[0], -b[1], -b[2], -b[3]
    double = math.copysign(2.0, q0 * p0 - q1 * p1 - q2 * p2 - q3 * p3)
    x = q0 * p1 + p0 * q1 + q2 * p3 - q3 * p2
    y = q0 * p2 + p0 * q2 + q3 * p1 - q1 * p3
    z = q0 * p3 + p0 * q3 + q1 * p2 - q2 * p1
    return np.array([double * z, double * y, double * x])


def rms(e: np.ndarray) -> np.ndarray:
    """Per column."""
    return np.asarray(np.sqrt(np.mean(np.square(e), axis=0)))
