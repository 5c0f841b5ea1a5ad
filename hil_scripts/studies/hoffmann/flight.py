"""Flights of the small UAV for the gust studies: the plant, several estimators on the same readings, and their figures."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.design import kalman_bucy
from flightsw.missions.gust.estimate import BASIC, GROUND, VERTICAL, GustParams
from flightsw.missions.gust.estimator import GustNav
from flightsw.missions.gust.estimator_printed import ConstantGainGust
from flightsw.missions.gust.model import ProcessNoise, linear_model, published
from flightsw.missions.gust.printed import E_VK_ALPHAW_PRINTED, THETA, XI_PRINTED
from sim_plant.aircraft.alexis.flight import Alexis, AlexisParams, AlexisSensors
from sim_plant.rng import generator
from sim_plant.wind.planar import PlanarWind

Arr = NDArray[np.float64]
DT = 0.02
DROP_S = 2.0
DEG = math.pi / 180.0
LIGHT = 0.3  # working turbulence relative to the source's
WINDOW = 512  # samples of a spectral window, as in the reference figures


def wind(scale: float, **more: Any) -> PlanarWind:
    """Dryden turbulence of `scale` times the source's intensity."""
    return PlanarWind(3.5 * scale, 5.0 * scale, **more)


def blocks(t: float) -> float:
    """Elevator [rad] of case 1 at time t [s]: +-1 degree for a second each, from 4, 8, 16 and 20 s."""
    for i, start in enumerate((4.0, 8.0, 16.0, 20.0)):
        if start <= t < start + 1.0 - 1e-9:
            return DEG if i % 2 == 0 else -DEG
    return 0.0


@dataclass(frozen=True)
class FlightPlan:
    """What is flown: plant, air, length, elevator over time (surfaces follow at once) and how the start is drawn."""

    duration_s: float
    air: PlanarWind
    plant: AlexisParams = field(default_factory=lambda: AlexisParams(linear=True, direct=True))
    elevator: Callable[[float], float] | None = None
    start_sigma: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)  # q, alpha_K, V_K, Theta, H


@dataclass(frozen=True)
class Readings:
    """A flight on record at DT: truth [N,9], readings [N,7], fresh channels [N], controls [N,3] since the last."""

    truth: Arr
    y: Arr
    fresh: NDArray[np.int64]
    u: Arr

    @property
    def t(self) -> NDArray[Any]:
        """Times [N] s."""
        return np.arange(len(self.truth)) * DT


def fly(plan: FlightPlan, seed: int) -> Readings:
    """Fly `plan` with the randomness of `seed`."""
    seed %= 2**31
    a = Alexis(plan.plant, plan.air, seed, plan.duration_s, DT)
    if any(plan.start_sigma):
        a.place(*(generator(seed, "hoffmann.start").standard_normal(5) * np.array(plan.start_sigma)).tolist())
    n = a.samples
    out = Readings(np.zeros((n, 9)), np.zeros((n, 7)), np.zeros(n, dtype=np.int64), np.zeros((n, 3)))
    u = np.zeros(3)
    for i in range(n):
        if i:
            u[0] = plan.elevator((i - 1) * DT) if plan.elevator else 0.0
            a.step(u)
        out.truth[i], out.y[i], out.fresh[i], out.u[i] = a.truth, a.reading, a.fresh, u
    return out


@dataclass
class Track:
    """What an estimator made of a flight: x [N,9], sigma [N,9], NIS and NEES [N] (NaN without covariance), scale [N]."""

    x: Arr
    sigma: Arr
    nis: Arr
    nees: Arr
    scale: Arr


def estimate(
    est: GustNav | ConstantGainGust, r: Readings, channels: int = BASIC, known_start: bool = False, nees: bool = False
) -> Track:
    """Run `est` over the flight `r` with the readings of `channels`; known_start: it knows the aircraft's states at the
    start, not the wind's."""
    n = len(r.y)
    out = Track(np.zeros((n, 9)), np.full((n, 9), np.nan), *(np.full(n, np.nan) for _ in range(3)))
    if known_start:
        x0 = r.truth[0].copy()
        x0[[k.X1, k.AW, k.VW, k.AB]] = 0.0
        if isinstance(est, GustNav):
            P = np.diag([0.0, 0.0, 0.0, 1e-8, 1e-8, 1e-6, 1e-8, 1e-6, (0.1 * DEG) ** 2])
            P[:3, :3] = est.stationary(max(est.p.scales))
            est.start(x0, P)
        else:
            est.start(x0)
        out.x[0] = x0
    for i in range(1 if known_start else 0, n):
        ok = channels & int(r.fresh[i])
        e = est.step(r.y[i], ok, r.u[i], DT)
        out.x[i] = est.x
        if isinstance(est, GustNav) and not isinstance(e, np.ndarray):
            out.sigma[i], out.nis[i], out.scale[i] = e.sigma, e.nis / max(e.channels, 1), e.scale
            if nees:
                d = out.x[i] - r.truth[i]
                out.nees[i] = float(d @ np.linalg.solve(est.P, d)) / 9.0
    return out


def errors(r: Readings, x: Arr, after_s: float = DROP_S) -> dict[str, float]:
    """RMS and mean error of alpha_W [deg], V_W [m/s] and, after 25 s if there is so much, the bias [deg]."""
    d = x - r.truth
    m = r.t >= after_s
    late = r.t >= 25.0 if r.t[-1] > 26.0 else m
    out = {}
    for name, unit, column, factor, mask in (
        ("alpha_w", "deg", k.AW, 1 / DEG, m),
        ("v_w", "mps", k.VW, 1.0, m),
        ("bias", "deg", k.AB, 1 / DEG, late),
    ):
        e = d[mask, column] * factor
        out[f"{name}.rms_{unit}"] = float(np.sqrt(np.mean(e * e)))
        out[f"{name}.mean_{unit}"] = float(np.mean(e))
        out[f"{name}.std_{unit}"] = float(np.std(e))
    return out


def spectra(r: Readings, x: Arr, column: int, at_hz: tuple[float, ...], after_s: float = DROP_S) -> dict[str, float]:
    """Spectra of truth (tt), estimate (ee) and of both (te, real and imaginary) [unit^2/Hz] at at_hz, the first after_s [s] left
    out. Welch, Hann windows of 512 samples, half overlapping; straight between the bins. For `transfer`, once pooled."""
    from scipy import signal  # slow to import: not for every list of studies

    m = r.t >= after_s
    a, b = r.truth[m, column], x[m, column]
    f, tt = signal.welch(a, 1 / DT, nperseg=WINDOW)
    _, ee = signal.welch(b, 1 / DT, nperseg=WINDOW)
    _, te = signal.csd(a, b, 1 / DT, nperseg=WINDOW)
    parts = {"tt": tt, "ee": ee, "te_re": te.real, "te_im": te.imag}
    return {f"{name}_{hz_key(hz)}": float(np.interp(hz, f, v)) for hz in at_hz for name, v in parts.items()}


def hz_key(hz: float) -> str:
    """A frequency as it stands in a key."""
    return f"{hz:g}hz".replace(".", "p")


def transfer(tt: float, ee: float, te_re: float, te_im: float) -> tuple[float, float, float]:
    """Amplitude ratio [-] (root of the ratio of the powers), phase [deg] and coherence [-] of estimate against truth from spectra
    averaged over flights; NaN without power. The coherence of one flight alone is about one over its windows where there is none.
    """
    if not tt * ee > 0.0:
        return math.nan, math.nan, math.nan
    cross = te_re * te_re + te_im * te_im
    return math.sqrt(ee / tt), math.degrees(math.atan2(te_im, te_re)), cross / (tt * ee)


def continuous(name: str) -> ConstantGainGust:
    """Constant-gain filters of the comparison: printed, printed_joined (readings joined by straight lines), xi_printed,
    xi_printed_e (also its E sign), bucy_unscaled, bucy."""
    if name.startswith("printed"):
        return ConstantGainGust(join=name == "printed_joined")
    E = np.array(published().E)
    if name == "xi_printed_e":
        E[2, 0] = E_VK_ALPHAW_PRINTED
    model = linear_model(E=E)
    Xi, Theta = XI_PRINTED, THETA
    if name.startswith("bucy"):
        Xi = model.Br @ model.Br.T + ProcessNoise(bias=0.05 * DEG).intensity()
        Theta = THETA * (1.0 if name == "bucy_unscaled" else DT)
    return ConstantGainGust(kalman_bucy(model.A, model.C[:5], Xi, Theta)[0], model)


def discrete(scale: float = 1.0, **more: Any) -> GustNav:
    """Linear discrete filter tuned to turbulence of relative intensity `scale`."""
    return GustNav(GustParams(filter="kalman", model="linear", scales=(scale,), **more))


def nonlinear(kind: str = "ekf", scales: tuple[float, ...] = (LIGHT,), **more: Any) -> GustNav:
    """Filter on the nonlinear model; several `scales` make a bank."""
    return GustNav(GustParams(filter=kind, scales=scales, **more))


SENSORS = {"basic": BASIC, "ground": BASIC | GROUND, "vertical": BASIC | VERTICAL, "all": BASIC | GROUND | VERTICAL}
MATCHED = ProcessNoise()
PLANT_NOISE = (MATCHED.q, MATCHED.alpha_K, MATCHED.V_K, MATCHED.Theta, MATCHED.H)
BIAS_STEP = AlexisSensors(bias_deg=1.0, bias_at_s=12.0)
