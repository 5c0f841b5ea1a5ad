"""Own position in a tanker's wake from one set of probe readings: weighted least squares with several starts, and the
Cramer-Rao bound.

Readings of one variable share a wind, an attitude error and a trim: R = sigma^2 / n I + s^2 1 1^T per variable (joint
weighting, sevil.md 8.2). s = 0 believes the absolute readings, s = infinity only their differences between probes.
"""

from __future__ import annotations

import math
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from flightsw.kernels.linalg import solve
from flightsw.missions.receiver.airdata import expected as k
from flightsw.missions.receiver.airdata import least_squares as ls
from flightsw.missions.receiver.airdata.wake_fix import PLACE, MlFix, MlParams
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_vector

Arr = NDArray[np.float64]
ALL_OK = 0b111111111
FACTORS = slice(ls.B_KW, ls.B_N)  # of the unknowns


def frame_vector(
    x: float,
    att: tuple[float, float, float] | Arr,
    V_T: float,
    rho: float,
    omega: tuple[float, float, float] | Arr = (0.0, 0.0, 0.0),
    x_dot: float = 0.0,
    height_share: float = 0.0,
) -> Arr:
    """Frame vector [11] (expected.py): x [m, F], att = psi, theta, phi relative to F [rad], tanker airspeed
    [m/s], density [kg/m^3], own body rates [rad/s], rate of x [m/s]."""
    return np.array([x, x_dot, *att, *omega, V_T, rho, height_share], dtype=np.float64)


def ok_channels(mask: int, out: NDArray[np.int64]) -> int:
    """out [9] <- 1 for each channel (3 variable + probe) whose bit is set in `mask`; returns how many."""
    n = 0
    for c in range(9):
        out[c] = (mask >> c) & 1
        n += int(out[c])
    return n


def _row_sum(A: Arr) -> float:
    return float(np.abs(A).sum(axis=1).max())


class WakeMl:
    """Maximum-likelihood position from three probes. One object per aircraft: it holds the grid and its own buffers."""

    def __init__(self, probes: Arr, params: MlParams, wake: WakeParams) -> None:
        """probes [3,3] positions [m, body]. Raises ValueError for another shape."""
        self.probes = np.ascontiguousarray(probes, dtype=np.float64)
        if self.probes.shape != (3, 3):
            raise ValueError(f"probes of shape {self.probes.shape}; allowed (3, 3): nose, left, right")
        self.p = p = params
        self.wk = wake_vector(wake)
        self.ys, self.zs = (
            np.linspace(lo, hi, 1 + max(1, round((hi - lo) / p.step_m))) for lo, hi in (p.y_m, p.z_m)
        )  # fmt: skip
        self.nodes = len(self.ys) * len(self.zs)
        self._cost = np.full(self.nodes, np.inf)
        self._y, self._ok, self._g = np.zeros(9), np.ones(9, dtype=np.int64), np.zeros(k.G_SIZE)
        self._sig, self._com = np.zeros(3), np.zeros(3)
        self._mean0, self._inf0 = np.zeros(4), np.zeros(4)
        self._base = np.zeros(10)
        self._next = 0
        self._todo: list[tuple[float, float]] = []
        self._ends: list[tuple[float, Arr]] = []
        s = (p.scale_wing_sigma, p.scale_tail_sigma)
        self.free = 4 if min(s) > 0.0 else 2
        if (max(s) > 0.0) != (min(s) > 0.0):
            raise ValueError(f"scale_wing_sigma, scale_tail_sigma = {s}; allowed: both zero or both positive")
        self.scale_prior = (1.0, 1.0, *s)
        common = {"abs": (0.0, 0.0), "diff": (math.inf, math.inf), "joint": (p.common_V, p.common_angle)}
        common_V, common_angle = common[p.weighting]
        self._com[:] = common_V, common_angle, common_angle

    def begin(
        self,
        readings: Arr,
        frame: Arr,
        samples: int = 1,
        ok_mask: int = ALL_OK,
        wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
        prior: tuple[float, float, float] | None = None,
        scale: tuple[float, float, float, float] | None = None,
    ) -> None:
        """Take the mean of `samples` readings [9] in a frame [11] for a search; wind [m/s, F] known, if any.

        prior = (y, z, sigma) [m] enters the cost; scale = circulation factors of wing and tail and their sigmas, in place of
        1 and the parameters' where the factors are free. Raises ValueError for samples < 1 or a sigma <= 0.
        """
        if samples < 1:
            raise ValueError(f"samples = {samples}; allowed >= 1")
        self._y[:], self._g[:] = readings, frame
        ok_channels(ok_mask, self._ok)
        root = math.sqrt(samples)
        flow = math.hypot(self.p.sigma_angle / root, self.p.fixed_angle)
        self._sig[:] = math.hypot(self.p.sigma_V / root, self.p.fixed_V), flow, flow
        self._base[:] = 0.0
        kw, kt, sw, st = scale or self.scale_prior
        self._base[k.P_KW], self._base[k.P_KT] = (kw, kt) if self.free == 4 else (1.0, 1.0)
        if self.free == 4:
            if not min(sw, st) > 0.0:
                raise ValueError(f"sigma of the circulation factors = {(sw, st)}; allowed > 0")
            self._mean0[FACTORS], self._inf0[FACTORS] = (kw, kt), (1.0 / sw**2, 1.0 / st**2)
        self._base[k.P_W :] = wind
        self._inf0[PLACE] = 0.0
        if prior is not None:
            y, z, sigma = prior
            if not sigma > 0.0:
                raise ValueError(f"prior sigma = {sigma}; allowed > 0")
            self._mean0[PLACE], self._inf0[PLACE] = (y, z), 1.0 / sigma**2
        self._next = 0

    def advance(self, nodes: int) -> bool:
        """Evaluate the next `nodes` nodes of the grid; True when all are done. Spreads the search over steps."""
        last = min(self._next + nodes, self.nodes)
        ls.scan(
            self._base, self._y, self._ok, self._sig, self._com, self._g, self.probes, self.wk, self.ys, self.zs,
            self._next, last, self._cost,
        )  # fmt: skip
        self._next = last
        if last < self.nodes:
            return False
        self._todo, self._ends = self._starts(), []
        return True

    def _starts(self) -> list[tuple[float, float]]:
        """Nodes no neighbour undercuts, best first (prior included)."""
        c = self._cost.reshape(len(self.ys), len(self.zs))
        for a, axis in enumerate((self.ys[:, None], self.zs[None, :])):
            if self._inf0[a] > 0.0:
                c = c + self._inf0[a] * (axis - self._mean0[a]) ** 2
        wide = np.pad(c, 1, constant_values=np.inf)
        low = np.ones_like(c, dtype=bool)
        ny, nz = c.shape
        for i in range(3):
            for j in range(3):
                low &= c <= wide[i : i + ny, j : j + nz]
        iy, iz = np.nonzero(low)
        best = np.argsort(c[iy, iz], kind="stable")[: self.p.starts]
        return [(float(self.ys[iy[b]]), float(self.zs[iz[b]])) for b in best]

    def follow(self) -> bool:
        """Follow the next start of the coarse search downhill, after `advance` is done; True when none is left."""
        if not self._todo:
            return True
        y, z = self._todo.pop(0)
        p = self._base.copy()
        p[k.P_Y], p[k.P_Z] = y, z
        cost = self._run(p, self._mean0, self._inf0)
        same = [e for _, e in self._ends if math.hypot(e[k.P_Y] - p[k.P_Y], e[k.P_Z] - p[k.P_Z]) < 0.25]
        if math.isfinite(cost) and not same:
            self._ends.append((cost, p))
        return not self._todo

    def cost_near(self, y: float, z: float, sigma: float) -> float:
        """Cost [-] of the search begun last when the position is held at (y, z) to sigma [m], circulations free as there."""
        mean, inf, p = self._mean0.copy(), self._inf0.copy(), self._base.copy()
        mean[PLACE], inf[PLACE] = (y, z), 1.0 / sigma**2
        p[k.P_Y], p[k.P_Z] = y, z
        return self._run(p, mean, inf)

    def _run(self, p: Arr, mean: Arr, inf: Arr) -> float:
        return ls.descend(
            p, self._y, self._ok, self._sig, self._com, self._g, self.probes, self.wk, mean, inf, self.free,
            self.p.iterations,
        )  # fmt: skip

    def get_state(self) -> dict[str, object]:
        """Copy of a search in progress."""
        arrays = (self._cost, self._y, self._ok, self._g, self._sig, self._mean0, self._inf0, self._base)
        ends = [(c, p.copy()) for c, p in self._ends]
        return {"arrays": [a.copy() for a in arrays], "rest": (self._next, list(self._todo), ends)}

    def set_state(self, s: object) -> None:
        """Restore what `get_state` returned."""
        assert isinstance(s, dict)
        arrays = (self._cost, self._y, self._ok, self._g, self._sig, self._mean0, self._inf0, self._base)
        for own, a in zip(arrays, s["arrays"], strict=True):
            own[:] = a
        self._next, todo, ends = s["rest"]
        self._todo, self._ends = list(todo), [(c, p.copy()) for c, p in ends]

    def finish(self) -> MlFix | None:
        """Compare the ends of the descents; None if there is none, or the readings say nothing of the position."""
        lo_y, hi_y, lo_z, hi_z = *self.p.y_m, *self.p.z_m
        if not self._ends:
            return None
        ends = sorted(self._ends, key=itemgetter(0))
        m = self.p.step_m

        def inside(p: Arr) -> bool:
            return bool(lo_y - m <= p[k.P_Y] <= hi_y + m and lo_z - m <= p[k.P_Z] <= hi_z + m)

        # an end outside the region is taken only if none lies inside
        ends = [(c, q) for c, q in ends if inside(q)] or ends
        (cost, p), *others = ends
        cov = self.bound(p)
        if cov is None:
            return None
        rivals = tuple(
            (float(q[k.P_Y]), float(q[k.P_Z]), c) for c, q in others if c - cost < self.p.rival_cost and inside(q)
        )
        return MlFix(
            (float(p[k.P_Y]), float(p[k.P_Z])),
            (float(p[k.P_KW]), float(p[k.P_KT])),
            cov,
            cost,
            self.degrees_of_freedom(),
            rivals,
            inside(p),
        )

    def degrees_of_freedom(self) -> int:
        """Readings and priors less unknowns, of the search begun last (2 unknowns, one per free common offset)."""
        used = [int(self._ok[3 * v : 3 * v + 3].sum()) for v in range(3)]
        lost = sum(1 for n, c in zip(used, self._com, strict=True) if n and math.isinf(c))
        return sum(used) - lost - 2 + int(np.count_nonzero(self._inf0[PLACE]))

    def bound(self, p: Arr) -> Arr | None:
        """Inverse Fisher information [4,4] of (y, z, wing, tail factor) at the point p [10] for the search begun last (rows of
        frozen factors zero), None where it is singular."""
        A, B, h = np.zeros((4, 4)), np.zeros((9, 4)), np.zeros(9)
        ls.information(p, self._ok, self._sig, self._com, self._g, self.probes, self.wk, self._inf0, h, A, B)
        n, cov = self.free, np.zeros((4, 4))
        scale = np.sqrt(np.diag(A)[:n])
        if not (scale > 0.0).all():
            return None
        S = A[:n, :n] / np.outer(scale, scale)
        inverse = np.eye(n)
        # condition in the maximum norm: rows that tell the unknowns apart by rounding only
        if not solve(S.copy(), inverse) or not _row_sum(S) * _row_sum(inverse) < 1e12:
            return None
        cov[:n, :n] = inverse / np.outer(scale, scale)
        return cov

    def locate(
        self,
        readings: Arr,
        frame: Arr,
        samples: int = 1,
        ok_mask: int = ALL_OK,
        wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
        prior: tuple[float, float, float] | None = None,
    ) -> MlFix | None:
        """The whole search at once; arguments as `begin`."""
        self.begin(readings, frame, samples, ok_mask, wind, prior)
        self.advance(self.nodes)
        while not self.follow():
            pass
        return self.finish()

    def crlb(self, y: float, z: float, frame: Arr, samples: int = 1, ok_mask: int = ALL_OK) -> Arr | None:
        """Cramer-Rao bound [4,4] of (y, z [m], wing, tail circulation factor) at the position (y, z); None where singular."""
        self.begin(np.zeros(9), frame, samples, ok_mask)
        p = self._base.copy()
        p[k.P_Y], p[k.P_Z] = y, z
        return self.bound(p)


def differential_ml(
    readings: Arr,
    frame: Arr,
    probes: Arr,
    wake: WakeParams,
    params: MlParams | None = None,
    samples: int = 1,
    ok_mask: int = ALL_OK,
) -> MlFix | None:
    """Position from the mean of `samples` readings [9]; see WakeMl.locate. Makes a WakeMl: keep one for repeated use."""
    return WakeMl(probes, params or MlParams(), wake).locate(readings, frame, samples, ok_mask)
