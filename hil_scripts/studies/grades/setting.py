"""What the scenario `refueling` is changed by for a graded flight."""

from __future__ import annotations

from dataclasses import dataclass

START_M = [-47.0, 0.0, 12.5]  # [m] pre-contact: observation is flown there, and nothing is asked of the way to it
BARE = ("receiver.integrity.on=false",)  # what the flight file believes is one grade's


@dataclass(frozen=True)
class Timetable:
    """[s] Orders to close in to pre-contact and contact, the tanker's turn, latest arrival at contact, time watched from it."""

    precontact_s: float = 20.0
    contact_s: float = 40.0
    turn_s: float = 150.0
    arrive_s: float = 130.0
    watch_s: float = 150.0


def settings(grade: str, sigma_mps: float, times: Timetable, guarded: bool = False) -> tuple[str, ...]:
    """What the scenario `refueling` is changed by; both aircraft carry sensors of the grade; guarded: flight files that believe
    that, with integrity of the relative position and calibrated wind."""
    files = (
        f"plant.aircraft.tanker.mission=tanker_{grade}", f"plant.aircraft.receiver.mission=receiver_{grade}",
        "receiver.wind_calibration.on=true",
    )  # fmt: skip
    return (
        *(files if guarded else BARE),
        f"plant.sensors.tanker.grade={grade}", f"plant.sensors.receiver.grade={grade}",
        f"plant.wind.dryden.sigma_mps={sigma_mps}", f"plant.event.0.t_s={times.precontact_s}",
        f"plant.event.1.t_s={times.contact_s}", f"tanker.guid.first_leg_s={times.turn_s}",
        f"plant.aircraft.receiver.start.xi_m={START_M}", f"receiver.guid.observation_m={START_M}",
    )  # fmt: skip
