"""What the report on Hoffmann and Luckner (2010), wind felt by a small UAV, compares with what: data only.

The print gives a gain and a covariance and no other number; the held-out figures are those of hoffmann.md, computed once with a
program of its own.
"""

from __future__ import annotations

from ground.report.goals import Goal

TITLE = "Wind disturbances felt on board a small UAV: Hoffmann and Luckner (2010) reproduced and improved"
PURPOSE = (
    "Which part of the incidence and of the airspeed is wind? The printed constant gain entry by entry, what noise it was made "
    "with, the same estimate with a consistent discrete filter and a nonlinear one, and gust load alleviation made of it."
)
STATES = ("x1", "alpha_W", "V_W", "q", "alpha_K", "V_K", "Theta", "H", "alpha_b")
OUTPUTS = ("q", "alpha", "V_A", "Theta", "H")
ROUNDED = {(5, 0)}  # entry of the gain printed with one digit
ORDER = ("hoffmann_gains", "hoffmann", "hoffmann_spectra", "hoffmann_consistency", "hoffmann_observability",
         "hoffmann_alleviation", "hoffmann_robustness", "hoffmann_sensors", "hoffmann_adaptation")  # fmt: skip
LABELS = {
    "printed": "printed gain",
    "printed_joined": "printed gain, readings joined",
    "xi_printed": "printed noise, sign of E corrected",
    "xi_printed_e": "printed noise and sign of E",
    "bucy_unscaled": "continuous, B B', Theta unscaled",
    "bucy": "continuous, B B', Theta dt",
    "discrete": "discrete, consistent",
    "ekf": "EKF",
    "ukf": "UKF",
    "srckf": "square-root cubature",
    "ekf_ground": "EKF, and GNSS speed",
    "ekf_vertical": "EKF, and accelerometer",
    "ekf_bank": "bank of EKF",
    "true": "true state",
    "default": "estimate, intensity known",
    "vertical": "estimate, and accelerometer",
    "bank": "bank",
    "bank_all": "bank, GNSS and accelerometer",
    "tuned_1": "estimate, told medium turbulence",
    "no_wind_columns": "wind columns zeroed (true state)",
    "band_alone": "a_z counted below the low-pass alone",
    "elevator_only": "elevator alone",
    "elevator_total_true": "elevator alone, for the total (true state)",
    "elevator_total": "elevator alone, for the total",
    "elevator_total_printed": "elevator alone, for the total, printed gain",
    "hold": "hold",
    "servo_bank": "bank of servo models",
    "accelerometer": "with accelerometer",
    "no_accelerometer": "without it",
    "medium": "tuned to medium turbulence",
    "light": "tuned to 0.3 of it",
    "matched": "tuned to 0.01 of it",
    "bank_apart": "bank, filters apart",
    "bank_ground": "bank, and GNSS speed",
}
Row = tuple[float | None, float | None, float | None]
# held-out figures of hoffmann.md: case -> statistic -> estimator -> (alpha_W deg, V_W m/s, bias deg)
HELD_OUT: dict[str, dict[str, dict[str, Row]]] = {
    "case1": {
        "std": {
            "printed": (1.40, 1.45, 0.11),
            "xi_printed": (1.39, 2.87, 0.37),
            "xi_printed_e": (6.33, 5.32, 0.37),
            "bucy_unscaled": (1.75, 0.84, None),
            "bucy": (1.27, 0.54, 0.12),
            "discrete": (0.56, 0.30, 0.08),
        }
    },
    "case1_xi": {"std": {"printed": (2.11, 1.72, None), "discrete": (1.38, 1.51, None)}},
    "case2": {
        "mean": {"printed": (0.28, 0.40, None), "discrete": (0.00, 0.02, None)},
        "std": {"printed": (0.59, 0.48, None), "discrete": (0.51, 0.26, None)},
    },
    "nonlinear": {
        "std": {"printed": (1.69, 0.85, 0.16), "discrete": (1.44, 0.90, 0.14), "ekf": (0.44, 0.72, 0.09)},
    },
}
CASES = {
    "case1": "Case 1: medium turbulence, elevator blocks, vane bias step, linear plant",
    "case1_xi": "Case 1 with the printed process noise driving the plant",
    "case2": "Case 2: ramps of alpha_W and V_W, no turbulence",
    "nonlinear": "Nonlinear plant, 0.3 of medium turbulence",
}
NOTES = {
    "case1": "rms: over all runs; std: of all runs pooled about their mean. hoffmann.md also has mean errors below 0.05 deg and "
    "0.1 m/s for the printed gain, below 0.02 deg and 0.01 m/s for the discrete filter; 0.37 deg of bias is that of the whole "
    "flight.",
    "case2": "hoffmann.md gives its means without sign.",
    "nonlinear": "hoffmann.md does not say which statistic its figures are of, nor whether the elevator moves, on which those of "
    "the linear filters depend most.",
}
NO_COHERENCE = (
    "From spectra pooled over runs. hoffmann.md: alpha_W has no coherence above 0.2 Hz with any filter. So it is once the first "
    "2 s are left out: the ramp of alpha_W, 2 to 2.5 s, then stands on the rim of the first window and what remains is constant. "
    "With the whole record the ramp itself is found; coherence tells of the manoeuvre, not of the filter."
)
# held-out reductions [%] of a_z: case -> loop -> (total, below 2 Hz)
ALLEVIATION: dict[str, dict[str, tuple[float | None, float | None]]] = {
    "linear": {
        "true": (16.0, 63.0), "default": (11.0, 47.0), "printed": (-12.0, 41.0), "vertical": (17.7, 61.0),
        "elevator_total_true": (4.5, None), "elevator_total": (3.4, None), "elevator_total_printed": (3.0, None),
    },
    "linear_servo80": {"default": (12.0, 48.0), "printed": (-5.0, 44.0)},
    "linear_100hz_servo80": {
        "true": (30.0, 79.0), "default": (17.0, 56.0), "printed": (-13.0, 54.0), "vertical": (30.0, 76.0),
    },
}  # fmt: skip
AGAINST_HOLD = (
    "Against a pitch and height hold in the same gusts; RMS of a_z, positive is less, red is more than with the hold. Held-out "
    "figures of the hold: 1.87 m/s² in total, 1.24 below 2 Hz; of zeroed wind columns: 135 to 150 % worse; of a_z counted below "
    "the low-pass alone: total 2 to 170 % worse."
)
PLAINLY = (
    "The source holds each reading until the next, so that its filter never uses the newest one; joined by straight lines they "
    "are as causal as those of the sampled filters. Joined, the printed gain takes as much off a_z below 2 Hz as the estimate "
    "that knows the intensity, and raises the total, which that one lowers; the consistent filter told the print's intensity "
    "does best below 2 Hz and raises the total most. So on the linear plant at 50 Hz; less a_z by"
)
# two loops that differ in one thing, and in which
STEPS = (
    ("printed", "printed_joined", "the printed gain's readings joined, not held"),
    ("printed_joined", "tuned_1", "a consistent, sampled filter told the same intensity"),
    ("tuned_1", "default", "the intensity known"),
    ("default", "bank", "the intensity found on board, not known"),
    ("default", "vertical", "accelerometer"),
    ("vertical", "true", "the state known"),
)
AIRCRAFT = {
    "as_believed": "as believed",
    "servo_30": "servos of 30 rad/s",
    "servo_55": "servos of 55 rad/s",
    "servo_80": "servos of 80 rad/s",
    "one_sample_later": "commands one sample later",
    "moment_80pct": "pitching moments 80 %",
    "moment_120pct": "pitching moments 120 %",
    "lift_90pct": "lift 90 %",
    "lift_110pct": "lift 110 %",
}
BELIEVED = (
    "Nonlinear plant, 0.3 of medium turbulence, flight file gust. Believed on board in every row: servos of 40 rad/s, commands "
    "one sample late, the published moments and lift. Positive is less a_z than with the hold on the same aircraft, red is more."
)
CALM = (
    "RMS errors from 5 s after each change on. Tuned to 0.01 is the bound in calm air (hoffmann.md: 0.52 deg of alpha_W for the "
    "filter tuned to medium turbulence, 0.03 deg for that one)."
)
RATIO_HZ = ("0p2", "0p5", "1", "2", "4", "8")


GAINS, FLIGHTS, LOOP = "hoffmann_gains", "hoffmann", "hoffmann_alleviation"
GOALS: tuple[Goal, ...] = (
    Goal("gain entries within 5 % of the print (one printed with one digit within its rounding), of 45", "back_fitted",
         ("within_5pct_or_rounding",), ">=", 45.0, study=GAINS),
    Goal("the same with the printed noise: it does not give the gain", "printed_noise", ("within_5pct",), "<=", 15.0,
         study=GAINS),
    Goal("case 1: alpha_W RMS [deg]", "case1", ("discrete.alpha_w.rms_deg",), "<=", 0.65, study=FLIGHTS),
    Goal("case 1: V_W RMS [m/s]", "case1", ("discrete.v_w.rms_mps",), "<=", 0.40, study=FLIGHTS),
    Goal("case 2: coherence of alpha_W above 0.2 Hz, where there is nothing to estimate", "case2",
         tuple(f"{a}.alpha_w.coherence_{hz}hz" for a in ("printed", "discrete") for hz in ("0p5", "1", "2", "4", "8")),
         "<=", 0.05, study=FLIGHTS),
    Goal("phase of alpha_W at 2 Hz [deg]", "sigma_1", ("discrete.alpha_w.phase_2hz_deg",), "within", 0.0, 5.0,
         "hoffmann_spectra"),
    Goal("nonlinear plant: alpha_W RMS [deg]", "nonlinear", ("ekf.alpha_w.rms_deg",), "<=", 0.5, study=FLIGHTS),
    Goal("model and noise exact: NEES/9", "sigma_1", ("nees_over_n",), "within", 1.0, 0.1, "hoffmann_consistency"),
    Goal("the same in light turbulence", "sigma_0p3", ("nees_over_n",), "within", 1.0, 0.1, "hoffmann_consistency"),
    Goal("a_z below 2 Hz reduced [%]", "linear", ("default.reduction_low_pct",), ">=", 45.0, study=LOOP),
    Goal("the same with accelerometer [%]", "linear", ("vertical.reduction_low_pct",), ">=", 58.0, study=LOOP),
    Goal("total a_z not raised [%]", "linear", ("default.reduction_total_pct", "vertical.reduction_total_pct"), ">=", 0.0,
         study=LOOP),
    Goal("nonlinear plant, accelerometer: a_z below 2 Hz reduced [%]", "nonlinear", ("vertical.reduction_low_pct",),
         ">=", 58.0, study=LOOP),
    Goal("calm air: alpha_W noise of the bank [deg]", "calm", ("bank.alpha_w.rms_deg",), "<=", 0.1,
         study="hoffmann_adaptation"),
)  # fmt: skip


def label(name: str) -> str:
    """Name of an estimator or loop for the reader."""
    return LABELS.get(name, name.replace("_", " "))
