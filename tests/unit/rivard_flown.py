"""A meeting of the study flown by the onboard classes as in flight, from the study's own normals."""

from __future__ import annotations

import math

import numpy as np

from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.guidance import OwnState, RendezvousGuidance
from hil_scripts.studies.rivard import geometry_kernel as gk
from hil_scripts.studies.rivard import own_rate as ko
from hil_scripts.studies.rivard.geometry_mc import GeometryCase, draw, setting_vector
from hil_scripts.studies.rivard.mc import NM, SEED, RivardCase, truth_vectors
from sim_plant.couplings import traffic_kernel as tr


class Truth:
    """The receiver, and the sensors that look at it; each look takes the next normals."""

    def __init__(self, c: GeometryCase, i: int) -> None:
        W, Z, _, U = draw(c, SEED, 0)
        self.W, self.Z, self.U, self.c, self.sp = W[i], Z[i], U[i], c, setting_vector(c)
        self.p, self.q = truth_vectors(RivardCase(truth=c.truth, range_nm=c.range_nm, offset_nm=abs(c.offset_nm)))
        self.s, self.wk, self.a = np.zeros(8), np.zeros(13), np.zeros(ko.A_N)
        self.t, self.drawn = 0.0, 0
        tr.receiver_start(self.W, self.p, self.s)
        ko.start(self.a, self.U, self.sp[gk.SP_BEARING], self.sp[gk.SP_LINK])

    def look(self, t: float, again: bool = True) -> None:
        """Move it to t; again: also where it is there already, as the study does for a range."""
        if again or t > self.t:
            tr.receiver_step(self.s, self.t, t - self.t, self.W, 8 + 4 * self.drawn, self.p, self.wk)
            self.t, self.drawn = t, self.drawn + 1

    def bearing(self, x: float, y: float, noise: float) -> float:
        los = tr.tacan_bearing(self.s, x, y) + self.sp[gk.SP_BEARING_BIAS] * self.Z[0]
        return float(los + noise)


def fly(c: GeometryCase, i: int) -> tuple[float, int, float, float, float]:
    """Time, announcements and misses [m] as estimated at the end of meeting i; time it first left its plan."""
    w = Truth(c, i)
    sp, (wx, wy) = w.sp, (c.truth.wind_x_mps, c.truth.wind_y_mps)
    est, gd = RangeEstimator(c.nav, wx, wy), RendezvousGuidance(c.guid)
    tanker = np.array([0.0, sp[gk.SP_Y0], sp[gk.SP_PSI0], 0.0, c.guid.speed_mps])
    t, t_g, due_at, sent_at, due, left = 0.0, 0.0, math.inf, 0.0, math.inf, math.inf
    j, k, jb, jl, said, sent = 0, 0, 0, 0, 0, (0.0, 0.0)
    while gd.out.phase != "done":
        tb = c.bearing_s * jb if c.bearing_s else math.inf
        tl = c.link_s * jl if c.link_s else math.inf
        t_next = min(10.0 * j, 0.5 * k, due_at, tb, tl, due)
        if t_next > t:
            tr.tanker_step(tanker, gd.out.bank, gd.out.speed, t_next - t, w.q)
            est.predict(t_next - t)
            t = t_next
        x, y = float(tanker[0]), float(tanker[1])
        if t >= 10.0 * j:
            w.look(t)
            z = tr.tacan_range(w.s, x, y, w.p)
            z += c.fault.add_m if c.fault.at_s <= t < c.fault.at_s + c.fault.for_s else 0.0
            with_it = c.bearing_deg and not c.bearing_s
            los = w.bearing(x, y, sp[gk.SP_BEARING] * w.Z[3 + 3 * j]) if with_it else None
            if j == 0:
                est.start(z, x, y, 0.0, c.sigma_y_nm * NM)
                est.update(None, x, y, 0.0, los)
            else:
                est.update(z, x, y, 0.0, los)
            j += 1
        if t >= tb:
            w.look(t, again=False)
            ko.fade(w.a, ko.A_B, 1, c.bearing_s, c.bearing_tau_s, sp[gk.SP_BEARING], w.U)
            est.update(None, x, y, 0.0, w.bearing(x, y, w.a[ko.A_B]))
            jb += 1
        if t >= tl:
            w.look(t, again=False)
            ko.fade(w.a, ko.A_X, 2, c.link_s, c.link_tau_s, sp[gk.SP_LINK], w.U)
            bias = sp[gk.SP_LINK_BIAS] * w.Z[1:3]
            sent_at, sent = t, (w.s[0] + bias[0] + w.a[ko.A_X], w.s[3] + bias[1] + w.a[ko.A_Y])
            due = t + c.link_late_s if ko.draw(w.a, w.U) > sp[gk.SP_LINK_GONE] else math.inf
            jl += 1
        if t >= due:
            due = math.inf
            est.update(None, x, y, t - sent_at, None, sent)
        left = t if est.out.left_plan and math.isinf(left) else left
        if t >= 0.5 * k or t >= due_at:
            k += t >= 0.5 * k
            own = OwnState(*(float(v) for v in tanker), wx, wy)
            before = gd.out.phase
            gd.step(own, est.mean, 0.0, t - t_g, est.last_covariance, est.out.left_plan, est.out.sided)
            said += gd.out.announced
            t_g, due_at = t, t + max(gd.out.wait_s, 1e-4)
            if gd.out.phase == "leg" != before:  # the study looks at the truth here
                w.look(t)
    return t, said, gd.out.miss_x_m, gd.out.miss_y_m, left
