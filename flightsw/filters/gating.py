"""Refusal of readings: an innovation far outside its own sigma is left out, and who keeps doing it is kept out.

Channel by channel; the sensors an estimator is built of, groups of rows that stand or fall together: group_gate.py.
"""

from __future__ import annotations

import numpy as np

from flightsw.kernels.jit import jit

Array = np.ndarray
CAP = 10.0  # [-] refusals remembered at most
BENCH = 5.0  # [-] refusals remembered from which a channel stays out
DECAY = 0.05  # [-] of a refusal forgotten per agreeing sample


@jit
def judge(
    codes: np.ndarray, nu: np.ndarray, Sy: np.ndarray, m: int, limit: float, most: int, score: np.ndarray, keep: np.ndarray
) -> int:  # fmt: skip
    """keep [>=m] <- positions below m that may correct; returns how many, -1: more than `most` disagree or are benched, none may.

    codes [>=m] channel of each reading, nu [>=m] innovation, Sy [>=m,>=m] lower factor of its covariance, limit [sigma],
    score [channels] refusals remembered, negative for a channel that is benched.
    """
    out = 0
    for i in range(m):
        var = 0.0
        for b in range(i + 1):
            var += Sy[i, b] * Sy[i, b]
        keep[i] = 1 if nu[i] * nu[i] <= limit * limit * var else 0  # 0 also for NaN
        out += 1 if keep[i] == 0 or score[codes[i]] < 0.0 else 0
    if out > most:
        return -1
    count = 0
    for i in range(m):
        c = codes[i]
        benched = score[c] < 0.0
        good = keep[i] == 1
        s = max(abs(score[c]) - DECAY, 0.0) if good else min(abs(score[c]) + 1.0, CAP)
        benched = s > 0.0 and (benched or s >= BENCH)
        score[c] = -s if benched else s
        if good and not benched:
            keep[count] = i
            count += 1
    return count


class ChannelGate:
    """Judges the readings of one sample by the innovations of the prediction; their order plays no part.

    A channel that is refused again and again stays out, also while it agrees by chance (garbage does now and then), until it
    has agreed long enough to be forgiven. When more than `most` channels are out at once it is the filter that is in doubt and
    not the sensors: all are refused, and the owner counts.
    """

    def __init__(self, channels: int, limit: float, most: int) -> None:
        """channels in all, limit [sigma] of one innovation, most channels refused at once. Raises ValueError when a number is
        not positive."""
        if channels < 1 or not limit > 0.0 or most < 1:
            raise ValueError(f"channels = {channels}, limit = {limit}, most = {most}; allowed > 0")
        self.limit, self.most = limit, most
        self.score = np.zeros(channels)
        self._keep = np.zeros(channels, dtype=np.int64)

    @property
    def benched(self) -> list[int]:
        """Channels that stay out."""
        return np.flatnonzero(self.score < 0.0).tolist()

    def reset(self) -> None:
        """Forgive all."""
        self.score[:] = 0.0

    def kept(self, codes: Array, nu: Array, Sy: Array, m: int) -> Array | None:
        """Positions below m that may correct, None when none may because too many disagree; arguments as `judge`."""
        count = judge(codes, nu, Sy, m, self.limit, self.most, self.score, self._keep)
        return None if count < 0 else self._keep[:count]
