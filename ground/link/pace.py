"""`ground send pause | resume | step [TICKS] | pace TIMES`: how fast a lockstep run goes, to the plant."""

from __future__ import annotations

from flightsw.icd.dialect import VALUES
from ground.link.command import COMP_PLANT, CommandError, Order

CMD_PACE: int = VALUES["MAV_CMD_USER_4"]
WORDS = {"pause": "WKF_PACE_PAUSE", "resume": "WKF_PACE_RESUME", "step": "WKF_PACE_STEP", "pace": "WKF_PACE_SPEED"}
ANY = 0  # system id: the pace is that of the whole run


def pace(word: str, value: float | None, to: int | None) -> Order:
    """The command for one of WORDS. Raises CommandError naming what is wrong."""
    if value is not None and word in ("pause", "resume"):
        raise CommandError(f"{word} takes no number, got {value:g}")
    if value is None and word == "pace":
        raise CommandError("pace needs a number: times real time, 0 flat out")
    params = (float(VALUES[WORDS[word]]), value or 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Order(
        ANY if to is None else to, CMD_PACE, params, word if value is None else f"{word} {value:g}", COMP_PLANT
    )
