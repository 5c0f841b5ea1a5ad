"""The windshear flight with the sensors as they are: plant and onboard software whole, in memory, judged by the truth."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.app import FlightApp
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.mission import WindshearMission
from hil_scripts.launch import preflight, runfolder
from sim_plant.aircraft.twinjet.member import TwinJetMember
from sim_plant.failures.script import Event
from sim_plant.lost import AircraftLostError
from sim_plant.world import World

Arr = NDArray[np.float64]
DT = 0.02
WHO = "twinjet"
PLANT = f"plant.aircraft.{WHO}.plant."
OTHER_AIRCRAFT = (f"{PLANT}lift_factor=0.95", f"{PLANT}drag_factor=1.05", f"{PLANT}moment_factor=0.9")
CLEAN = (f"{PLANT}burst.outflow_mps=0.0",)
FAR_M = 1200.0  # [m] along the track: 50 m high on the slope
SETTLED_S = 5.0  # [s] after which errors count
HAZARD = ("wind shear", "on the slope", "shear behind", "climbing away")  # how texts of the alerting begin
WARNING = 4  # severity of a text that announces, and below
OWN = 9  # states of the truth


@dataclass
class Seen:
    """What a flight showed, per sample: truth [.,9] (kN), estimate and 1-sigma [.,9], whether the approach was still flown."""

    truth: list[Arr] = field(default_factory=list)
    x: list[Arr] = field(default_factory=list)
    sigma: list[Arr] = field(default_factory=list)
    on: list[bool] = field(default_factory=list)
    nis: list[float] = field(default_factory=list)
    texts: list[tuple[float, int, str]] = field(default_factory=list)  # [s], severity
    lost: bool = False

    def first(self, begin: str) -> float:
        """When the first text that begins so was sent [s]; infinite: never."""
        return next((t for t, _, text in self.texts if text.startswith(begin)), math.inf)

    def announced(self, after_s: float) -> float:
        """When the first warning that is not the alerting's was sent after a time [s]; infinite: never."""
        return next(
            (t for t, s, text in self.texts if t >= after_s and s <= WARNING and not text.startswith(HAZARD)), math.inf
        )


class SensorFlight:
    """A flight that can be copied whole. Raises ConfigError for what cannot be flown."""

    def __init__(self, scenario: str, seed: int, settings: tuple[str, ...]) -> None:
        built = preflight.build(runfolder.resolve(scenario, seed, list(settings), None))
        self.world: World = built.world
        app, member = built.nodes[0].app, self.world.members[0]
        assert isinstance(app, FlightApp) and isinstance(app.mission, WindshearMission)
        assert isinstance(member, TwinJetMember)
        self.app, self.mission, self.member = app, app.mission, member
        self.seen = Seen()
        start = member.flight
        self.slope = (start.p.x_m, start.p.height_m, math.tan(math.radians(start.p.slope_deg)))

    @property
    def t_s(self) -> float:
        """Time of the tick to come [s]."""
        return self.world.t_us * 1e-6

    @property
    def given_up(self) -> bool:
        """Whether the approach has been."""
        return self.mission.guidance.phase not in ("approach", "caution")

    def branch(self) -> SensorFlight:
        """A copy that shares nothing with this flight that either changes."""
        return copy.deepcopy(self)

    def inject(self, event: Event) -> None:
        """Let a fault begin at the tick to come."""
        self.world.faults.inject(event, self.world.tick)

    def tick(self) -> bool:
        """One tick; whether the aircraft is still in the air."""
        s, w = self.seen, self.world
        try:
            frame = w.sense()[0]
        except AircraftLostError:
            s.lost = True
            return False
        t = w.t_us * 1e-6
        command, shot = self.app.tick(frame, DT if w.tick else 0.0)
        s.texts += [(t, text.severity, text.text) for text in shot.texts]
        truth = self.member.flight.truth[:OWN].copy()
        truth[k.T] *= 1e-3
        nav, state = self.mission.nav, self.mission.reports
        s.truth.append(truth)
        s.x.append(nav.x[:OWN].copy())
        s.sigma.append(np.array(nav.sigma[:OWN]))
        s.on.append(not self.given_up)
        s.nis.append(shot.nav.nis / max(shot.nav.nis_dof, 1) if state and nav.started else math.nan)
        w.step([command])
        return True

    def near(self) -> bool:
        """Whether the alerting is about to speak."""
        h, p = self.mission.guidance.state, self.mission.p.guid.hazard
        return h.slow > 0.8 * p.abort_F or h.quick > 0.8 * p.caution_F or self.given_up

    def fly(self, to_s: float, stop: str = "") -> Seen:
        """Fly on to a time [s], the ground, or until `stop`: "near" the alert, "given_up", "safe" after an escape, "far" down
        the slope."""
        safe = 0.0
        while self.t_s < to_s and self.tick():
            if (stop == "near" and self.near()) or (stop == "given_up" and self.given_up):
                break
            truth = self.seen.truth[-1]
            rises = truth[k.VA] * math.sin(truth[k.GA]) + truth[k.WH] > 0.0
            safe = safe + DT if self.mission.guidance.phase == "clear" and truth[k.H] > 60.0 and rises else 0.0
            if (stop == "safe" and safe > 3.0) or (stop == "far" and truth[k.X] > FAR_M):
                break
        return self.seen

    def figures(self) -> dict[str, float]:
        """Loss, least height and speed, abort, error of the slope until it is given up, of the estimate and its honesty."""
        s = self.seen
        truth, x, sigma, on = np.array(s.truth), np.array(s.x), np.array(s.sigma), np.array(s.on)
        late = np.arange(len(truth)) * DT >= SETTLED_S
        x0, h0, tan = self.slope
        off = np.abs(truth[:, k.H] - (h0 - (truth[:, k.X] - x0) * tan))[late & on]
        out = {
            "lost": float(s.lost),
            "aborted": float(not on.all()),
            "height_min_m": float(truth[:, k.H].min()),
            "speed_min_mps": float(truth[:, k.VA].min()),
            "slope_max_m": float(off.max()) if len(off) else 0.0,
        }
        if not on.all():
            i = int(np.argmin(on))
            out["abort_s"], out["abort_x_m"] = i * DT, float(truth[i, k.X])
        for name, at in (("w_x", k.WX), ("w_h", k.WH), ("h", k.H)):
            d, e = (x - truth)[late, at], sigma[late, at]
            out[f"{name}.rms"] = float(np.sqrt(np.mean(d * d)))
            out[f"{name}.about_mean"] = float(np.std(d))
            out[f"{name}.inside_2sigma"] = float(np.mean(np.abs(d) <= 2.0 * e))
        out["nis_over_m"] = float(np.nanmean(np.array(s.nis)[late]))
        return out

    def traces(self) -> dict[str, NDArray[Any]]:
        """What a picture needs, every tenth sample."""
        s = self.seen
        return {n: np.array(getattr(s, n))[::10] for n in ("truth", "x", "sigma")}
