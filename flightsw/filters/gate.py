"""Refusal of readings: an innovation far outside its own sigma is left out, and who keeps doing it is kept out.

ChannelGate judges channel by channel, GroupGate the sensors an estimator is built of: groups of rows that stand or fall
together, each with a memory of what it has been refused for.
"""

from __future__ import annotations

import math
from statistics import NormalDist

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


ABSENT, AGREES, STRAINED, REFUSED = -1, 0, 1, 2  # what is found of a group; strained: it disagrees and is taken
SCORE, HELD, REFUSALS = 0, 1, 2  # columns of a group's row of state
MEAN, SPREAD, FROZEN, NOW, DRIFT = 0, 1, 2, 3, 4  # columns of a channel's row of state
HELD_BAD = 0.25  # [-] of a refusal remembered per disagreeing sample of a group kept out
FOLLOW = 0.3  # [-] share of a new sample in a channel's recent mean innovation
SMOOTH = 0.05  # [-] share of a new sample in a channel's mean disagreement


@jit
def sift(
    group: np.ndarray, codes: np.ndarray, nu: np.ndarray, Sy: np.ndarray, slack: np.ndarray, m: int, limit2: float,
    gs: np.ndarray, cs: np.ndarray, bad: np.ndarray, keep: np.ndarray,
) -> int:  # fmt: skip
    """keep [>=m] <- positions below m that may correct; returns how many. bad [groups] <- ABSENT, AGREES, REFUSED or STRAINED.

    group, codes [>=m] of each row, nu [>=m] innovation, Sy [>=m,>=m] lower factor of its covariance, slack [>=m] 1-sigma of
    what the filter was not told of, limit2 [-] largest squared ratio; gs [groups,3], cs [channels,5] state, in place. A group
    with refusals remembered is judged by the Sy of before them: ignorance that has grown since does not let it back. Innovations
    are judged about their recent mean: what comes by and by may be the prediction's fault, what jumps is the sensor's.
    """
    for g in range(gs.shape[0]):
        bad[g] = ABSENT
    for i in range(m):
        g, c = group[i], codes[i]
        var = 0.0
        for b in range(i + 1):
            var += Sy[i, b] * Sy[i, b]
        more = slack[i] * slack[i]
        cs[c, NOW] = var + more
        if gs[g, SCORE] > 0.0:
            var = min(var, cs[c, FROZEN])
        else:
            cs[c, FROZEN] = var
        var += more
        # about what the innovations have come to by and by; who is kept out is compared with what was known
        mid = 0.0 if gs[g, HELD] > 0.0 else cs[c, DRIFT]
        found = AGREES
        if not (nu[i] - mid) * (nu[i] - mid) <= limit2 * var:  # also NaN
            found = REFUSED
        elif nu[i] * nu[i] > limit2 * var:
            found = STRAINED
        bad[g] = max(bad[g], found)
    for g in range(gs.shape[0]):
        if bad[g] < 0:
            continue
        held = gs[g, HELD] > 0.0
        s = gs[g, SCORE]
        if bad[g] == REFUSED:
            s += HELD_BAD if held else 1.0
            gs[g, REFUSALS] += 1.0
        elif bad[g] == AGREES:
            s -= DECAY
        s = gs[g, SCORE] = min(max(s, 0.0), BENCH)
        gs[g, HELD] = 1.0 if s > 0.0 and (held or s >= BENCH) else 0.0
    count = 0
    for i in range(m):
        g, c = group[i], codes[i]
        out = bad[g] == REFUSED or gs[g, HELD] > 0.0
        if out or bad[g] == STRAINED:
            # the first disagreement sets the mean, later ones move it; NaN must not stay in it
            if np.isfinite(nu[i]):
                new = cs[c, MEAN] == 0.0 and cs[c, SPREAD] == 0.0
                d = nu[i] - cs[c, MEAN]
                cs[c, MEAN] += d if new else SMOOTH * d
                cs[c, SPREAD] += SMOOTH * ((0.0 if new else d * d) - cs[c, SPREAD])
        elif gs[g, SCORE] <= 0.0:
            cs[c, MEAN] = 0.0
            cs[c, SPREAD] = 0.0
        if not out:
            cs[c, DRIFT] += FOLLOW * (nu[i] - cs[c, DRIFT])
            keep[count] = i
            count += 1
    return count


class GroupGate:
    """Judges the rows of one update, sensor by sensor, by the innovations of the prediction.

    One refused reading is one refused reading, and what drifts away is told and taken (see `sift`). A group refused BENCH times within as many seconds as it takes to forget them is
    kept out: its later readings only bear witness. It comes back by itself when they agree for long (100 samples, fewer than one
    in six against) with a prediction that no longer contains them; how much they disagree, and whether by a constant, can be
    asked; `admit` takes it back on the word of others.
    """

    def __init__(self, groups: int, channels: int, rows: int, false_alarm: float) -> None:
        """Sizes, and the probability that a sound reading is refused. Raises ValueError when it is not between 0 and 1."""
        if not 0.0 < false_alarm < 1.0:
            raise ValueError(f"false_alarm = {false_alarm}; allowed between 0 and 1")
        self.limit = NormalDist().inv_cdf(
            1.0 - 0.5 * false_alarm
        )  # [sigma] two-sided: chi-square of one degree of freedom
        self.groups, self.channels = np.zeros((groups, 3)), np.zeros((channels, 5))
        self.bad = np.zeros(groups, dtype=np.int64)
        self._keep = np.zeros(rows, dtype=np.int64)

    def kept(self, group: Array, codes: Array, nu: Array, Sy: Array, slack: Array, m: int) -> Array:
        """Positions below m that may correct; arguments as `sift`."""
        limit2 = self.limit * self.limit
        count = sift(group, codes, nu, Sy, slack, m, limit2, self.groups, self.channels, self.bad, self._keep)
        return self._keep[:count]

    def held(self, group: int) -> bool:
        """Whether a group is kept out."""
        return bool(self.groups[group, HELD] > 0.0)

    def refused(self, group: int) -> int:
        """Readings of a group that disagreed, so far."""
        return int(self.groups[group, REFUSALS])

    def offset(self, code: int) -> tuple[float, bool]:
        """Mean disagreement of a channel refused now, and whether it is a constant rather than scatter."""
        mean, spread = float(self.channels[code, MEAN]), float(self.channels[code, SPREAD])
        return mean, mean * mean > 0.25 * spread

    def sigma(self, code: int) -> float:
        """1-sigma of a channel's last innovation as the filter and its slack have it, however much that has grown."""
        return math.sqrt(float(self.channels[code, NOW]))

    def disagrees(self, group: int) -> bool:
        """Whether a group kept out still contradicts what was known when it went."""
        return bool(self.groups[group, SCORE] > BENCH - 2.0 * HELD_BAD)

    def admit(self, group: int) -> None:
        """Take a group back."""
        self.groups[group, SCORE] = self.groups[group, HELD] = 0.0

    def forgive(self) -> None:
        """Take all back, the counts stay."""
        self.groups[:, SCORE : HELD + 1] = 0.0
        self.channels[:] = 0.0
