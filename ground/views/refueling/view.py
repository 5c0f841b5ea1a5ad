"""The refuelling as a view: tanker and receiver, each alone or together."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flightsw.icd.dialect import HOUSE, VALUES
from ground.columns import Columns
from ground.link.packets import PHASES
from ground.run import Run
from ground.views.base import NOT_VALID, Command, Figures, Heard, Mask, Value, View, Words
from ground.views.refueling import integrity
from ground.views.refueling.aircraft import NAMES, RECEIVER, TANKER
from ground.views.refueling.figures import contact_metrics, downwash, measuring, missing, relative
from ground.views.refueling.signals import signals

if TYPE_CHECKING:
    from ground.rrd.layout import Layout, Look
    from ground.rrd.series import Sink
    from ground.signals import Signal

# phases of its missions alone (WKF_PHASE); the others any mission may be in
OWN = {
    "OBSERVATION",
    "TO_PRECONTACT",
    "PRECONTACT",
    "TO_CONTACT",
    "CONTACT",
    "DISCONNECT",
    "RETURN",
    "BREAKAWAY",
    "LEG",
    "TURN",
}
OWN |= {"ENROUTE", "JOIN_UP", "RDV_APPROACH", "RDV_TURN", "RDV_ROLLOUT", "RDV_LEG"}
PHASE_NUMBERS = [v for v, name in PHASES.items() if name in OWN]
SPEED: tuple[float, ...] = (
    0.0,
    0.0,
    -1.0,
    0.0,
    0.0,
    0.0,
    0.0,
)  # MAV_CMD_DO_CHANGE_SPEED: airspeed, .., throttle left alone
ORDERS = tuple(
    Command(word, VALUES["MAV_CMD_USER_1"], ("receiver", "receiver_rendezvous"), RECEIVER, (float(v),) + (0.0,) * 6)
    for v, word in HOUSE.words("WKF_ACTION").items()
)


class Refueling(View):
    """Station keeping, boom, the two aircraft."""

    aircraft = NAMES
    own_time = frozenset({"WIND_CALIBRATION"})
    commands = (
        *ORDERS,
        Command(
            "speed", VALUES["MAV_CMD_DO_CHANGE_SPEED"], ("tanker", "rendezvous"), TANKER, SPEED, Value(1, 195.0, "m/s")
        ),
    )

    def finds(self, tlm: Columns) -> bool:
        """A relative estimate, or a phase of one of the two."""
        return any(
            message == "RELATIVE_STATE"
            or (message == "MISSION_STATUS" and bool(np.isin(t["phase"], PHASE_NUMBERS).any()))
            for (_, message), t in tlm.tables.items()
        )

    def counts(self, tlm: Columns, sysid: int, t_us: NDArray[np.int64]) -> Mask | None:
        """The receiver's while its mission measures."""
        return measuring(tlm, t_us) if sysid == RECEIVER else None

    def figures(self, run: Run) -> Figures:
        """contact.*, the downwash, nees.relative.*, integrity.*."""
        own = contact_metrics(run.truth, run.tlm) | downwash(run) | relative(run) | missing(run)
        return own | integrity.figures(run.truth, run.tlm)

    def signals(self, run: Run) -> list[Signal]:
        """See ground.views.refueling.signals and integrity."""
        return [*signals(run), *integrity.signals(run)]

    def layout(self, run: Run, look: Look) -> Layout:
        """Formation, boom, overview."""
        from ground.views.refueling.draw import layout

        return layout(run, look)

    def draw(self, sink: Sink, run: Run) -> None:
        """Relative position and the scene."""
        from ground.views.refueling.draw import draw

        draw(sink, run)

    def words(self, heard: Heard) -> list[Words]:
        """Where the receiver is, and how far from where it should be; its trust; what is learnt of sensors."""
        return self._place(heard) + integrity.words(heard.get(integrity.MESSAGE)) + _sensors(heard)

    @staticmethod
    def _place(heard: Heard) -> list[Words]:
        rel = heard.get("RELATIVE_STATE")
        if rel is None:
            return []
        error = [p - c for p, c in zip(rel["pos"], rel["cmd_pos"], strict=True)]
        place = " ".join(f"{p:+.2f}" for p in rel["pos"]) + " m (tanker axes)"
        off = " ".join(f"{e:+.2f}" for e in error) + " m (estimated)"
        return [
            Words(label, "RELATIVE_STATE", text if rel["valid"] else NOT_VALID)
            for label, text in (("position", place), ("error", off))
        ]


def _sensors(heard: Heard) -> list[Words]:
    c = heard.get("WIND_CALIBRATION")
    if c is None:
        return []
    heading, sigma = math.degrees(c["attitude"][2]), math.degrees(c["attitude_sigma"][2])
    text = f"airspeed {c['airspeed']:+.1f} +-{c['airspeed_sigma']:.1f} m/s, heading {heading:+.2f} +-{sigma:.2f} deg"
    return [Words("sensors", "WIND_CALIBRATION", text if c["valid"] else NOT_VALID)]


VIEW = Refueling()
