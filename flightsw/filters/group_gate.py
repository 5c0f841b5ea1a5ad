"""Refusal of readings sensor by sensor: groups of rows that stand or fall together, each with a memory of what it has been
refused for.
"""

from __future__ import annotations

from statistics import NormalDist

import numpy as np

from flightsw.filters.gating import BENCH, DECAY
from flightsw.kernels.jit import jit

Array = np.ndarray
ABSENT, AGREES, STRAINED, REFUSED = -1, 0, 1, 2  # what is found of a group; strained: it disagrees and is taken
# columns of a group's row of state: refusals remembered, kept out (0, 1), refusals and readings taken so far, time of the
# last one taken [us], row of its first reading now; factor to the unit of a common disturbance, in that unit excess variance
# of its innovations and what is allowed for it, last innovation; rows now; readings offered so far, taken before the estimate
# last began anew, largest squared ratio of an innovation now to what is allowed
SCORE, HELD, REFUSALS, TAKEN, LAST, FIRST, WEIGHT, EXCESS, ALLOWED, BEFORE, COUNT, OFFERED, BEGAN, RATIO = range(14)
WIDTH = 9  # rows of a group at most; each is a channel of its own
MEAN, SPREAD, FROZEN, NOW, DRIFT, NU = range(6)  # columns of a channel's row of state
SEEN = 0  # column of the last row: samples of the common disturbance so far
HELD_BAD = 0.25  # [-] of a refusal remembered per disagreeing sample of a group kept out
FOLLOW = 0.3  # [-] share of a new sample in a channel's recent mean innovation
SMOOTH = 0.05  # [-] share of a new sample in a channel's mean disagreement
SWELL_SHARE = 0.025  # [-] share of a new sample in the common disturbance: 2 s at 20 Hz
SWELL_FACTOR = 3.0  # [-] on what innovations change by: in rough air successive ones are correlated by a half and more
SWELL_SURE = 0.5  # [-] of a group's own variance: two sigma of its excess, so estimated


@jit
def swell(groups: int, st: np.ndarray, nu: np.ndarray, var: np.ndarray, limit2: float) -> None:
    """st[:,ALLOWED] <- variance allowed to the groups that a common disturbance moves (WEIGHT > 0), from how their innovations
    change beyond their own variance; nu, var [>=m] of the rows st[g,FIRST]; arguments as `sift`.

    A group is allowed what it shows, at most what another may have felt too: a faulty sensor moves alone, and a constant error
    does not show in changes.
    """
    end = st.shape[0] - 1
    for g in range(groups):
        if st[g, WEIGHT] > 0.0 and st[g, FIRST] < 0.0:
            return
    st[end, SEEN] += 1.0
    a = max(SWELL_SHARE, 1.0 / st[end, SEEN])
    first, second, who = -np.inf, -np.inf, -1  # the largest that groups may have felt, and whose it is
    for g in range(groups):
        if st[g, WEIGHT] <= 0.0:
            continue
        i = int(st[g, FIRST])
        w2 = st[g, WEIGHT] * st[g, WEIGHT]
        d = nu[i] - st[g, BEFORE]
        st[g, BEFORE] = nu[i]
        if st[end, SEEN] > 1.0 and np.isfinite(d):
            change = min(0.5 * d * d, limit2 * (var[i] + st[g, ALLOWED] / w2))
            st[g, EXCESS] += a * ((change - var[i]) * w2 - st[g, EXCESS])
        felt = st[g, EXCESS] + SWELL_SURE * var[i] * w2
        if felt > first:
            first, second, who = felt, first, g
        elif felt > second:
            second = felt
    for g in range(groups):
        if st[g, WEIGHT] > 0.0:
            others = second if g == who else first
            st[g, ALLOWED] = SWELL_FACTOR * max(min(st[g, EXCESS], others), 0.0)


@jit
def sift(
    group: np.ndarray, nu: np.ndarray, Sy: np.ndarray, slack: np.ndarray, m: int, t_us: float, limit2: float, watched: int,
    taking: bool, st: np.ndarray, bad: np.ndarray, var: np.ndarray, channel: np.ndarray, keep: np.ndarray,
) -> int:  # fmt: skip
    """keep [>=m] <- positions below m that may correct, bad [groups] <- ABSENT, AGREES, STRAINED or REFUSED; returns how many
    may, or -1 less that number where anything is out of the ordinary.

    group [>=m] of each row, nu [>=m] innovation, Sy [>=m,>=m] lower factor of its covariance, slack [>=m] 1-sigma of what the
    filter was not told of, t_us [us] now, limit2 [-] largest squared ratio, watched: the groups below it are missed when they
    have been silent for a second, taking: nothing is refused for now; st [groups*(1+WIDTH)+1,14] state, in place; var, channel
    [>=m] workspace. A group with refusals remembered is judged by the Sy of before them: ignorance that has grown since does
    not let it back. Innovations are judged about their recent mean: what comes by and by may be the prediction's fault, what
    jumps is the sensor's.
    """
    groups = bad.shape[0]
    for g in range(groups):
        bad[g] = ABSENT
        st[g, FIRST] = -1.0
        st[g, COUNT] = 0.0
    for i in range(m):
        g = group[i]
        c = groups + WIDTH * g + min(int(st[g, COUNT]), WIDTH - 1)
        st[g, COUNT] += 1.0
        channel[i] = c
        v = 0.0
        for b in range(i + 1):
            v += Sy[i, b] * Sy[i, b]
        var[i] = v
        more = slack[i] * slack[i]
        if st[g, WEIGHT] > 0.0:
            more += st[g, ALLOWED] / (st[g, WEIGHT] * st[g, WEIGHT])
        if bad[g] == ABSENT:
            st[g, FIRST] = i
            st[g, OFFERED] += 1.0
            st[g, RATIO] = 0.0
        st[c, NOW] = v + more
        st[c, NU] = nu[i] if np.isfinite(nu[i]) else np.inf
        if st[g, SCORE] > 0.0:
            v = min(v, st[c, FROZEN])
        else:
            st[c, FROZEN] = v
        v += more
        # who is kept out is compared with what was known
        mid = 0.0 if st[g, HELD] > 0.0 else st[c, DRIFT]
        found = AGREES
        if not (nu[i] - mid) * (nu[i] - mid) <= limit2 * v:  # also NaN
            found = REFUSED
        elif nu[i] * nu[i] > limit2 * v:
            found = STRAINED
        bad[g] = max(bad[g], found)
        off = st[c, NU] - mid
        st[g, RATIO] = max(st[g, RATIO], off * off / (limit2 * v) if v > 0.0 else np.inf)
    quiet = True
    for g in range(groups):
        if bad[g] == ABSENT:
            quiet = quiet and (g >= watched or st[g, TAKEN] <= st[g, BEGAN] or t_us - st[g, LAST] <= 1e6)
            continue
        held = st[g, HELD] > 0.0
        s = st[g, SCORE]
        if bad[g] == REFUSED:
            s += HELD_BAD if held else 1.0
            st[g, REFUSALS] += 1.0
            if taking:
                bad[g] = STRAINED
                s = 0.0
        elif bad[g] == AGREES:
            s -= DECAY
        s = min(max(s, 0.0), BENCH)
        st[g, SCORE] = s
        held = s > 0.0 and (held or s >= BENCH)
        st[g, HELD] = 1.0 if held else 0.0
        if bad[g] != REFUSED and not held:
            st[g, TAKEN] += 1.0
            st[g, LAST] = t_us
        quiet = quiet and bad[g] == AGREES and s <= 0.0
    swell(groups, st, nu, var, limit2)
    count = 0
    for i in range(m):
        g, c = group[i], channel[i]
        out = bad[g] == REFUSED or st[g, HELD] > 0.0
        if out or bad[g] == STRAINED:
            # the first disagreement sets the mean, later ones move it; NaN must not stay in it
            if np.isfinite(nu[i]):
                new = st[c, MEAN] == 0.0 and st[c, SPREAD] == 0.0
                d = nu[i] - st[c, MEAN]
                st[c, MEAN] += d if new else SMOOTH * d
                st[c, SPREAD] += SMOOTH * ((0.0 if new else d * d) - st[c, SPREAD])
        elif st[g, SCORE] <= 0.0:
            st[c, MEAN] = 0.0
            st[c, SPREAD] = 0.0
        if not out:
            if np.isfinite(nu[i]):
                st[c, DRIFT] += FOLLOW * (nu[i] - st[c, DRIFT])
            keep[count] = i
            count += 1
    return count if quiet else -1 - count


class GroupGate:
    """Judges the rows of one update, sensor by sensor, by the innovations of the prediction.

    One refused reading is one refused reading, and what drifts away is told and taken (see `sift`). A group refused BENCH times
    within as many seconds as it takes to forget them is kept out: its later readings only bear witness. It comes back by itself
    when they agree for long (100 samples, fewer than one in six against) with a prediction that no longer contains them; how much
    they disagree, and whether by a constant, can be asked; `admit` takes it back on the word of others.
    """

    def __init__(self, groups: int, rows: int, false_alarm: float, watched: int) -> None:
        """Sizes, the probability that a sound reading is refused, and how many groups are missed when they fall silent. Raises
        ValueError for a probability that is not between 0 and 1."""
        if not 0.0 < false_alarm < 1.0:
            raise ValueError(f"false_alarm = {false_alarm}; allowed between 0 and 1")
        # [sigma] two-sided normal: chi-square of one degree of freedom
        self.limit = NormalDist().inv_cdf(1.0 - 0.5 * false_alarm)
        self.watched, self.taking = watched, False
        self._state = np.zeros((groups * (1 + WIDTH) + 1, 14))
        self.bad = np.full(groups, ABSENT, dtype=np.int64)
        self._limit2 = self.limit * self.limit
        self._keep, self._channel = np.zeros(rows, dtype=np.int64), np.zeros(rows, dtype=np.int64)
        self._var = np.zeros(rows)

    def kept(self, group: Array, nu: Array, Sy: Array, slack: Array, m: int, t_us: int) -> tuple[Array | None, bool]:
        """Positions below m that may correct (None: all of them), and whether all is as it should be; arguments as `sift`."""
        n = sift(
            group, nu, Sy, slack, m, float(t_us), self._limit2, self.watched, self.taking, self._state, self.bad, self._var,
            self._channel, self._keep,
        )  # fmt: skip
        return self.told(n, m)

    def told(self, n: int, m: int) -> tuple[Array | None, bool]:
        """As `kept`, where `sift` has returned n for m rows."""
        if n >= 0:
            return None, True
        return (None if -1 - n == m else self._keep[: -1 - n]), False

    def arrays(self) -> tuple[Array, ...]:
        """What `sift` works on: state, what is found of each group, then workspaces var, channel, keep."""
        return self._state, self.bad, self._var, self._channel, self._keep

    @property
    def limit2(self) -> float:
        """Largest squared ratio [-] of an innovation to its variance."""
        return self._limit2

    @property
    def groups(self) -> Array:
        """State of the groups [groups,14]; a view."""
        return self._state[: len(self.bad)]

    def channels(self, group: int) -> Array:
        """State of the channels of a group, as many as it had rows last [k,14]; a view."""
        first = len(self.bad) + WIDTH * group
        return self._state[first : first + min(int(self._state[group, COUNT]) or WIDTH, WIDTH)]

    def share(self, group: int, factor: float) -> None:
        """Let a group take part in the common disturbance (`swell`); factor: from its reading to the common unit."""
        self._state[group, WEIGHT] = factor

    def held(self, group: int) -> bool:
        """Whether a group is kept out."""
        return bool(self._state[group, HELD] > 0.0)

    def offsets(self, group: int) -> Array:
        """Mean disagreement [k] of each channel of a group that is refused now; 0: it agrees."""
        return self.channels(group)[:, MEAN]

    def steady(self, group: int) -> Array:
        """Whether the disagreement [k] of each channel is a constant rather than scatter."""
        c = self.channels(group)
        return np.asarray(c[:, MEAN] ** 2 > 0.25 * c[:, SPREAD])

    def sigmas(self, group: int) -> Array:
        """1-sigma [k] of each channel's last innovation as the filter and its slack have it, however much that has grown."""
        return np.sqrt(self.channels(group)[:, NOW])

    def innovations(self, group: int) -> Array:
        """Last innovation [k] of each channel of a group; infinite: it was no number."""
        return self.channels(group)[:, NU]

    def accepted(self, group: int) -> int:
        """Readings of a group taken since the estimate last began."""
        return int(self._state[group, TAKEN] - self._state[group, BEGAN])

    def disagrees(self, group: int) -> bool:
        """Whether a group kept out still contradicts what was known when it went."""
        return bool(self._state[group, SCORE] > BENCH - 2.0 * HELD_BAD)

    def keep_out(self, group: int) -> None:
        """Keep a group out on the word of others."""
        self._state[group, SCORE], self._state[group, HELD] = BENCH, 1.0

    def admit(self, group: int) -> None:
        """Take a group back."""
        self._state[group, SCORE] = self._state[group, HELD] = 0.0

    def restart(self, t_us: int) -> None:
        """Begin anew at t_us: all are taken back, the counts stay."""
        for column in (SCORE, HELD, EXCESS, ALLOWED, BEFORE):
            self.groups[:, column] = 0.0
        self.groups[:, BEGAN] = self.groups[:, TAKEN]
        self.groups[:, LAST] = t_us
        self._state[len(self.bad) :] = 0.0
