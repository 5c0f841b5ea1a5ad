"""What a follower does to the air its leader flies in."""

from __future__ import annotations

from flightsw.strict import ConfigError
from sim_plant.aircraft.base import Member
from sim_plant.couplings.base import Coupling
from sim_plant.kernels import layout as n
from sim_plant.wind.config import Bow
from sim_plant.wind.vortex import wake_on_airframe


class BowCoupling(Coupling):
    """A disturbance of the air mass: the follower's lift and speed as last observed, at its place of now. Raises ConfigError for
    a follower that disturbs nothing and a leader that cannot feel it."""

    def __init__(self, cfg: Bow, source: Member, lead: Member) -> None:
        vector = source.bow_source(cfg)
        for m, lacks in ((source, vector is None), (lead, lead.exposure is None)):
            if lacks:
                what = "disturbs no air" if m is source else "is a point to the air"
                raise ConfigError(
                    f"wind.bow.source = {cfg.source!r}: aircraft.{m.cfg.name}.model = {m.cfg.model!r} {what}"
                )
        assert vector is not None and lead.exposure is not None
        self._vector, self._source, self._lead, self._felt = vector, source, lead, lead.exposure

    def over(self, m: Member) -> None:
        """Add it to the effective wind of the leader; fill what its probes feel of it."""
        s, x = self._source, self._felt
        if m is self._lead and s.obs[n.O_V] > 1.0:  # not while the follower's start is sought
            wake_on_airframe(
                s.s, s.obs, self._vector, m.s, x.points, x.weight, x.n_span, x.n_frame, m.wind, m.probe_wake
            )
