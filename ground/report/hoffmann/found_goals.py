"""Acceptance figures of the campaign on an aircraft that is not as believed: data only."""

from __future__ import annotations

from ground.report.goals import Goal

STUDY = "hoffmann_sensors"
SOUND = {
    "nominal": "as believed",
    "servo_20": "servos 20 rad/s",
    "servo_28": "servos 28 rad/s",
    "servo_56": "servos 56 rad/s",
    "servo_80": "servos 80 rad/s",
    "lift_75": "lift 75 %",
    "lift_115": "lift 115 %",
    "V_plus_2": "airspeed + 2 m/s",
    "V_minus_2": "airspeed - 2 m/s",
}
LATE = {
    "late_1": "a sample later",
    "late_2": "two samples later",
    "servo_20_late_2": "20 rad/s, two later",
    "servo_34_late_1": "34 rad/s, one later",
    "servo_68_late_2": "68 rad/s, two later",
    "servo_80_late_2": "80 rad/s, two later",
    "servo_30_late_1_lift_115": "30 rad/s, one later, lift 115 %",
    "servo_24_late_2_lift_115": "24 rad/s, two later, lift 115 %",
}


def _least(cases: dict[str, str], total: float, low: float) -> tuple[Goal, ...]:
    out = []
    for case, what in cases.items():
        demand = 60.0 if case == "nominal" else low
        out.append(
            Goal(f"{what}: total a_z reduced [%]", case, ("servo_bank.reduction_total_pct",), ">=", total, study=STUDY)
        )
        out.append(
            Goal(f"{what}: below 2 Hz reduced [%]", case, ("servo_bank.reduction_low_pct",), ">=", demand, study=STUDY)
        )
    return tuple(out)


GOALS = (*_least(SOUND, 0.0, 55.0), *_least(LATE, -5.0, 40.0))
