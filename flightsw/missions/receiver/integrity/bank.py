"""Solution separation over the sources of relative position: what each of them, left out, makes of the rest.

Filter 0 takes everything. One *standing* filter a source has never heard it: what 0 and it are apart, and its own sigma, bound
the error if that source is wrong, however slowly it went wrong. *Forks* are copies of filter 0 that distrust one source from a
moment on, begun anew by turns: they find what began a short while ago, and their likelihood tells whose fault it is, which
separation does not (it blames the best sensor). Sources: separation.md 3 to 6.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flightsw.missions.receiver.integrity import judge_kernel, kernel, way_kernel
from flightsw.missions.receiver.integrity.believed import Believed
from flightsw.missions.receiver.integrity.layout import (
    B_G,
    B_RS,
    FW,
    NB,
    NB_WAKE,
    OB,
    OW,
    OWN,
    POSITION,
    RATE,
    RC,
    ROWS,
    SLOW,
    SOURCES,
    WAKE,
    D,
    U,
)  # fmt: skip
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.integrity.verdict import Verdict
from flightsw.missions.receiver.integrity.waiting import Reading
from flightsw.types import ZERO3, Vec3

JUMP = (1.5, 1.5, 0.5, 1.5)  # [m] a source may have stepped by when a short fork begins, and
WALK = ((0.3, 0.12), (0.3, 0.12), (0.1, 0.04), (0.3, 0.12))  # [m/sqrt(s)] may walk by, in short and long forks
RATE_WALK = 0.1  # [m/s/sqrt(s)] and its rate
START_V = 1.0  # [m/s] of the first estimate


class Bank:
    """The filters: 0 all, 1.. one standing a source, then forks [length of time, slot, source]."""

    def __init__(self, p: IntegrityParams, boom: tuple[float, float], wake: bool = False) -> None:
        """boom: its length [m] and elevation [rad] in contact; wake: the wake position is a source."""
        self.p = p
        self.sources, self.n = (SOURCES, NB_WAKE) if wake else (WAKE, NB)
        lengths, slots = len(p.fork_s), 2
        self.size = 1 + self.sources * (1 + lengths * slots)
        self.X, self._wide = np.zeros((self.size, self.n)), np.zeros((self.size, self.n, kernel.width(self.n)))
        self.L = np.zeros(self.size)
        self._by_wake = np.zeros(self.size)  # what of L the wake position's readings make
        self._before = np.zeros(self.size)  # L before a reading
        self.left_out = np.zeros(self.size, dtype=np.int64)
        self.slots = [(k, s) for k in range(lengths) for s in range(slots)]
        self.born_us, self.born_L = np.zeros(len(self.slots), dtype=np.int64), np.zeros(len(self.slots))
        self._lives_s = np.array([2.0 * p.fork_s[k] for k, _ in self.slots])
        self.t_us = -1
        self._run = np.zeros(self.size, dtype=np.int64)  # steps a separation has been beyond k_alarm
        # of every filter, from filter 0: the largest distance over its sigma, distances [m]; sigma [m]
        self._z, self._off, self._own = np.zeros(self.size), np.zeros((self.size, 3)), np.zeros((self.size, 3))
        self.believed = Believed(p, boom, self.n)
        self._decay, self._q = np.zeros(kernel.width(self.n)), np.zeros((self.size, self.n))
        self._dt = -1.0
        self.z = np.zeros(ROWS)  # [-] innovations of the reading last looked at, in their sigmas
        self._moved = np.zeros((ROWS, self.n)), np.zeros(ROWS), np.zeros(ROWS)  # its rows at another time
        self._par = np.array([float(getattr(p, k)) for k in judge_kernel.PARAMS])
        self._said = np.zeros(judge_kernel.OUT)
        self.place = np.zeros((3, self.n))  # of the state: the position in tanker axes
        self._xi: Vec3 = ZERO3
        self._grown = 0.0  # [m^2]

    @property
    def P(self) -> np.ndarray:
        """Covariances [size,n,n]: the columns of the kernels' that are states."""
        return self._wide[:, :, : self.n]

    def start(self, t_us: int, d: np.ndarray, u: np.ndarray, xi: Vec3, excluded: int = 0) -> None:
        """Begin anew at d [3] m, u [3] m/s NED, in tanker axes xi [m], without the sources `excluded` (mask)."""
        self.t_us = t_us
        p0 = np.zeros((self.n, self.n))
        var = self.believed.var.copy()
        var[D], var[U] = 1e4, START_V**2
        x0 = np.zeros(self.n)
        x0[D], x0[U] = d, u
        self._xi = xi
        var[RC] = self.believed.fixed(self._xi)
        var[OB] = self.believed.boom
        p0[np.arange(self.n), np.arange(self.n)] = var
        self.X[:], self.P[:] = x0, p0
        self.L[:] = 0.0
        self.left_out[:] = excluded
        self._run[:] = 0
        for k in range(self.sources):
            self.left_out[1 + k] |= 1 << k
        self._fork_all()

    def exercise(self) -> None:
        """What is asked of it at a step, once; the bank is to be started then."""
        self.surprise(
            Reading(WAKE, self.t_us, np.zeros((ROWS, self.n)), np.zeros(ROWS), np.ones(ROWS), ROWS),
            np.zeros((1, way_kernel.PATH)), 1, 0.1,
        )  # fmt: skip
        self.judge(3, 3)
        self.sigma  # noqa: B018 - worked out when asked for

    def unlatched(self) -> None:
        """The boom has let go: what was learnt of its error holds no more."""
        self._forget(OB)

    def wake_anew(self, lasting: np.ndarray) -> None:
        """The wake position goes by other rows, of which the lasting error has the variances [2] m^2: nothing is known of it."""
        self.believed.wake(lasting)
        self._forget(OW)
        self._forget(FW)

    def _forget(self, own: slice) -> None:
        """Errors begin anew in every filter."""
        self.X[:, own] = 0.0
        self.P[:, own, :] = 0.0
        self.P[:, :, own] = 0.0
        for i in range(own.start, own.stop):
            self.P[:, i, i] = self.believed.at(i, self._xi)

    def _members(self, slot: int) -> range:
        first = 1 + self.sources * (1 + slot)
        return range(first, first + self.sources)

    def _fork_all(self) -> None:
        """All slots anew, the second of each length when the first is half through."""
        for slot, (k, s) in enumerate(self.slots):
            self._fork(slot, self.t_us - (1 - s) * round(self.p.fork_s[k] * 1e6))

    def _fork(self, slot: int, t_us: int) -> None:
        """Begin a slot's forks as copies of filter 0 that distrust one source each."""
        self.born_us[slot], self.born_L[slot] = t_us, self.L[0]
        long = self.slots[slot][0] > 0
        for k, m in enumerate(self._members(slot)):
            self.X[m], self.P[m], self.L[m], self._run[m] = self.X[0], self.P[0], 0.0, 0
            self._by_wake[m] = 0.0
            self.left_out[m] = self.left_out[0]
            if not long:
                for i in range(POSITION[k].start, POSITION[k].stop):
                    self.P[m, i, i] += JUMP[k] ** 2

    def _prepare(self, dt: float) -> None:
        if dt == self._dt:
            return
        self._dt = dt
        self._q[:] = 0.0
        for i in range(self.n):
            finite = math.isfinite(self.believed.tau[i])
            self._decay[i] = math.exp(-dt / self.believed.tau[i]) if finite else 1.0
            if finite:
                self._q[:, i] = -self.believed.var[i] * math.expm1(-2.0 * dt / self.believed.tau[i])
        self._q[:, OB] = self.p.boom_walk**2 * dt
        self._q[:, OW] = self.p.wake_walk**2 * dt
        for slot, (length, _) in enumerate(self.slots):
            for k, m in enumerate(self._members(slot)):
                self._q[m, POSITION[k]] += WALK[k][min(length, 1)] ** 2 * dt
                self._q[m, RATE[k]] += RATE_WALK**2 * dt

    def predict(self, t_us: int, acc: Vec3, density: float) -> None:
        """Carry everything to t_us with the acceleration acc [3] m/s^2 NED of the way since the last, known to `density` [m/s^2
        per sqrt(Hz)]; a slot whose time is over begins anew."""
        dt = (t_us - self.t_us) * 1e-6
        self.t_us = t_us
        if dt <= 0.0:
            return
        self._prepare(dt)
        kernel.predict(self.X, self._wide, self._decay, self._q, np.array(acc), density * density, dt)
        for slot in range(len(self.slots)):
            if (t_us - self.born_us[slot]) * 1e-6 >= self._lives_s[slot]:
                self._fork(slot, t_us)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """As `horizon_kernel.advanced` takes them: states, covariances, log-likelihoods, masks of what is left out, what of the
        likelihoods the wake position makes, workspace; the step that is prepared, its decay and noise; when forks began, how
        long they live; innovations."""
        return (
            self.X, self._wide, self.L, self.left_out, self._by_wake, self._before, self._dt, self._decay, self._q, self.born_us,
            self._lives_s, self.z,
        )  # fmt: skip

    @property
    def judging(self) -> tuple[np.ndarray, ...]:
        """As `kernel.surprise` takes them: states, covariances; workspace; innovations."""
        return self.X, self._wide, *self._moved, self.z

    def surprise(self, rows: Reading, path: np.ndarray, steps: int, density: float) -> float:
        """Largest innovation, in its sigmas, of rows of later than the bank against filter 0 carried on: by the `steps` rows of
        path [>=steps,7] (`way_kernel.build`), known to density [m/s^2 per sqrt(Hz)]."""
        return float(
            kernel.surprise(
                self.X, self._wide, rows.H, rows.y, rows.r, rows.count, rows.t_us, self.t_us, path, steps, density * density,
                *self._moved, self.z,
            )
        )  # fmt: skip

    def stand(self, t_us: int, xi: Vec3, density: float) -> None:
        """Let what is said below be of t_us, where filter 0 is at xi [m] and `place` is filled (`horizon_kernel.expected`); the
        way there is known to `density` [m/s^2 per sqrt(Hz)]."""
        lead = max((t_us - self.t_us) * 1e-6, 0.0)
        self._grown, self._xi = density * density * lead**3 / 3.0, xi

    def judge(self, live: int, heard: int) -> Verdict:
        """Protection level, tests and likelihoods with the sources `live`, of those `heard` since the start (excluded ones are in
        neither): what filter 0 knows by one that is silent now is wrong if that was."""
        judge_kernel.judged(
            self.X, self._wide, self.place, self._grown, self.L, self.born_L, self.sources, live, heard, self._par, self._z,
            self._off, self._own, self._run, self._said,
        )  # fmt: skip
        x, y, z, rel, gnss, boom, wake, *scores, disagree, blamed, slot = self._said.tolist()
        return Verdict((x, y, z), (rel, gnss, boom, wake), disagree > 0.0, int(blamed), int(slot), scores)

    def exclude(self, source: int, slot: int) -> None:
        """Go on without a source, as if it had not been trusted since a slot's forks began."""
        m = self._members(slot)[source]
        self.X[0], self.P[0] = self.X[m], self.P[m]
        self.left_out[0] |= 1 << source
        own = OWN[source]  # nothing is known of its errors any more
        self.X[0, own], self.P[0, own, :], self.P[0, :, own] = 0.0, 0.0, 0.0
        for i in range(own.start, own.stop):
            self.P[0, i, i] = self.believed.at(i, self._xi)
        self._begin_anew()

    def take_again(self, source: int) -> None:
        """Hear a source again that was left out, of whose errors nothing is known."""
        self.left_out[0] &= ~(1 << source)
        self._begin_anew()

    def _begin_anew(self) -> None:
        for k in range(self.sources):
            self._restart_standing(k)
        self._fork_all()

    def oldest(self, length: int) -> int:
        """The slot of a length [index of fork_s] that began first."""
        return min((i for i, (k, _) in enumerate(self.slots) if k == length), key=lambda i: self.born_us[i])

    def _restart_standing(self, k: int) -> None:
        """A standing filter begins anew from filter 0, which has heard its source: it knows no more than the others' priors."""
        m = 1 + k
        self.X[m], self.P[m] = self.X[0], self.P[0]
        self.left_out[m] = self.left_out[0] | 1 << k
        self._run[m] = 0
        # what the others' slow errors were learnt with may have been wrong: d is as uncertain as the best of them by itself
        rest = [self.believed.alone(j, self._xi) for j in range(WAKE) if j != k and not self.left_out[m] >> j & 1]
        for i in range(D.start, D.stop):
            self.P[m, i, i] += min(rest, default=0.0)
        for s in SLOW[: self.sources + 1]:
            for i in range(s.start, s.stop):
                self.P[m, i, i] = max(self.P[m, i, i], self.believed.at(i, self._xi))

    @property
    def d(self) -> Vec3:
        """Position [m] NED of filter 0."""
        x, y, z = self.X[0, D].tolist()
        return x, y, z

    @property
    def u(self) -> Vec3:
        """Its velocity [m/s] NED less the tanker's."""
        x, y, z = self.X[0, U].tolist()
        return x, y, z

    @property
    def xi(self) -> Vec3:
        """Position [m] in tanker axes at the time of `stand`."""
        return self._xi

    def relative_error(self, m: int) -> tuple[Vec3, Vec3]:
        """Error of the relative sensor as filter m has it: of its position [m], of its rate [m/s]."""
        a, b, c, x, y, z, u, v, w = self.X[m, B_RS:B_G].tolist()  # slow, constant, of the rate
        return (a + x, b + y, c + z), (u, v, w)

    def apart(self, m: int) -> tuple[Vec3, Vec3]:
        """Position [m] of filter m less that of filter 0 in tanker axes, and the same of the velocity [m/s] NED."""
        if m == 0:
            return ZERO3, ZERO3
        x, y, z = (self.place * (self.X[m] - self.X[0])).sum(axis=1).tolist()
        u, v, w = (self.X[m, U] - self.X[0, U]).tolist()
        return (x, y, z), (u, v, w)

    def borne_out(self, source: int, slot: int, live: int) -> float:
        """Log-likelihood by the wake position's readings alone of "source is wrong" less that of "another is", the least over
        those of the mask `live`, since a slot's forks began."""
        members, others = self._members(slot), [k for k in range(WAKE) if k != source and live >> k & 1]
        word = self._by_wake[members[source]]
        return min((float(word - self._by_wake[members[k]]) for k in others), default=0.0)

    def along(self, a: int, b: int) -> bool:
        """Whether what sources a and b dispute lies along the tanker's path rather than across: between the forks that distrust
        one and the other, of the slot that has them farthest apart."""
        slots = map(self._members, range(len(self.slots)))
        parts = [(self.place * (self.X[m[a]] - self.X[m[b]])).sum(axis=1).tolist() for m in slots]
        x, y, z = max(parts, key=lambda d: math.hypot(*d))
        return abs(x) > math.hypot(y, z)

    def more_likely(self, a: int, b: int) -> float:
        """Log-likelihood of "source a is wrong" less that of "b is", mean of the long forks."""
        long = [self._members(s) for s, (length, _) in enumerate(self.slots) if length > 0]
        return float(np.mean([self.L[m[a]] - self.L[m[b]] for m in long]))

    @property
    def sigma(self) -> Vec3:
        """1-sigma [m] of filter 0."""
        x, y, z = kernel.sigmas(self._wide[0], self.place, self._grown)
        return x, y, z
