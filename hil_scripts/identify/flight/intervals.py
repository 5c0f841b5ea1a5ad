"""Honest intervals: covariance under coloured residuals, and which coefficients, or combinations of them, a flight tells
(docs/sources/identification.md 4 and 5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_scripts.identify.flight.model import COEFFICIENTS, NC, FlightModel
from hil_scripts.identify.flight.output_error import Fit, information, inverse

Arr = NDArray[np.float64]
LAGS = 0.2  # [-] of the samples: longest lag of the residuals' correlation
WIDTH = 1.959964  # of a 95 % interval
SHARE = 0.25  # [-] of its size: a coefficient whose 95 % interval reaches further to each side is not identified
AMONG = 0.05  # [-] of its size: what the interval of one held must move another by for the two to be named together


def autocovariance(r: Arr, lags: int) -> Arr:
    """Of residuals r [m] about 0 at lags 0..lags, divided by m: [lags + 1]."""
    n = 1 << (2 * len(r) - 1).bit_length()
    F = np.fft.rfft(r, n)
    return np.asarray(np.fft.irfft(F * F.conj(), n)[: lags + 1] / len(r))


def taper(lags: int) -> Arr:
    """Parzen's window at lags 0..lags: positive at every frequency."""
    x = np.arange(lags + 1) / max(lags, 1)
    return np.where(x <= 0.5, 1.0 - 6.0 * x * x * (1.0 - x), 2.0 * (1.0 - x) ** 3)


def correlated(S: Arr, c: Arr) -> Arr:
    """S^T T S [k,k] (identification.md 4) with the Toeplitz matrix T of autocovariances c (0 beyond its last lag); S [m,k]."""
    m = len(S)
    n = 1 << (2 * m - 1).bit_length()
    c = c[:m]
    row = np.zeros(n)
    row[: len(c)] = c
    if len(c) > 1:
        row[n - len(c) + 1 :] = c[:0:-1]
    TS = np.fft.irfft(np.fft.rfft(row)[:, None] * np.fft.rfft(S, n, axis=0), n, axis=0)[:m]
    return np.asarray(S.T @ TS)


def covariance(m: FlightModel, f: Fit) -> tuple[Arr, Arr]:
    """Of the coefficients [26,26]: with white residuals, and with residuals as they are correlated in time."""
    C = inverse(information(m, f.slopes, f.sigma))[:, :NC]
    coloured = C.T @ m.known @ C
    for r, S, s in zip(f.residuals, f.slopes, f.sigma, strict=True):
        lags = int(LAGS * len(r))
        coloured += correlated(S @ C, autocovariance(r, lags) * taper(lags)) / s**4
    return C[:NC].copy(), coloured


@dataclass(frozen=True)
class Told:
    """What a flight tells: a coefficient, or a combination: weights [26] on the coefficients, its value, 1 sigma, and whether it
    is identified. `name`: the coefficient, with what else it is a combination of."""

    name: str
    weights: Arr
    value: float
    sigma: float
    identified: bool

    @property
    def half(self) -> float:
        """Of the 95 % interval."""
        return WIDTH * self.sigma

    def holds(self, truth: Arr) -> bool:
        """Whether the 95 % interval holds the value of coefficients truth [26]."""
        return bool(abs(float(self.weights @ truth) - self.value) <= self.half)


@dataclass(frozen=True)
class Verdict:
    """Of a flight: what it tells, one for each coefficient in their order; those that are held at the file's value as the flight
    does not tell them; all coefficients [26] with these held."""

    told: tuple[Told, ...]
    held: tuple[str, ...]
    written: Arr

    @property
    def identified(self) -> tuple[Told, ...]:
        """What is."""
        return tuple(t for t in self.told if t.identified)


def verdict(x: Arr, like: Arr, white: Arr, coloured: Arr, share: float = SHARE) -> Verdict:
    """Coefficients x [26] as fitted, those of the file it began from, covariances [26,26] with white and with coloured residuals.

    The coefficient with the widest interval for its size is held at the file's value (identification.md 5), and what is left
    looked at again, until each interval is within `share` of its size. One that only then is told is so together with what is
    held: a combination.
    """

    def sigma(w: Arr) -> float:
        return float(np.sqrt(max(w @ white @ w, w @ coloured @ w)))

    alone = np.array([sigma(w) for w in np.eye(NC)])
    # of one that may as well be nothing: the file's, if it has one
    size = np.where((np.abs(x) > WIDTH * alone) | (like == 0.0), np.abs(x), np.abs(like))
    size[size == 0.0] = np.finfo(float).tiny
    held: list[int] = []
    while True:
        rest = [i for i in range(NC) if i not in held]
        K = np.zeros((NC, NC))  # of each of the rest on those held
        if held:
            K[np.ix_(rest, held)] = np.linalg.solve(white[np.ix_(held, held)], white[np.ix_(held, rest)]).T
        rows = np.eye(NC) - K
        wide = {i: WIDTH * sigma(rows[i]) / size[i] for i in rest}
        worst = max(wide, key=lambda i: wide[i])
        if wide[worst] <= share:
            break
        held.append(worst)
        if len(held) == NC:
            break
    written = like.copy()
    for i in rest:
        written[i] = x[i] + K[i] @ (like - x)
    told = []
    for i, name in enumerate(COEFFICIENTS):
        w = np.eye(NC)[i]
        if i not in held and WIDTH * alone[i] > share * size[i]:
            w = np.where((np.abs(rows[i]) * WIDTH * alone > AMONG * size[i]) | (w > 0.0), rows[i], 0.0)
            if WIDTH * sigma(w) > share * size[i]:  # many little ones: all of them
                w = rows[i]
        told.append(Told(_named(name, w), w, float(w @ x), sigma(w), i not in held))
    return Verdict(tuple(told), tuple(COEFFICIENTS[i] for i in held), written)


def _named(name: str, w: Arr) -> str:
    """`CL_q + 0.95 CL_alphadot`."""
    parts = [
        f"{'+' if v > 0 else '-'} {abs(v):.2g} {k}" for k, v in zip(COEFFICIENTS, w, strict=True) if v and k != name
    ]
    return " ".join([name, *parts])
