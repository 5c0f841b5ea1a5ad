"""One rendezvous flown by the onboard classes as in flight, recorded for a picture: tracks, ranges, the posterior's banana."""

from __future__ import annotations

import math

import numpy as np

from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.guidance import OwnState, RendezvousGuidance
from hil_scripts.studies.rivard.mc import NM, RivardCase, draw, truth_vectors
from sim_plant.couplings import traffic_kernel as tr

Array = np.ndarray
SNAPS = (0.0, 60.0, 120.0, 170.0)  # [s] times the posterior is kept at (first range at or after), from the start
END_S = 600.0


def fly_one(case: RivardCase, seed: int, index: int = 0, snaps: tuple[float, ...] = SNAPS) -> dict[str, Array]:
    """Arrays of rendezvous `index` of `seed`; frame R, SI.

    track [N,8]: t, receiver x y, tanker x y, phase (0 approach to 3 done), estimate x y, at each guidance step. snap [k,7]: t,
    slant range, own x y, true x y, 0; weight [k,M], at [k,M,2], cov [k,M,2,2]: the components then. miss [2].
    Only settings with a guidance period, without lost or late ranges; ValueError otherwise.
    """
    if case.guidance_s <= 0.0 or case.truth.dropout or case.truth.latency_s or case.bearing_deg or case.datalink_m:
        raise ValueError("fly_one: a guidance period and ranges in time are wanted, no other sensor")
    W = draw(case, seed, index // 256, True)[0][index % 256]
    p, q = truth_vectors(case)
    s, wk = np.zeros(8), np.zeros(13)
    tr.receiver_start(W, p, s)
    est, gd = RangeEstimator(case.nav), RendezvousGuidance(case.guid)
    tanker = np.array([0.0, -case.offset_nm * NM, 0.0, 0.0, case.guid.speed_mps])
    per = round(case.range_s / case.guidance_s)
    left, range_m, seen = list(snaps), math.inf, 0.0
    track, snap, weight, at, cov = [], [], [], [], []
    for k in range(round(END_S / case.guidance_s)):
        t = k * case.guidance_s
        if k:
            tr.tanker_step(tanker, gd.out.bank, gd.out.speed, case.guidance_s, q)
            est.predict(case.guidance_s)
        if k % per == 0:
            j = k // per
            tr.receiver_step(s, seen, t - seen, W, 8 + 4 * j, p, wk)
            seen = t
            range_m = tr.tacan_range(s, tanker[0], tanker[1], p)
            if j == 0:
                est.start(range_m, tanker[0], tanker[1], 0.0, case.sigma_y_nm * NM)
            else:
                est.update(range_m, tanker[0], tanker[1])
            if left and t >= left[0]:
                left.pop(0)
                w, m, P = est.components()
                snap.append((t, range_m, tanker[0], tanker[1], s[0], s[3], 0.0))
                weight.append(w)
                at.append(m)
                cov.append(P)
        own = OwnState(tanker[0], tanker[1], tanker[2], tanker[3], tanker[4])
        c = gd.step(own, est.mean, range_m, case.guidance_s if k else 0.0)
        v = p[tr.P_U] + s[1] + s[2]
        phase = ("approach", "turn", "rollout", "done").index(c.phase)
        here = (s[0] + v * (t - seen), s[3] + s[4] * (t - seen))
        track.append((t, *here, tanker[0], tanker[1], phase, est.mean[0], est.mean[2]))
        if c.phase == "done":
            break
    last = track[-1]
    return {
        "track": np.array(track),
        "snap": np.array(snap),
        "weight": np.array(weight),
        "at": np.array(at),
        "cov": np.array(cov),
        "miss": np.array([last[1] - case.guid.separation_m - last[3], last[2] - last[4]]),
    }
