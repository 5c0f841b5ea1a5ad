"""What the report on Sevil (2013), air-data position and fault detection, compares with what: data only.

Printed values are the source's Tables 6.1 to 6.5 (percent; V, beta, alpha). Its position results are figures without numbers;
"as printed" is its method in our hands: equal readings or the multiplicative form with maps of one attitude, isolation by the
largest cosine, Algorithms 11 and 15.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ground.report.verdicts import Target

TITLE = "Air data behind a tanker: Sevil (2013) reproduced"
PURPOSE = (
    "Where three air-data probes say the receiver is in the tanker's wake, and which of them lies: the printed result, the "
    "printed method in our hands, and ours, on the same flights and noise. The wake is a model, in the plant and (with its own "
    "parameters) onboard; what happens where the two differ has its own chapter."
)
VARIABLES = ("V", "beta", "alpha")


@dataclass(frozen=True)
class FdiTable:
    """One printed table. rows: (name, value, printed V, beta, alpha); columns: (heading, case, detector)."""

    number: str
    title: str
    columns: tuple[tuple[str, str, str], ...]
    rows: tuple[tuple[str, str, float, float, float], ...]
    note: str = ""


QUIET, ROUGH = "fdi_refuelling_calm", "fdi_refuelling"
FDI_TABLES: tuple[FdiTable, ...] = (
    FdiTable("6.1", "solo flight, equal readings expected",
             (("as printed", "fdi_solo", "plain"), ("rotation removed", "fdi_solo", "plain_corrected"),
              ("windowed", "fdi_solo", "windowed"), ("CUSUM", "fdi_solo", "cusum")),
             (("false alarms, no fault", "fap_pct", 0.99, 0.99, 0.95), ("true alarms", "tap_pct", 99.40, 100.0, 100.0),
              ("false alarms outside the fault", "fap_fault_pct", 1.01, 1.03, 0.91)),
             "Theory: 1 % false alarms; V 99.483 %, angles 100 % true alarms (noncentral chi-square, lambda 30 and 333)."),
    FdiTable("6.2", "refuelling, equal readings expected although there is a wake",
             (("as printed", ROUGH, "plain"), ("additive", ROUGH, "additive"), ("windowed", ROUGH, "windowed")),
             (("false alarms before the manoeuvre", "fap_before_pct", 1.10, 1.11, 2.16),
              ("during", "fap_during_pct", 0.87, 77.03, 15.27), ("after", "fap_after_pct", 1.15, 100.0, 2.42)),
             "Turbulence and wind on. The share during the manoeuvre depends on its time split, which is not printed."),
    FdiTable("6.3", "at contact, wake known",
             (("as printed", "fdi_contact_calm", "printed"), ("additive", "fdi_contact_calm", "additive"),
              ("windowed", "fdi_contact_calm", "windowed")),
             (("false alarms, no fault", "fap_pct", 1.01, 0.97, 0.95), ("true alarms", "tap_pct", 99.40, 100.0, 100.0),
              ("false alarms outside the fault", "fap_fault_pct", 1.04, 0.93, 0.91)),
             "Calm air, as in the source."),
    FdiTable("6.4", "refuelling, wake known",
             (("as printed, calm", QUIET, "printed"), ("additive, calm", QUIET, "additive"),
              ("as printed, turbulence and wind", ROUGH, "printed"), ("additive, turbulence and wind", ROUGH, "additive"),
              ("windowed, turbulence and wind", ROUGH, "windowed")),
             (("false alarms before the manoeuvre", "fap_before_pct", 1.02, 2.82, 0.94),
              ("during", "fap_during_pct", 1.07, 36.03, 2.33), ("after", "fap_after_pct", 1.00, 0.93, 0.98)),
             "The multiplicative form is ill-posed for sideslip, whose expected values cross zero; the source switched "
             "turbulence and wind off for it."),
    FdiTable("6.5", "refuelling, wake known, whole run",
             (("as printed, calm", QUIET, "printed"), ("additive, calm", QUIET, "additive"),
              ("as printed, turbulence and wind", ROUGH, "printed"), ("additive, turbulence and wind", ROUGH, "additive"),
              ("windowed, turbulence and wind", ROUGH, "windowed")),
             (("false alarms, no fault", "fap_pct", 1.00, 3.11, 1.04), ("true alarms", "tap_pct", 99.42, 100.0, 100.0),
              ("false alarms outside the fault", "fap_fault_pct", 1.03, 4.13, 1.04)),
             "False alarms outside a fault are counted with the corrected formula."),
)  # fmt: skip


def _each(pattern: str) -> tuple[str, ...]:
    return tuple(pattern.replace("*", v) for v in VARIABLES)


_PHASES = tuple(x for k in ("before", "during", "after") for x in _each(f"additive.*.fap_{k}_pct"))
TARGETS: tuple[Target, ...] = (
    Target("static, turbulence + noise + wind, 1 s: RMS [m]", "static_all", ("diff.rms_m",), "<=", 0.35),
    Target("the same, told that it is near the grid as Algorithms 1-16 are", "static_all", ("diff_prior.rms_m",), "<=", 0.35),
    Target("the same: positions available [%]", "static_all", ("diff.available_pct",), ">=", 100.0),
    Target("static, clean, off the nodes: median [m]", "static_clean", ("diff.median_m",), "<", 0.001),
    Target("static, all: RMS over the Cramer-Rao bound", "static_noise", ("abs.crlb_ratio", "diff.crlb_ratio"), "<=", 1.3),
    Target("flight, contact: RMS [m]", "dynamic_all", ("height.contact.rms_m",), "<=", 0.25),
    Target("flight, contact: 95th percentile [m]", "dynamic_all", ("height.contact.p95_m",), "<=", 0.45),
    Target("flight, forward leg: RMS [m]", "dynamic_all", ("height.forward.rms_m",), "<=", 0.25),
    Target("flight, lateral leg: RMS [m]", "dynamic_all", ("height.lateral.rms_m",), "<=", 1.3),
    Target("flight, contact: normalised innovation squared", "dynamic_all", ("height.contact.nis",), "within", 9.0, 0.8),
    Target("tanker 10 % lighter, contact: RMS [m]", "mismatch_weight_-10", ("height.contact.rms_m",), "<=", 0.40),
    Target("tail download 0.03, contact: RMS [m]", "mismatch_tail_0.03", ("height.contact.rms_m",), "<=", 0.40),
    Target("solo, equal readings: false alarms [%]", "fdi_solo", _each("plain.*.fap_pct"), "within", 1.0, 0.1),
    Target("solo: true alarms V [%]", "fdi_solo", ("plain.V.tap_pct",), "within", 99.48, 0.15),
    Target("additive, every phase, turbulence on: false alarms [%]", ROUGH, _PHASES, "within", 1.0, 0.4),
    Target("windowed: true alarms [%]", ROUGH, _each("windowed.*.tap_pct"), ">=", 99.98),
    Target("windowed: false alarms, no fault [%]", ROUGH, _each("windowed.*.fap_pct"), "<", 0.01),
    Target("windowed: delay [samples]", ROUGH, _each("windowed.*.delay_samples"), "<=", 5.0),
    Target("faults that read low: isolated [%]", "fdi_negative",
           (*_each("additive.*.isolated_pct"), *_each("windowed.*.isolated_pct")), ">=", 99.0),
    Target("two faults in V, +3 +3: decided right [%]", "two_same_V", ("virtual.correct_pct",), ">=", 99.0),
    Target("two faults in V, +3 -3", "two_opposite_V", ("virtual.correct_pct",), ">=", 99.0),
    Target("two faults in V, +3 +2", "two_unequal_V", ("virtual.correct_pct",), ">=", 99.0),
    Target("two faults in sideslip, +1 +1 deg", "two_same_beta", ("virtual.correct_pct",), ">=", 99.0),
    Target("two faults in sideslip, +1 -1 deg", "two_opposite_beta", ("virtual.correct_pct",), ">=", 99.0),
)  # fmt: skip

LABELS: dict[str, str] = {
    "A11": "Algorithm 11",
    "A15": "Algorithm 15",
    "A11_gated": "Algorithm 11, gated",
    "abs": "ML, absolute readings",
    "diff": "ML, differences",
    "diff_prior": "ML, differences, told it is near the grid",
    "diff_wide": "ML, differences, whole region",
    "joint": "ML, joint weights",
    "joint_gust": "ML, joint, turbulence only",
    "ml": "ML, 1 s mean, own attitude",
    "fixed": "filter, circulations frozen",
    "augmented": "filter, circulations estimated",
    "height": "filter, and vortex height (as flown)",
    "static": "static ML, no noise",
    "with_fdi": "with exclusion",
    "without_fdi": "without exclusion",
    "plain": "equal readings",
    "plain_corrected": "equal readings, rotation removed",
    "printed": "as printed",
    "multiplicative": "multiplicative, own attitude",
    "additive_table": "additive, map attitude",
    "additive": "additive",
    "windowed": "windowed",
    "windowed_kept": "windowed, not cleared",
    "cusum": "CUSUM",
    "virtual": "with virtual sensor",
    "virtual_strict": "with virtual sensor, refused at 0.01 %",
    "three_probes": "three probes alone",
    "without": "as is",
    "with_jpj": "with J P Jᵀ",
}
ORDER = ("sevil", "sevil_static", "sevil_algorithms", "sevil_probes", "sevil_dynamic", "sevil_mismatch", "sevil_fdi",
         "sevil_position_noise", "sevil_two_faults", "sevil_integrated")  # fmt: skip


CASE_LABELS = {"all": "all disturbances", "two_none_V": "none, V", "calm": "calm air, perfect attitude",
               "filter_air_only": "filter, air data only", "algorithm_11_10s": "algorithm 11, mean of 10 s"}  # fmt: skip


def label(name: str) -> str:
    """Name of an estimator or detector for the reader."""
    return LABELS.get(name, name.replace("_", " "))


def labels(names: Sequence[str]) -> dict[str, str]:
    """Label of each estimator."""
    return {n: label(n) for n in names}
