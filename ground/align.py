"""Truth at the times of estimates. Where a row has the very stamp it is taken as it is (lockstep: always); else (real time: most)
it is interpolated between the two rows around, if they are near. Nothing is extrapolated.

Over `GAP_US` a straight line misses a path of 10 m/s^2 by at most a T^2 / 8 = 1.3 cm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ground.columns import Table

GAP_US = 100_000  # [us] truth is interpolated over this much
SAMPLE_US = 1_000_000  # [us] a sample stands for at most this long
ANGLES = {"alpha", "beta", "boom_elevation", "boom_azimuth", "psi", "theta", "phi"}  # [rad] may jump by 2 pi
QUATERNIONS = {"q_nb"}


@dataclass(frozen=True)
class Aligned:
    """Which rows of a source belong to times of another log: row `at` of those times lies `share` (0..1) of the way from source
    row `left` to the next. `left_out`: times without a source row near enough, and repeated ones."""

    at: NDArray[np.intp]
    left: NDArray[np.intp]
    share: NDArray[np.float64]
    left_out: int

    def __len__(self) -> int:
        return len(self.at)

    def _between(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
        some = np.flatnonzero(self.share)
        return some, self.left[some], self.share[some]

    def of(self, values: NDArray, angle: bool = False) -> NDArray:
        """Source values (N, ...) at the times, same dtype; linear between rows, an `angle` [rad] the short way round."""
        out = values[self.left]
        some, left, share = self._between()
        if len(some):
            a = values[left].astype(np.float64)
            step = values[left + 1].astype(np.float64) - a
            if angle:
                step = (step + np.pi) % (2.0 * np.pi) - np.pi
            out[some] = a + step * share.reshape(-1, *[1] * (values.ndim - 1))
        return out

    def quaternions(self, q: NDArray) -> NDArray:
        """Unit quaternions (N,4) at the times: the chord between neighbours, normalised; q and -q are one rotation."""
        out = q[self.left]
        some, left, share = self._between()
        if len(some):
            a, b = q[left], q[left + 1]
            b = np.where((a * b).sum(axis=1, keepdims=True) < 0.0, -b, b)
            mix = a + (b - a) * share[:, None]
            out[some] = mix / np.linalg.norm(mix, axis=1, keepdims=True)
        return out

    def table(self, source: Table) -> Table:
        """Rows of the source at the times. Whole numbers (flags, counters) are those of the row before."""
        out = Table(source.t_us[self.left].copy(), source.link[self.left], source.rows[self.left])
        some, left, share = self._between()
        if not len(some):
            return out
        for name in source.rows.dtype.names or ():
            values = source.rows[name]
            if name in QUATERNIONS:
                out.rows[name] = self.quaternions(values)
            elif values.dtype.kind == "f":
                out.rows[name] = self.of(values, name in ANGLES)
        out.t_us[some] += np.rint((source.t_us[left + 1] - source.t_us[left]) * share).astype(np.int64)
        if "time_usec" in (source.rows.dtype.names or ()):
            out.rows["time_usec"][some] = out.t_us[some]
        return out


def align(source_us: NDArray[np.int64], t_us: NDArray[np.int64], gap_us: int = GAP_US) -> Aligned:
    """Where times `t_us` [us] lie among `source_us` [us] (both ascending). A time between two rows further apart than `gap_us`,
    before the first or after the last is left out; of equal times the first is kept."""
    _, first = np.unique(t_us, return_index=True)
    source, keep = np.unique(source_us, return_index=True)
    t = t_us[first]
    i = np.searchsorted(source, t, side="right") - 1
    known = i >= 0
    left = np.maximum(i, 0)
    right = np.minimum(left + 1, len(source) - 1)
    if not len(source):
        empty = np.empty(0, dtype=np.intp)
        return Aligned(empty, empty, np.empty(0), len(t_us))
    span = source[right] - source[left]
    past = t - source[left]
    # neighbours in the file too: with repeated or disordered rows between them, they are none
    near = (past == 0) | ((past < span) & (span <= gap_us) & (keep[right] == keep[left] + 1))
    use = known & near
    share = np.where(past == 0, 0.0, past / np.maximum(span, 1))[use]
    return Aligned(first[use], keep[left[use]], share, len(t_us) - int(use.sum()))


def seconds(t_us: NDArray[np.int64], mask: NDArray[np.bool_]) -> float:
    """How long [s] the samples marked stand: each until the next one, at most `SAMPLE_US`, the last for the usual step."""
    if len(t_us) < 2:
        return 0.0
    step = np.diff(t_us)
    usual = float(np.median(step))
    stands = np.append(np.minimum(step, max(SAMPLE_US, usual)), usual)
    return float(stands[mask].sum() / usual * (usual * 1e-6)) if usual > 0.0 else 0.0
