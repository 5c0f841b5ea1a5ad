"""Onboard air-data monitor: detects and isolates faulty channels, keeps them out and lets them back in (sevil.md 6, 9.3 to 9.5).

Per variable (V, beta, alpha) the mean of the last samples of reading minus expectation is tested in parity space. An alarm is
resolved into a set of faulty probes, those channels are excluded but watched, and re-admitted after enough quiet samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from flightsw.missions.receiver.airdata.fdi.detectors import threshold_table
from flightsw.missions.receiver.airdata.fdi.monitor_kernel import (
    ALARM,
    O_ALARM,
    O_BAD,
    O_BLAMED,
    O_NEGATIVE,
    O_UNRESOLVED,
    TOTAL,
    TWO,
    monitor_variable,
)
from flightsw.missions.receiver.airdata.fdi.parity_kernels import cusum_step, null_basis, whiten
from flightsw.missions.receiver.airdata.reports import FdiStatus
from flightsw.strict import OneOf, Range

Pos = Annotated[float, Range(1e-9, 1e6)]
NonNeg = Annotated[float, Range(0.0, 1e6)]
Prob = Annotated[float, Range(1e-12, 0.5)]
Count = Annotated[int, Range(1, 100_000)]
FORMS = ("additive", "multiplicative", "plain")
MISSING = ("hold", "plain")
ANGLE_SIGMA = math.radians(math.sqrt(0.002))


@dataclass(frozen=True)
class FdiParams:
    """Tuning of the air-data monitor. Noise is 1-sigma per sample, Sevil 2013 grade (0.2 (m/s)^2, 0.002 deg^2) by default."""

    sigma_V: tuple[Pos, Pos, Pos] = (math.sqrt(0.2),) * 3  # [m/s] by probe
    sigma_beta: tuple[Pos, Pos, Pos] = (ANGLE_SIGMA,) * 3  # [rad]
    sigma_alpha: tuple[Pos, Pos, Pos] = (ANGLE_SIGMA,) * 3  # [rad]
    # 1-sigma by which a probe may differ for good (bias, error of the wake model): widens the test, does not average out
    bias_V: NonNeg = 0.0  # [m/s]
    bias_beta: NonNeg = 0.0  # [rad]
    bias_alpha: NonNeg = 0.0  # [rad]
    form: Annotated[str, OneOf(FORMS)] = "additive"  # "multiplicative": eq. 5.24 as printed; "plain": equal readings
    without_model: Annotated[str, OneOf(MISSING)] = "hold"  # no expected readings: suspend, or assume equal readings
    window: Annotated[int, Range(1, 100)] = 5  # samples averaged
    p_alarm: Prob = 1e-5  # false alarms per sample and variable; window 5: threshold 23.03
    p_decide: Prob = 3e-4  # at which a set of suspects is refused
    # one that differs from two is blamed only if the prediction leaves them less likely than this to lie alike; else it is
    # undecided, or they are blamed. 0: two never lie alike
    p_alike: Annotated[float, Range(0.0, 0.5)] = 0.0
    p_quiet: Prob = 1e-2  # at which an excluded channel counts as disagreeing
    readmit_samples: Count = 20  # quiet samples before a channel comes back
    readmit_max: Count = 640  # the number doubles with each relapse, up to this
    relapse_samples: Count = 400  # an exclusion this soon after a re-admission is a relapse
    drop_unresolved: bool = True  # probes that disagree, with nothing to tell which is wrong: none is used
    cusum: bool = False  # small lasting faults by CUSUM beside the window
    cusum_delta: Pos = 2.0  # [-] standard deviations
    cusum_h: Pos = 13.0  # [-]
    V_min: NonNeg = 20.0  # [m/s] readings outside are impossible and blamed at once
    V_max: Pos = 400.0  # [m/s]
    flow_max: Pos = 0.7  # [rad]


class Fdi:
    """The monitor. One `step` per air-data sample; deterministic, never raises on bad readings."""

    def __init__(self, params: FdiParams) -> None:
        self.p = p = params
        self.th = threshold_table(p.p_alarm, p.p_decide, p.p_quiet, p.p_alike)
        drop = 1 if p.drop_unresolved else 0
        self.lim = np.array([p.readmit_samples, p.readmit_max, p.relapse_samples, drop], dtype=np.int64)
        self.var = np.square(np.array([p.sigma_V, p.sigma_beta, p.sigma_alpha]))
        self._bias = np.square([p.bias_V, p.bias_beta, p.bias_alpha])
        self._lo = np.repeat([p.V_min, -p.flow_max, -p.flow_max], 3)
        self._hi = np.repeat([p.V_max, p.flow_max, p.flow_max], 3)
        n = p.window
        self.R, self.H, self.val = np.zeros((3, n, 3)), np.ones((3, n, 3)), np.zeros((3, n), dtype=np.int64)
        self.cnt, self.sums = np.zeros((3, 3, 6), dtype=np.int64), np.zeros((3, 6))
        self.span, self.excluded, self.first, self.modelled = [0, 0, 0], [0, 0, 0], -1, True
        self._use, self._out = np.zeros(n, dtype=np.int64), np.zeros(7, dtype=np.int64)
        self._r, self._h, self._C, self._g = np.zeros(3), np.ones(3), np.zeros((3, 3)), np.zeros(8)
        self._y, self._e, self._S = np.zeros(9), np.zeros(9), np.zeros((3, 3, 3))
        self._V, self._t, self._mu, self._one = np.zeros((2, 3)), np.zeros(2), np.zeros((2, 3)), np.zeros(3)
        self.unresolved = 0
        self.out = FdiStatus()
        self.reset()

    def reset(self) -> None:
        """Forget everything: no exclusions, empty windows."""
        self.cnt[:] = (0, self.p.readmit_samples, 1 << 30, 0, 0, 0)
        self.span, self.excluded = [0, 0, 0], [0, 0, 0]
        self.sums[:] = 0.0
        self.val[:] = 0
        self.first, self.modelled, self.unresolved = -1, True, 0
        self.out = FdiStatus(threshold=float(self.th[ALARM, TWO]))

    def get_state(self) -> dict[str, Any]:
        """Copy of everything `step` depends on."""
        arrays = {k: getattr(self, k).copy() for k in ("R", "H", "val", "cnt", "sums")}
        return {**arrays, "span": list(self.span), "excluded": list(self.excluded), "first": self.first,
                "modelled": self.modelled}  # fmt: skip

    def set_state(self, state: dict[str, Any]) -> None:
        """Restore a copy taken with get_state."""
        for k in ("R", "H", "val", "cnt", "sums"):
            getattr(self, k)[:] = state[k]
        self.span, self.excluded = list(state["span"]), list(state["excluded"])
        self.first, self.modelled = state["first"], state["modelled"]

    def usable(self, ok_mask: int) -> int:
        """Channels [9 bits] navigation may use: delivered (`ok_mask`) and not excluded."""
        return ok_mask & ~self.out.excluded & 0x1FF

    def step(
        self,
        readings: Sequence[float] | np.ndarray,
        ok_mask: int,
        e: np.ndarray | None,
        S: np.ndarray | None,
        common: Sequence[float] | np.ndarray | None,
        sigma_common: Sequence[float] | np.ndarray | None,
        t_us: int = 0,
    ) -> FdiStatus:
        """Judge one sample of the nine channels (V1..3 [m/s], beta1..3, alpha1..3 [rad]).

        ok_mask: channels delivered, bit 3 variable + probe; one that is set with NaN or an impossible value is blamed at once.
        e [9] expected readings and S [9,9] their covariance (J P J^T; errors that last longer than the window), None when there
        is no model: see FdiParams.without_model. common [3] virtual sensor: what every probe of a variable reads beyond
        e (zero when e contains the wind estimate; the value itself in the plain form), sigma_common [3] its 1-sigma;
        None, NaN or a sigma <= 0: none, and then two faults in one variable cannot be told from one.

        Where two probes are left without virtual sensor a fault can be detected, not isolated: the variable is in `alarm` and
        none of its channels in `isolated`; `self.unresolved` has the channels. gamma always has the scale of two degrees
        of freedom: where only one is left it is the value of equal probability. `valid` false: nothing was tested.
        """
        p = self.p
        y, has = self._y, e is not None
        y[:] = readings
        self.first = (self.first + 1) % p.window
        st = FdiStatus(t_us=t_us, threshold=float(self.th[ALARM, TWO]))
        if has:
            self._e[:] = e
            has = math.isfinite(float(self._e.sum()))
        if not has or p.form == "plain":
            self._e[:] = 0.0
        test = has or p.form == "plain" or p.without_model == "plain"
        if (has or p.form == "plain") != self.modelled or not test:
            self.modelled = has or p.form == "plain"
            self.span = [0, 0, 0]  # residuals of different kinds do not mix in one window
            self.sums[:] = 0.0
        self._take_covariance(S if has and p.form == "additive" else None)
        with np.errstate(invalid="ignore"):
            sane = (y >= self._lo) & (y <= self._hi)  # false for NaN
        gamma, residual, flags = [0.0, 0.0, 0.0], [0.0] * 6, [0, 0, 0, 0]
        tested = test
        for v in range(3):
            tested &= self._variable(v, ok_mask, sane, test, common, sigma_common, gamma, residual, flags)
        st.valid = tested and (has or p.form == "plain")
        st.gamma, st.residual = tuple(gamma), tuple(residual)  # type: ignore[assignment]
        st.alarm, st.isolated, st.negative, self.unresolved = flags
        st.excluded = sum(mask << 3 * v for v, mask in enumerate(self.excluded))
        st.exclusions = int(self.cnt[:, :, TOTAL].sum())
        self.out = st
        return st

    def _take_covariance(self, S: np.ndarray | None) -> None:
        """Blocks of S by variable, with the lasting differences allowed between probes added; without S only those."""
        for v in range(3):
            self._S[v] = 0.0 if S is None else S[3 * v : 3 * v + 3, 3 * v : 3 * v + 3]
            for i in range(3):
                self._S[v, i, i] += self._bias[v]

    def _variable(
        self, v: int, ok_mask: int, sane: np.ndarray, test: bool, common: Any, sigma_common: Any, gamma: list[float],
        residual: list[float], flags: list[int],
    ) -> bool:  # fmt: skip
        """Variable v of `step`: fills its entries of the results, returns whether it could be tested."""
        p, k = self.p, 3 * v
        ok = bad = 0
        x, inv_c = 0.0, 0.0
        if common is not None and sigma_common is not None and p.form != "multiplicative":
            c, s = float(common[v]), float(sigma_common[v])
            if math.isfinite(c) and s > 0.0 and math.isfinite(s):
                x, inv_c = c, 1.0 / (s * s)
        ring, hring = self.R[v, self.first], self.H[v, self.first]
        multiplicative = p.form == "multiplicative" and self.modelled
        for i in range(3):
            given = ok_mask >> (k + i) & 1
            good = bool(sane[k + i]) and given
            ok |= 1 << i if good else 0
            bad |= 1 << i if given and not good else 0
            hring[i] = self._e[k + i] if multiplicative else 1.0
            ring[i] = (self._y[k + i] - (0.0 if multiplicative else self._e[k + i]) - x) if good else 0.0
        self.val[v, self.first] = ok if test else 0
        self.span[v] = min(self.span[v] + 1, p.window)
        out, r, h, C = self._out, self._r, self._h, self._C
        hint = self._cusum(v, ok, ring, hring) if p.cusum and test else 0
        self.span[v], self.excluded[v], g = monitor_variable(
            self.R[v], self.H[v], self.val[v], self._use, self.first, self.span[v], ok if test else 0, bad,
            self.excluded[v], hint, self.var[v], self._S[v], inv_c, self.th, self.lim, self.cnt[v], r, h, C, self._g, out,
        )  # fmt: skip
        for i, (o, at) in enumerate(((O_ALARM, v), (O_BLAMED, k), (O_NEGATIVE, k), (O_UNRESOLVED, k))):
            flags[i] |= int(out[o]) << at
        if not test or out[O_BAD]:
            return False
        if ok == 7:
            gamma[v] = g
            null_basis(h, self._V)
            if whiten(r, C, self._V, self._t, self._mu):
                residual[2 * v : 2 * v + 2] = self._t.tolist()
        elif ok.bit_count() == 2:
            gamma[v] = same_tail(g)
            i = 0 if ok & 1 else 1
            j = 2 if ok & 4 else 1
            residual[2 * v] = math.copysign(math.sqrt(gamma[v]), r[i] * h[j] - r[j] * h[i])
        return True

    def _cusum(self, v: int, ok: int, r: np.ndarray, h: np.ndarray) -> int:
        """Probe mask the CUSUM of variable v blames after this sample, 0 for none; needs all three probes."""
        s = self.sums[v]
        self._C[:] = self._S[v]
        for i in range(3):
            self._C[i, i] += self.var[v, i]
        null_basis(h, self._V)
        if ok != 7 or not whiten(r, self._C, self._V, self._t, self._mu):
            s[:] = 0.0
            return 0
        cusum_step(self._t, self._mu, self.p.cusum_delta, 2.0 * self.p.cusum_h, s)
        top = int(np.argmax(s))
        return 1 << top // 2 if s[top] > self.p.cusum_h else 0


def same_tail(g: float) -> float:
    """Chi-square value with 2 degrees of freedom as improbable as g with 1: -2 ln erfc(sqrt(g/2))."""
    if g < 600.0:
        return max(-2.0 * math.log(math.erfc(math.sqrt(0.5 * g))), 0.0)
    return g + math.log(0.5 * math.pi * g)  # asymptote of erfc
