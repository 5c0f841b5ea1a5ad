"""What the report on Jing et al. (2007), an approach through a microburst, compares with what: data only.

The print has figures and no tables; the reference figures are those of jing.md, computed once with a program of its own.
"""

from __future__ import annotations

from ground.report.goals import Goal

TITLE = "A jet transport in a microburst: Jing et al. (2007) reproduced and improved"
PURPOSE = (
    "Can the wind of a microburst be told from sensors and a model well enough to fly an escape on it; what 10 % wrong lift and "
    "drag do to that, with the printed remedy, its repairs and ours; and which escape law survives, with the filter in the loop."
)
NOMINAL, ERROR, ESCAPE, SURVIVAL, ALERTS = "jing", "jing_model_error", "jing_escape", "jing_survival", "jing_alerts"
SENSORS = "jing_sensors"
ORDER = (NOMINAL, ERROR, ESCAPE, SURVIVAL, ALERTS, SENSORS)
LABELS = {
    "perfect": "perfect state",
    "ekf13": "EKF, 13 states",
    "ukf13": "UKF, 13 states (the source's)",
    "ukf_printed": "UKF, continuous, to the letter",
    "ukf_43": "UKF, continuous, inverse of (43) off",
    "ukf_continuous": "UKF, continuous, as meant",
    "srckf13": "square-root cubature, 13 states",
    "ekf15_fixed": "EKF, 15 states, no turbulence learnt",
    "ekf15": "EKF, 15 states (default)",
    "kinematic": "kinematic monitor, no aerodynamic model",
    "severe_ukf13": "severe microburst: UKF, 13 states",
    "severe_ekf15": "severe microburst: EKF, 15 states",
    "managed_ekf15": "managed height, EKF, 15 states",
    "managed_45_ekf15": "managed 45 m, EKF, 15 states",
    "default_ekf15": "default alerting and law, EKF, 15 states",
    "ukf13_printed_noise": "UKF, Q_f as printed",
    "ukf13_noise_x100": "UKF, Q_f a hundred times",
    "ukf13_noise_accel_1": "UKF, Q_f, accelerometers to 1 m/s² (repaired)",
    "ukf13_noise_no_accel": "UKF, Q_f, no accelerometers (repaired)",
    "ukf13_accel_1": "UKF, accelerometers to 1 m/s², no Q_f",
}
REMEDY = {"ukf13": "none", "ukf13_printed_noise": "printed", "ukf13_noise_x100": "printed", "ukf13_accel_1": "repaired",
          "ukf13_noise_accel_1": "repaired", "ukf13_noise_no_accel": "repaired", "kinematic": "ours", "ekf15": "ours",
          "managed_ekf15": "ours", "managed_45_ekf15": "ours"}  # fmt: skip
# w_x, w_h RMS [m/s], share inside 2 sigma of each, NIS/9, F RMS, height apart RMS, largest [m]: jing.md 6.1, 6.2
VALUES = ("w_x.rms_mps", "w_h.rms_mps", "w_x.inside_2sigma", "w_h.inside_2sigma", "nis_over_m", "F.rms", "height_apart.rms_m",
          "height_apart.max_m")  # fmt: skip
HEADS = ("w_x [m/s]", "w_h [m/s]", "w_x inside 2 sigma", "w_h inside 2 sigma", "NIS/9", "F RMS", "height apart RMS [m]",
         "largest [m]")  # fmt: skip
HELD_OUT: dict[str, dict[str, tuple[float | None, ...]]] = {
    NOMINAL: {
        **dict.fromkeys(("ekf13", "ukf13", "srckf13"), (0.091, 0.050, 0.93, 0.96, 1.0, 0.0086, 1.4, 4.1)),
        "severe_ukf13": (0.10, 0.05, 0.90, 0.95, None, None, None, None),
    },
    ERROR: {
        "ukf13": (0.65, 0.77, 0.02, 0.0, 3.3, 0.022, 5.7, 15.0),
        "ukf13_printed_noise": (1.12, 0.96, 0.0, 0.0, 2.8, 0.014, 4.8, 21.0),
        "ukf13_noise_accel_1": (0.17, 0.09, 0.95, 0.90, 0.87, 0.013, 7.6, 19.0),
        "ukf13_noise_no_accel": (0.19, 0.06, 0.92, 0.99, 0.77, 0.013, 7.8, 18.0),
        "ukf13_accel_1": (0.61, 0.20, 0.17, 0.24, 3.1, 0.068, 12.0, 30.0),
        "kinematic": (0.11, 0.11, 0.92, 0.98, 0.67, 0.010, 6.9, 16.0),
        "ekf15": (0.092, 0.049, 0.94, 0.97, 1.0, 0.0087, 1.3, 3.8),
    },
}
LAWS = {
    "managed": "managed height (default)",
    "managed_45": "managed 45 m",
    "pitch_10": "pitch 10°",
    "pitch_12": "pitch 12°",
    "pitch_15": "pitch 15° (usual)",
    "climb_5": "climb rate 5 m/s (the source's)",
    "continue": "approach continued (a landing counts as contact)",
    "climb_0": "level",
    "open_loop": "full thrust, elevator held",
}
CLASSES = (("", "all"), ("low.", "peak F below 0.3"), ("middle.", "0.3 to 0.45"), ("high.", "above 0.45"))
# survived of 200 with perfect state, per class: jing.md 6.4
SURVIVED: dict[str, tuple[float, float, float, float]] = {
    "continue": (0.35, 0.41, 0.47, 0.02),
    "open_loop": (0.18, 0.47, 0.07, 0.0),
    "pitch_15": (0.63, 0.98, 0.62, 0.11),
    "pitch_12": (0.72, 1.0, 0.77, 0.21),
    "pitch_10": (0.79, 1.0, 0.86, 0.34),
    "climb_0": (0.59, 1.0, 0.55, 0.07),
    "managed_45": (0.88, 1.0, 0.99, 0.48),
}
SURVIVAL_CASES = {
    "light": "Filter in the loop, light turbulence, caution and abort pair",
    "perfect": "Perfect state, still air, quick abort (as the reference)",
}


def _filter_goals(study: str, where: str, case: str = "ekf15") -> tuple[Goal, ...]:
    return (
        Goal(f"{where}: w_x RMS [m/s]", case, ("w_x.rms_mps",), "<=", 0.11, study=study),
        Goal(f"{where}: w_h RMS [m/s]", case, ("w_h.rms_mps",), "<=", 0.06, study=study),
        Goal(
            f"{where}: inside 2 sigma",
            case,
            ("w_x.inside_2sigma", "w_h.inside_2sigma"),
            "within",
            0.945,
            0.0451,
            study,
        ),
        Goal(f"{where}: F RMS", case, ("F.rms",), "<=", 0.012, study=study),
    )


GOALS: tuple[Goal, ...] = (
    *_filter_goals(NOMINAL, "exact model"),
    *_filter_goals(ERROR, "10 % wrong"),
    Goal("10 % wrong: height from that of perfect feedback, mean over runs of the largest [m]", "ekf15",
         ("height_apart.max_m",), "<=", 5.0, study=ERROR),
    Goal("the same with the managed law [m]", "managed_ekf15", ("height_apart.max_m",), "<=", 5.0, study=ERROR),
    *_filter_goals(NOMINAL, "default alerting and law", "default_ekf15"),
    Goal("managed law: survived of the drawn microbursts", "light", ("managed.survived",), ">=", 0.85, study=SURVIVAL),
    Goal("more than pitch 15° on the same", "light", ("managed_less_pitch_15",), ">=", 0.2, study=SURVIVAL),
    Goal("severe microburst from 300 m in turbulence: lost", "severe_300_pair_light", ("managed.ekf15.lost",), "<=", 0.0,
         study=ESCAPE),
    Goal("and from 350 m", "severe_350_pair_light", ("managed.ekf15.lost",), "<=", 0.0, study=ESCAPE),
    Goal("turbulence 1.5 m/s: approaches aborted for nothing", "clear_1p5", ("aborted",), "<=", 0.02, study=ALERTS),
)  # fmt: skip


def label(case: str) -> str:
    """Name of an estimator's case for the reader."""
    return LABELS.get(case, case.replace("_", " "))
