"""The bank taken to a time by way of the readings that wait, and what it expects of now: each one call (horizon.py)."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.receiver.integrity.judge_kernel import stand
from flightsw.missions.receiver.integrity.kernel import heard, predict
from flightsw.missions.receiver.integrity.layout import B_AB, B_D, B_U, GNSS, REL, WAKE
from flightsw.missions.receiver.integrity.unrest import DENSITY, hear
from flightsw.missions.receiver.integrity.waiting import AT_US, COUNT, FREE, NUMBER, SOURCE, earliest
from flightsw.missions.receiver.integrity.way_kernel import at, build, over
from flightsw.missions.receiver.tanker_link import carried
from flightsw.sixdof.layout import TK, TK_P

STEP_US = 50_000  # [us] longest step of the bank
# of what is expected now, behind the tanker as a stage [18]: velocity [m/s] NED, position [m] in tanker axes
VEL, XI = TK, TK + 3
NOW = XI + 3


@jit
def seen_from(H: np.ndarray, y: np.ndarray, age: float, a: np.ndarray) -> None:
    """Let rows H [ROWS,n], readings y be of the state `age` [s] after the sample, with acceleration a [3] m/s^2 NED since:
    d(t - age) = d - u age + a age^2 / 2, u(t - age) = u - a age."""
    for i in range(H.shape[0]):
        gained = 0.0
        for j in range(3):
            d, u = H[i, B_D + j], H[i, B_U + j]
            H[i, B_U + j] -= age * d
            H[i, B_AB + j] += 0.5 * age * age * d - age * u
            gained += (age * u - 0.5 * age * age * d) * a[j]
        y[i] += gained


@jit
def unsure(density: float, least: float) -> float:
    """The density learnt, and no less than that of a way that was not measured [m/s^2 per sqrt(Hz)]."""
    return least if least > density else density


@jit
def advanced(
    us: int, to_us: int, live: int, own: np.ndarray, n: int, other: np.ndarray, m: int, a: np.ndarray, coasting: bool,
    felt: bool, known: bool, blind: float, most: float, last: np.ndarray, unrest: np.ndarray,
    X: np.ndarray, P: np.ndarray, L: np.ndarray, left_out: np.ndarray, by_wake: np.ndarray, before: np.ndarray,
    dt: float, decay: np.ndarray, q: np.ndarray, born_us: np.ndarray, lives_s: np.ndarray, z: np.ndarray,
    H: np.ndarray, y: np.ndarray, r: np.ndarray, when: np.ndarray,
) -> tuple[int, int, bool, bool]:  # fmt: skip
    """Take the bank from us to to_us by way of every reading that waits and is older. It stops before a step that is not `dt` [s]
    long, for which decay and q are, and before one at whose end forks begin anew, lives_s [slots] s after born_us [slots].
    Returns where the bank is, where the step to come ends, and of the way of the last step whether it was felt and known (as
    given if there was none).

    live: sources heard and believed, a mask; own, n, other, m, a, coasting as `over`; blind, most [m/s^2 per sqrt(Hz)]: what a
    way is known to that is not measured, not felt; last [3] <- acceleration of the last step, unrest [LEARNT] learns; X, P, L,
    left_out, decay, q, z as `predict` and `heard`; by_wake [M] <- what of L the wake position makes, before [M] workspace; H, y,
    r, when as Waiting.
    """
    while True:
        k = earliest(when)
        waits = k >= 0 and when[k, AT_US] <= to_us
        goal = when[k, AT_US] if waits else to_us
        while us < goal:
            end = min(goal, us + STEP_US)
            if (end - us) * 1e-6 != dt:
                return us, end, felt, known
            for slot in range(born_us.shape[0]):
                if (end - born_us[slot]) * 1e-6 >= lives_s[slot]:
                    return us, end, felt, known
            felt, known, last[0], last[1], last[2] = over(own, n, other, m, a, coasting, us, end)
            density = unrest[DENSITY] if known else unsure(unrest[DENSITY], blind if felt else most)
            predict(X, P, decay, q, last, density * density, dt)
            us = end
        if not waits:
            return us, us, felt, known
        source, age = when[k, SOURCE], (us - when[k, AT_US]) * 1e-6
        if age > 0.0:
            seen_from(H[k], y[k], age, last)
        for i in range(L.shape[0]):
            before[i] = L[i]
        heard(X, P, L, left_out, 1 << source, H[k], y[k], r[k], when[k, COUNT], z)
        if source == WAKE:
            for i in range(L.shape[0]):
                by_wake[i] += L[i] - before[i]
        hear(unrest, source, z, live >> REL & 1 != 0, live >> GNSS & 1 != 0)
        when[k, NUMBER] = FREE


@jit
def expected(
    us: int, now_us: int, own: np.ndarray, n: int, other: np.ndarray, m: int, a: np.ndarray, coasting: bool, X: np.ndarray,
    path: np.ndarray, R: np.ndarray, w: np.ndarray, v: np.ndarray, sample_us: int, place: np.ndarray, out: np.ndarray,
) -> tuple[int, bool, bool]:  # fmt: skip
    """path <- filter 0 of X [M,n] carried on from us to now_us, as `build`, which says what is returned; out [NOW] <- the tanker
    now by its sample R, w, v, a of sample_us (`carried`), velocity and position of the receiver; place [3,n] as `stand`."""
    rows, felt, known = build(own, n, other, m, a, coasting, us, now_us, STEP_US, X, path)
    carried(R, w, v, a, (now_us - sample_us) * 1e-6, out[:TK])
    x, y, z, out[VEL], out[VEL + 1], out[VEL + 2] = at(path, rows, now_us)
    lead = (now_us - us) * 1e-6
    out[XI], out[XI + 1], out[XI + 2] = stand(X, out[:TK_P], x, y, z, lead if lead > 0.0 else 0.0, place)
    return rows, felt, known
