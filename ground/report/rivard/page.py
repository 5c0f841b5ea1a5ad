"""What the report on Rivard (1982), the range-only rendezvous, compares with what: data only.

Printed values are of 30 runs, in nautical miles. The source prints y as tanker minus receiver (its text says the opposite; its
tables decide); campaigns store receiver minus tanker, so printed tables are compared with the sign turned.
"""

from __future__ import annotations

from dataclasses import dataclass

from ground.report.verdicts import Target

TITLE = "Rendezvous by range alone: Rivard (1982) reproduced and improved"
PURPOSE = (
    "A tanker meets a receiver head on, turns 180 degrees and rolls out two miles ahead of it, with nothing but air-to-air TACAN "
    "range. The printed tables of thirty runs beside tens of thousands of ours, what each improvement brings with the same "
    "sensor, and what happens in the cases the source left open."
)
NM = 1852.0
KN = 1852.0 / 3600.0

# printed RMS of the gain sweep without guard (x, y), as far as the source gives numbers
PRINTED_GAIN = {2.0: (0.84, 0.44), 3.0: (0.58, 0.42), 12.0: (9.3, 3.0)}

# (row of the printed table, case by rule A, case by rule B or empty)
TABLE1 = (
    ("present method (open loop)", "open", ""),
    ("cross-track", "cross_a", "cross_b"),
    ("closed loop, k = 2", "k2_a", "k2_b"),
    ("closed loop, k = 3", "k3_a", "k3_b"),
    ("closed loop, k = 3, state known", "true_k3_a", "true_k3_b"),
)
TABLE2 = (
    ("present method (open loop)", "t2_open", ""),
    ("cross-track", "t2_cross", ""),
    ("closed loop, k = 3", "t2_k3", ""),
)
# printed / reproduced / improved: (what, the row's case in the study that holds the print, our case)
SUMMARY = (
    ("present method: chart, 30 deg from 17 NM", "open"),
    ("present method, chart interpolated", "open_interpolated"),
    ("cross-track", "cross_b"),
    ("closed loop, k = 3, source's filter", "k3_b"),
    ("the same, turn started on the second (rule A)", "k3_a"),
    ("improved: same sensor, 5 deg/s roll", "b7re"),
    ("improved, no radar, from 100 NM", "unaided_best"),
    ("source's filter, no radar, from 100 NM", "unaided_seed"),
)
STEPS = (
    ("k3_a", "B0: source's filter, k = 3"),
    ("b1", "B1: the same, q_y and R tuned"),
    ("b2", "B2: eight-state EKF, k = 3"),
    ("b3", "B3: eight-state, Gauss-Hermite, k = 3"),
    ("b4", "B4: Gaussian sum of 15, k = 3"),
    ("b5", "B5: and two-arc planner at 2 Hz"),
    ("b6", "B6: and steering to 10 NM offset"),
    ("b7", "B7: and speed trim of 20 kn"),
    ("b7r", "B7r: roll at 5 deg/s, compensated"),
    ("b7e", "B7e: B7, turn 1 s late"),
    ("b7re", "B7re: B7r, turn 1 s late (as shipped)"),
    ("b8", "B8: B7 with the source's filter"),
    ("roll_uncompensated", "B0 with roll at 5 deg/s, not compensated"),
)
UNAIDED = (
    ("unaided_seed", "source's filter, k = 3, from 100 NM"),
    ("unaided", "Gaussian sum of 57, from 100 NM"),
    ("unaided_roll", "roll at 5 deg/s, compensated"),
    ("unaided_roll_no_trim", "the same without speed trim"),
    ("unaided_best", "turn 1 s late (as shipped)"),
    ("weave_60", "60 NM, radar 2 NM, weave of 30 deg"),
)
SENSORS = (
    ("b7re", "range only", "k3_a"),
    ("bearing_2", "bearing 2 deg", "bearing_2_k3"),
    ("bearing_1", "bearing 1 deg", "bearing_1_k3"),
    ("bearing_0p5", "bearing 0.5 deg", "bearing_0p5_k3"),
    ("link_100", "data link 100 m", "link_100_k3"),
    ("link_10", "data link 10 m", "link_10_k3"),
    ("perfect", "state known", "true_k3_a"),
)
FILTERS = {
    "filter": "source's filter",
    "b2": "eight-state EKF",
    "b3": "eight-state, Gauss-Hermite",
    "b4": "Gaussian sum of 15, k = 3",
    "b7re": "Gaussian sum of 15, as shipped",
    "unaided_best": "Gaussian sum of 57, from 100 NM",
    "unaided_seed": "source's filter, from 100 NM",
}
LABELS = {
    "nominal": "nothing wrong",
    "bias_x2": "range bias doubled",
    "noise_x2": "range noise doubled",
    "fluctuation_x1p5": "speed fluctuation x 1.5",
    "velocity_x2": "speed error doubled",
    "drift_x5": "drift and walk x 5",
    "all_four": "first four together",
    "dropout_30": "30 % of ranges lost",
    "dropout_60": "60 % of ranges lost",
    "outage_60": "no range from 80 to 140 s",
    "outage_turn": "no range from 140 to 200 s",
    "latency_1_stamped": "1 s late, stamped",
    "latency_1": "1 s late, not stamped",
    "latency_3_stamped": "3 s late, stamped",
    "latency_3": "3 s late, not stamped",
    "wind_error_10": "wind wrong by 10 kn per axis",
    "wind_error_20": "wind wrong by 20 kn per axis",
    "tanker_errors": "tanker: bank 0.5 deg, speed 2 kn off",
    "tanker_errors_x3": "tanker: bank 1.5 deg, speed 6 kn off",
    "turn_30_late": "turns 30 deg at 120 s",
    "faster_50_late": "50 kn faster from 120 s",
    "crosswind_30": "crosswind 30 kn",
    "crosswind_60": "crosswind 60 kn",
    "headwind_30": "along-track wind 30 kn",
    "headwind_60": "along-track wind 60 kn",
}
STATES = (("velocity", "constant speed error"), ("fluctuation", "fluctuating speed"), ("drift", "drift across"),
          ("altitude", "altitude error"), ("bias", "range bias"))  # fmt: skip


def label(case: str) -> str:
    """Name of a disturbed case for the reader."""
    if case in LABELS:
        return LABELS[case]
    head, _, tail = case.rpartition("_")
    if head == "turn":
        return f"turns {tail} deg at 60 s"
    if head in ("faster", "slower"):
        return f"{tail} kn {head} from 60 s"
    return case.replace("_", " ")


@dataclass(frozen=True)
class Goal(Target):
    """An acceptance figure; unit "NM" divides the campaign's metres."""

    unit: str = "NM"

    @property
    def scale(self) -> float:
        """SI per unit shown."""
        return NM if self.unit == "NM" else 1.0


X, Y = ("x.rms_m",), ("y.rms_m",)


def _pair(what: str, case: str, x: float, y: float, sense: str, tol_x: float = 0.0, tol_y: float = 0.0) -> list[Goal]:
    return [Goal(f"{what}: x RMS", case, X, sense, x, tol_x), Goal(f"{what}: y RMS", case, Y, sense, y, tol_y)]


_NEES = tuple(f"t{t}.nees3" for t in range(10, 161, 10))
GOALS: tuple[Goal, ...] = (
    *_pair("open loop", "open", 1.08, 1.35, "within", 0.02, 0.03),
    *_pair("cross-track, rule A", "cross_a", 1.00, 0.31, "within", 0.02, 0.02),
    *_pair("k = 2, rule A", "k2_a", 0.77, 0.37, "within", 0.02, 0.02),
    *_pair("k = 3, rule A", "k3_a", 0.725, 0.380, "within", 0.02, 0.02),
    Goal("source's filter from 100 NM: sigma of y at 310 s", "unaided_seed", ("t310.y.sigma_m",), "within", 4.07, 0.15),
    *_pair("improved, same sensor, 5 deg/s roll", "b7re", 0.40, 0.12, "<="),
    *_pair("improved, unaided from 100 NM", "unaided_best", 0.35, 0.12, "<="),
    Goal("mean NEES/3 until 160 s, radar", "b7re", _NEES, "within", 1.0, 0.1, ""),
    Goal("mean NEES/3 until 160 s, unaided", "unaided_best", _NEES, "within", 1.0, 0.1, ""),
    *_pair("bearing 1 deg", "bearing_1", 0.11, 0.06, "<="),
    *_pair("data link 10 m", "link_10", 0.06, 0.03, "<="),
    Goal("receiver turns 30 deg: crew warned", "turn_30", ("alarm.any",), ">=", 0.99, 0.0, ""),
    Goal("receiver 50 kn faster: crew warned", "faster_50", ("alarm.any",), ">=", 0.99, 0.0, ""),
)
