"""What the report on Lee (2011), tanker and receiver state and wind estimation, compares with what: data only.

Claims are the source's printed results (chapters 4 to 6). Its "%" of direction is undefined (of 180, of 360 or of the
angle), so direction claims are quoted and not compared. Its process noise and gains are not printed: "as printed" is our
rendition of its method with values of our own.
"""

from __future__ import annotations

from dataclasses import dataclass

TITLE = "State and wind estimation in aerial refuelling: Lee (2011) reproduced"
PURPOSE = (
    "Every case of the dissertation flown many times: the printed claim, our rendition of the method as printed, and our "
    "default filter, all on the same noise in the same runs."
)


@dataclass(frozen=True)
class Claim:
    """A tanker case: what it is, what the source printed, and what our default filter is held to.

    magnitude_pct: printed bound of the relative wind magnitude error; target_*: RMS over the runs, None: no target.
    convergence: printed time into the 3-sigma bound per axis N, E, D [s].
    """

    label: str
    what: str
    printed: str
    magnitude_pct: float | None = None
    convergence: tuple[float | None, float | None, float | None] = (None, None, None)
    target_pct: float | None = None
    target_deg: float | None = None


TANKER: dict[str, Claim] = {
    "tanker_I": Claim("I", "flight wind, small noise", "magnitude usually < 5 % (10 % in turns), direction < 3 %",
                      5.0, (20, 20, 10), 1.5, 1.1),
    "tanker_I_sine": Claim("I, sine", "flight wind replaced by slow sines, small noise", "as case I", 5.0, (20, 20, 10)),
    "tanker_II": Claim("II", "correlated wind model, small noise", "magnitude < 4 %, direction < 2 %",
                       4.0, (20, 20, 10), 1.5, 1.1),
    "tanker_II_racetrack": Claim("II, racetrack", "the thousand seconds of Fig. 7.1, four half turns", "as case II", 4.0,
                                 (20, 20, 10)),
    "tanker_III": Claim("III", "correlated wind model, large noise",
                        "magnitude < 5 % (12 % in turns), direction < 5 % (10 % in turns)",
                        5.0, (None, 40, None), 3.2, 2.0),
    "tanker_IV": Claim("IV", "flight wind, large noise",
                       "printed without aerodynamic model only, see below", None, (None, None, None), 4.0, 2.4),
    "tanker_IV_sine": Claim("IV, sine", "flight wind replaced by slow sines, large noise", "as case IV"),
    "tanker_III_no_aero": Claim("III, no aero model", "accelerometers instead of the aerodynamic model",
                                "magnitude < 10 %, direction < 10 %", 10.0, (20, 40, None), 4.0),
    "tanker_IV_no_aero": Claim("IV, no aero model", "accelerometers instead of the aerodynamic model",
                               "magnitude < 10 %, direction < 5 %", 10.0, (40, 40, None), 5.5),
    "tanker_IV_no_aero_sine": Claim("IV, no aero model, sine", "flight wind replaced by slow sines",
                                    "as case IV, no aero model"),
    "tanker_II_coloured": Claim("II, coloured", "sensor noise with tau = 20 s",
                                "magnitude < 10 %, direction < 10 %; only slightly better than the calculated wind",
                                10.0, (100, 100, 80), 2.6),
    "tanker_III_coloured": Claim("III, coloured", "sensor noise with tau = 20 s",
                                 "magnitude < 10 %, direction < 10 %; far better than the calculated wind",
                                 10.0, (200, 120, 0), 4.0),
}  # fmt: skip

TARGET_CONVERGENCE_S = 2.0  # [s] white noise
TARGET_INSIDE_PCT = 97.0
TARGET_PCRB = 1.25  # cases I to III
BOUNDED = ("tanker_I", "tanker_II", "tanker_III")
BOOM_LIMIT_M = 2.0  # [m] per axis, quoted by the source

LABELS: dict[str, str] = {
    "default": "our default",
    "printed": "as printed",
    "cmw": "calculated wind, moving mean",
    "no_velocity": "without measured velocity",
    "no_aero": "no aerodynamic model",
    "random_walk": "wind as random walk",
    "bound": "posterior Cramer-Rao bound",
    "wind": "true wind",
    "hybrid": "hybrid (accelerometers + moments)",
    "coloured_removed": "colour removed (as printed)",
    "coloured_scaled": "R scaled for colour",
    "coloured_augmented": "noise states augmented",
    "coloured_wind_form": "noise states, wind as state",
    "ignored": "colour ignored",
    "measured": "measured feedback",
    "estimated": "estimated feedback",
    "true": "true-state feedback",
}


@dataclass(frozen=True)
class Sweep:
    """A parameter study: title, name of the swept parameter with unit, its key in the cases' params, and what the source printed:
    of no kind of noise, of white, of coloured noise. Data of one kind say nothing about a claim for the other."""

    title: str
    xlabel: str
    params: tuple[str, ...]
    printed: str = ""
    white: str = ""
    coloured: str = ""


STUDIES: dict[str, Sweep] = {
    "lee_colour": Sweep("Colour of the sensor noise", "correlation time tau of the sensor noise [s]", ("tau_s",),
                        coloured="usable from 0.05 to 50 s (the conclusion says 100 s) on the tanker; on the receiver's loop to "
                        "1 s"),
    "lee_turbulence": Sweep("Turbulence, tanker", "Dryden intensity sigma [m/s]", ("sigma_mps", "sigma"),
                            white="works for sigma from 0 to 3 m/s"),
    "lee_receiver": Sweep("Receiver at contact", "case", (),
                          white="contact error < 3, 4, 3 m, wind < 8 % / < 5 %, 60/60/20 s",
                          coloured="tau = 1 s: contact error < about 2 m, wind < 5 % / < 5 %, 10/10/18 s"),
    "lee_printed": Sweep("Receiver as printed", "case", (),
                         white="contact error < 3, 4, 3 m, wind < 8 % / < 5 %, 60/60/20 s; measured feedback fails above "
                         "G = 0.6, estimated works to 7",
                         coloured="tau = 1 s: contact error < about 2 m; estimated works to G = 7 (3 at tau = 0.05 s) and to "
                         "2 m/s, measured to 1.2 m/s"),
    "lee_noise": Sweep("Noise factor G, closed loop", "noise factor G [-]", ("G",),
                       white="measured feedback fails above G = 0.6, estimated works to 7",
                       coloured="estimated works to 3 (tau = 0.05 s) and 7 (tau = 1 s)"),
    "lee_gust": Sweep("Turbulence, closed loop", "Dryden intensity sigma [m/s]", ("sigma_mps", "sigma"),
                      coloured="tau = 1 s, G = 1: fails above 1.2 m/s with measured, above 2 m/s with estimated feedback"),
    "lee_mismatch": Sweep("Aerodynamic mismatch", "coefficients off by up to [%]", ("mismatch_pct",), "not studied"),
    "lee_latency": Sweep("Input latency", "delay of the commands [samples]", ("delay_samples", "delay"), "not studied"),
    "lee_adaptive": Sweep("Adaptive process noise", "case", (), "asked for as further work"),
    "lee_rotation": Sweep("Rotational wind on the receiver", "case", (), "not estimated"),
}  # fmt: skip

CASE_LABELS = {name: claim.label for name, claim in TANKER.items()}
