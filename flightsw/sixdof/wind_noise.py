"""How much the wind may move: a fixed intensity, one matched to the innovations, or three filters weighted by likelihood.

Lee (2011) leaves adaptive process noise open; lee.md section 10. Only the wind's columns of the noise factor are touched,
every other entry stays at its robust value.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flightsw.filters.adaptive import AdaptParams, NoiseAdapter
from flightsw.filters.bank import FilterBank, markov
from flightsw.filters.base import PointFilter
from flightsw.filters.factory import make_filter
from flightsw.sixdof.estimator_core import EstimatorCore
from flightsw.sixdof.layout import N_WD, N_WE, N_WN, X_WN

BANK = (0.6, 1.8, 6.0)  # intensities of the bank, multiples of q_wind: calm to storm, a factor of three apart
DWELL_S = 20.0  # [s] mean stay in one of them


class BankFilter:
    """Several filters behind the interface of one (filters.base.PointFilter): static bank, weights by likelihood.

    X [k p,n] and Y [k p,m] stack the points of the k filters, so that the owner's model runs over all of them at once. x is
    the weighted mean; nu, K, Sy are those of the likeliest filter. `scale` [k] multiplies the columns `columns` of SQ.
    """

    def __init__(self, filters: Sequence[PointFilter], q: Sequence[float], columns: np.ndarray, dt_s: float) -> None:
        """filters k of equal kind and size, q [k] intensities, columns of SQ they scale (SQ is filled for q[k // 2] = 1 x).

        Raises ValueError for unequal sizes (FilterBank).
        """
        self.bank = FilterBank(filters, q, markov(len(filters), DWELL_S, dt_s), mix=False)
        one = filters[0]
        self.filters = self.bank.filters
        self.n, self.m, self.nq, self.rows = one.n, one.m, one.nq, one.X.shape[0]
        self.x = self.bank.x
        k = len(self.filters)
        self.X, self.Y = np.zeros((k * self.rows, self.n)), np.zeros((k * self.rows, self.m))
        self.SQ = np.zeros((self.n, self.nq))
        self.nu, self.K, self.Sy = np.zeros(self.m), np.zeros((self.n, self.m)), np.zeros((self.m, self.m))
        self.scale = np.ones(k)
        self.columns = columns

    def _slice(self, i: int) -> slice:
        return slice(i * self.rows, (i + 1) * self.rows)

    def draw(self) -> np.ndarray:
        """Points X [k p,n] of every filter."""
        for i, f in enumerate(self.filters):
            self.X[self._slice(i)] = f.draw()
        return self.X

    def recombine(self) -> None:
        """Time update of every filter, each with its own intensity; weights through the transition."""
        for i, f in enumerate(self.filters):
            f.X[:] = self.X[self._slice(i)]
            f.SQ[:] = self.SQ
            f.SQ[:, self.columns] *= self.scale[i]
            f.recombine()
        self.bank.mix()
        self.bank.weigh(0)

    def correct(self, y: np.ndarray, r: np.ndarray, m: int) -> float:
        """Measurement update of every filter and of the weights; returns the weighted NIS."""
        nis = 0.0
        mu = self.bank.mu.copy()
        for i, f in enumerate(self.filters):
            f.Y[:, :m] = self.Y[self._slice(i), :m]
            nis += float(mu[i]) * f.correct(y, r, m)
        self.bank.weigh(m)
        one = self.best
        self.nu[:], self.K[:], self.Sy[:] = one.nu, one.K, one.Sy
        return nis

    @property
    def best(self) -> PointFilter:
        """The likeliest filter."""
        return self.filters[int(np.argmax(self.bank.mu))]

    @property
    def P(self) -> np.ndarray:
        """Covariance [n,n] of the mixture."""
        return self.bank.P

    @property
    def S(self) -> np.ndarray:
        """Lower factor [n,n] of the likeliest filter's covariance; write with set_factor."""
        return self.best.S

    def sigmas(self) -> list[float]:
        """1-sigma of every state [n] of the mixture."""
        return self.bank.sigmas()

    def memory(self) -> tuple[np.ndarray, ...]:
        """Means, covariances and weights, the filters' own arrays."""
        return self.x, self.bank.mu, *(a for f in self.filters for a in f.memory())

    def set_factor(self, S: np.ndarray) -> None:
        """Every filter starts from x and S S^T, with equal weights."""
        self.bank.start(self.x.copy(), S)

    def set_cov(self, P: np.ndarray) -> None:
        """Every filter starts from x and P."""
        for f in self.filters:
            f.x[:] = self.x
            f.set_cov(P)
        self.bank.mu[:] = 1.0 / len(self.filters)

    def predict(self, f, SQ: np.ndarray) -> None:  # type: ignore[no-untyped-def]
        """Time update with a plain function of the points."""
        self.draw()
        self.X[:] = f(self.X)
        self.SQ[:] = 0.0
        self.SQ[:, : SQ.shape[1]] = SQ
        self.recombine()

    def update(self, h, y: np.ndarray, r: np.ndarray) -> float:  # type: ignore[no-untyped-def]
        """Measurement update with a plain function of the points; returns NIS."""
        k = len(y)
        self.draw()
        self.Y[:, :k] = h(self.X)
        return self.correct(np.ascontiguousarray(y, dtype=float), np.ascontiguousarray(r, dtype=float), k)


class WindNoise:
    """Adaptation of an estimator's wind intensity as NavParams.adapt_wind says. With "bank" it replaces the core's filter."""

    def __init__(self, core: EstimatorCore, gust_column: int = -1, gusts: int = 0, dt_s: float = 0.05) -> None:
        """core: its filter is taken as it is; gust_column, gusts: columns of SQ that drive turbulence states, if any.

        dt_s [s]: nominal step, for the weights' transition.
        """
        self.core = core
        p = core.p
        self.columns = np.array([N_WN, N_WE, N_WD, *range(gust_column, gust_column + gusts)])
        self.adapter: NoiseAdapter | None = None
        self.bank: BankFilter | None = None
        if p.adapt_wind == "single":
            a = AdaptParams()
            limits = AdaptParams(q_min=min(a.q_min, 0.3 * p.q_wind), q_max=max(a.q_max, 3.0 * p.q_wind))
            self.adapter = NoiseAdapter(p.q_wind, X_WN, 3, limits)
        elif p.adapt_wind == "bank":
            one = core.ukf
            more = [make_filter(p.filter, one.n, one.m, one.nq) for _ in BANK[1:]]
            self.bank = BankFilter([one, *more], [p.q_wind * s for s in BANK], self.columns, dt_s)
            self.bank.scale[:] = BANK
            core.ukf = self.bank

    def reset(self) -> None:
        """Back to the initial intensity."""
        if self.adapter is not None:
            self.adapter.reset()
        self.core.q_wind = self.core.p.q_wind

    def fill(self, SQ: np.ndarray) -> None:
        """Scale the wind's columns of the noise factor SQ, filled for q_wind, to the intensity in force."""
        if self.adapter is not None:
            SQ[:, self.columns] *= self.core.q_wind / self.core.p.q_wind

    def update(self, dt: float) -> None:
        """After a correction, dt [s] after the previous one."""
        c = self.core
        if self.adapter is not None:
            c.q_wind = self.adapter.update(c.ukf, c.m, dt)
        elif self.bank is not None:
            c.q_wind = self.bank.bank.q
