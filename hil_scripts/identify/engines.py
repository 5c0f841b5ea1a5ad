"""A JSBSim model's engines and flight control, as shipped but for inputs and outputs: what thrust they give, how fast, and how
far the surfaces go. Used to measure; never flown."""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flightsw.strict import ConfigError
from sim_plant.aircraft.jsbsim import stock
from sim_plant.aircraft.jsbsim.motion import FT, LB, LBF, library

DROP = ("input", "output")
STEP_S = 0.01
SURFACES = (
    ("aileron", "fcs/left-aileron-pos-rad"), ("elevator", "fcs/elevator-pos-rad"), ("rudder", "fcs/rudder-pos-rad"),
)  # fmt: skip
MACHS = (0.0, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
HEIGHTS_M = (0.0, 2000.0, 4000.0, 6000.0, 7000.0, 8000.0, 10000.0, 12000.0)
SETTLE_S = 20.0


@dataclass(frozen=True)
class Step:
    """Times [s] after which thrust has gone 63 and 90 % of the way, up and down."""

    up_63_s: float
    up_90_s: float
    down_63_s: float


class Engines:
    """The whole model. Raises ConfigError if JSBSim refuses it without what may not be loaded."""

    def __init__(self, source: str) -> None:
        path = stock.place(source)
        root = stock.parse(path)
        for part in list(root):
            if part.tag in DROP:
                root.remove(part)
        if root.find("ground_reactions") is None:
            root.append(ET.Element("ground_reactions"))
        jsbsim, name = library(), path.stem
        self.name = name
        shipped = Path(jsbsim.get_default_root_dir())
        with tempfile.TemporaryDirectory() as folder:
            (place := Path(folder, name)).mkdir()
            (place / f"{name}.xml").write_bytes(ET.tostring(root))
            for beside in path.parent.glob("*.xml"):
                if beside.name != path.name:
                    (place / beside.name).write_bytes(beside.read_bytes())
            try:
                self.fdm: Any = jsbsim.FGFDMExec(folder)
                self.fdm.set_debug_level(0)
                paths = (folder, str(shipped / "engine"), str(shipped / "systems"))
                loaded = self.fdm.load_model_with_paths(name, *paths, True)
            except Exception as e:  # whatever its parser makes of the file
                raise ConfigError(f"JSBSim refuses {name} with its engines: {e}") from None
        if not loaded:
            raise ConfigError(f"JSBSim refuses {name} with its engines")
        self.fdm.set_dt(STEP_S)
        pm, self.count = self.fdm.get_property_manager(), 0
        while pm.get_node(f"propulsion/engine[{self.count}]/thrust-lbs") is not None:
            self.count += 1

    def _start(self, height_m: float, mach: float, lever: float) -> None:
        """Running at a lever. Raises ConfigError for a model that does not run without what was dropped, or at all."""
        try:
            self._run(height_m, mach, lever)
        except RuntimeError as e:
            raise ConfigError(f"JSBSim does not run {self.name} with its engines: {e}") from None

    def _run(self, height_m: float, mach: float, lever: float) -> None:
        f = self.fdm
        f["ic/h-sl-ft"], f["ic/mach"], f["ic/theta-rad"] = height_m / FT, mach, 0.03
        f.run_ic()
        f["propulsion/set-running"] = -1
        self._lever(lever)
        f.suspend_integration()
        f.run()
        f.resume_integration()
        f.get_propulsion().get_steady_state()

    def _lever(self, lever: float) -> None:
        for i in range(self.count):
            self.fdm[f"fcs/throttle-cmd-norm[{i}]"] = lever
            self.fdm[f"fcs/mixture-cmd-norm[{i}]"] = 1.0

    @property
    def _thrust(self) -> float:
        return sum(float(self.fdm[f"propulsion/engine[{i}]/thrust-lbs"]) for i in range(self.count)) * LBF

    def thrust(self, height_m: float, mach: float, lever: float) -> float:
        """Steady thrust [N] of all engines."""
        self._start(height_m, mach, lever)
        return self._thrust

    def table(self) -> list[list[float]]:
        """Full thrust [N] at MACHS (rows) and HEIGHTS_M."""
        return [[self.thrust(h, m, 1.0) for h in HEIGHTS_M] for m in MACHS]

    def lever_for(self, height_m: float, mach: float, thrust_N: float) -> float:
        """Lever that gives a thrust [N], by halving; 1 if none does."""
        lo, hi = 0.0, 1.0
        for _ in range(30):
            mid = 0.5 * (lo + hi)
            lo, hi = (mid, hi) if self.thrust(height_m, mach, mid) < thrust_N else (lo, mid)
        return 0.5 * (lo + hi)

    def consumption(self, height_m: float, mach: float, lever: float) -> float:
        """Fuel per thrust and time [kg/(N s)] at a lever."""
        self._start(height_m, mach, lever)
        for _ in range(200):
            self.fdm.run()
        flow = sum(float(self.fdm[f"propulsion/engine[{i}]/fuel-flow-rate-pps"]) for i in range(self.count)) * LB
        return flow / max(self._thrust, 1.0)

    def _times(self, height_m: float, mach: float, a: float, b: float) -> tuple[float, float]:
        goal, start = self.thrust(height_m, mach, b), self.thrust(height_m, mach, a)
        self._start(height_m, mach, a)
        self._lever(b)
        t63 = t90 = SETTLE_S
        for k in range(round(SETTLE_S / STEP_S)):
            self.fdm.run()
            share = (self._thrust - start) / (goal - start) if goal != start else 1.0
            t = (k + 1) * STEP_S
            if share >= 0.632:
                t63 = min(t63, t)
            if share >= 0.9:
                return t63, t
        return t63, t90

    def step(self, height_m: float, mach: float, lever: float) -> Step:
        """Answer to a fifth of the lever's travel more and less."""
        up, down = min(1.0, lever + 0.2), max(0.0, lever - 0.2)
        up63, up90 = self._times(height_m, mach, lever, up)
        return Step(up63, up90, self._times(height_m, mach, lever, down)[0])

    def travel(self, height_m: float, mach: float) -> dict[str, tuple[float, float]]:
        """Least and greatest deflection [rad] by command, of each surface that moves: the greatest on the way, as a damper takes
        some of it back."""
        out = {}
        for name, node in SURFACES:
            ends = []
            for command in (-1.0, 1.0):
                self._start(height_m, mach, 0.5)
                self.fdm[f"fcs/{name}-cmd-norm"] = command
                seen = []
                for _ in range(100):
                    self.fdm.run()
                    seen.append(float(self.fdm[node]))
                self.fdm[f"fcs/{name}-cmd-norm"] = 0.0
                ends.append(max(seen, key=abs))
            if ends[0] * ends[1] < 0.0:
                out[name] = (min(ends), max(ends))
        return out
