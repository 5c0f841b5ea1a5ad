"""The wake a leader sheds, on those that follow it."""

from __future__ import annotations

from collections.abc import Sequence

from flightsw.strict import ConfigError
from sim_plant.aircraft.base import Member
from sim_plant.couplings.base import Coupling
from sim_plant.couplings.relative import pairs
from sim_plant.wind.config import Wake
from sim_plant.wind.trail import Trail
from sim_plant.wind.trail_kernel import trail_on_airframe
from sim_plant.wind.vortex import wake_on_airframe
from sim_plant.wind.wake import Exposure


class WakeCoupling(Coupling):
    """A disturbance of the air mass, not an act of its own: it depends on the leader's momentary lift and is felt before anything
    is observed. Raises ConfigError for a leader that sheds none and a follower that cannot feel it."""

    def __init__(self, cfg: Wake, members: Sequence[Member], dt_s: float) -> None:
        found = pairs(members)
        self._lead = found[0][0]
        source = self._lead.wake_source(cfg)
        if source is None:
            raise ConfigError(f"wind.wake.source = {cfg.source!r}: its model = {self._lead.cfg.model!r} sheds no wake")
        self.source = source
        self._trail = Trail(cfg, source, dt_s) if cfg.path == "flown" else None
        self._ticks, self._due = 0, True
        self._felt: dict[str, Exposure] = {}
        for _, m in found:
            if m.exposure is None:
                who = f"aircraft.{m.cfg.name}.model = {m.cfg.model!r}"
                raise ConfigError(f"wind.wake.source = {cfg.source!r}: {who} would fly through it unmoved")
            self._felt[m.cfg.name] = m.exposure

    @property
    def straight(self) -> bool:
        """Whether it lies along the flow of the moment, and so has nothing to remember."""
        return self._trail is None

    def place(self) -> None:
        """Another tick: the trail is no longer that of now."""
        self._ticks, self._due = self._ticks + 1, True

    def _shed(self, trail: Trail) -> None:
        lead = self._lead
        if self._ticks > 1:
            trail.shed(lead.s, lead.obs, lead.calm, lead.free)
        else:
            trail.begin(lead.s, lead.obs, lead.calm)
        self._due = self._ticks == 0  # before the first tick the start is sought

    def over(self, m: Member) -> None:
        """Add the wake to the effective wind of a follower; what its probes feel of it with it."""
        x, lead = self._felt.get(m.cfg.name), self._lead
        if x is None:
            return
        if self._trail is not None:
            t = self._trail
            if self._due:
                self._shed(t)
            trail_on_airframe(
                lead.s, lead.obs, self.source, t.parts, m.s, x.points, x.weight, x.n_span, x.n_frame, m.wind,
                m.probe_wake,
            )  # fmt: skip
        else:
            wake_on_airframe(
                lead.s, lead.obs, self.source, m.s, x.points, x.weight, x.n_span, x.n_frame, m.wind, m.probe_wake
            )
