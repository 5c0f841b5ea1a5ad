"""Receiver estimator: SR-UKF of the aircraft relative to the tanker and of the wind on it (Lee 2011, chapter 6, re-formulated).

Measurements: air data, gyro, attitude (made relative with the tanker's attitude from the data link), relative position and
velocity, own GNSS velocity. The tanker enters as a known input: its transmitted estimate, time-stamped and carried forward.
Prediction, wind model, further states, noise colour and adaptation: parts (sixdof/parts.py, relative.py). With none of them, and
nothing in dispute, a step is one compiled call (relative_kernel.py), to the bit the same as step by step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from flightsw import refusal as rd
from flightsw.kernels.atmosphere import density
from flightsw.kernels.rotations import dcm_from_euler, mul33
from flightsw.missions.receiver import relative_aids
from flightsw.missions.receiver.aids import seen_velocity
from flightsw.missions.receiver.relative import (
    altitude,
    first_state,
    inputs,
    swing_floor,
)
from flightsw.missions.receiver.relative_kernel import (
    BEFORE,
    O_SIGMA,
    OWN,
    inertial_rates,
    relative_rows,
    relative_step,
)
from flightsw.missions.receiver.relative_state import PEER_COAST_S, RelativeState
from flightsw.sixdof.aids import USE, USE_AIR, USE_ATT
from flightsw.sixdof.estimator_core import GAP_US, failed_bits
from flightsw.sixdof.judged import DONE, O_END, O_M, O_NIS, O_PROBES, O_RHO, O_SIFTED, REFUSED
from flightsw.sixdof.layout import EULER, POS, TK_DCM, TK_END, TK_START
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, UPD_REL, Health, NavState, SensorFrame


class RelativeNav(RelativeState):
    """Receiver state relative to the tanker, and wind, from own sensors and the tanker's transmitted estimate."""

    def step(self, f: SensorFrame, u: np.ndarray, health: Health, updated: int) -> NavState:
        """One estimator step; arguments as AirframeNav.step. Never raises on bad data."""
        c, o = self.core, self.out
        was_coasting = self.peer.coasting
        self.peer.take(f.peer)
        # a station held over the gap by the relative sensor is not given up when the link comes back
        self.rejoined = was_coasting and not self.peer.coasting and not o.rel_held
        o.peer_age_s = (f.t_us - f.peer.t_us) * 1e-6 if f.peer.t_us > 0 else 1e9
        if self.started_us >= 0 and f.t_us - self.t_us > GAP_US:
            self.begin_again(f"no step for {(f.t_us - self.t_us) * 1e-6:.1f} s, restarting")
        if self.started_us < 0:
            return self._start(f, u, updated, health)
        if self.rejoined:
            # the reference frame has moved: begin again in it from the sensors, valid at once
            self.started_us = -1
            self._start(f, u, updated, health)
            if self.started_us >= 0:
                self.started_us -= round(c.p.settle_s * 1e6)
                o.valid, o.reason = True, ""
                c.publish_trust(o)
            return o
        if o.peer_age_s > PEER_COAST_S or self.peer.coasting:
            self.peer.coast(f.t_us)
        dt_us = f.t_us - self.t_us
        dt = dt_us * 1e-6
        stages = (self.t_us, self.t_us + dt_us // 2, f.t_us)  # start, middle, end
        self.t_us = f.t_us
        c.begin(f.t_us)
        c.burn(f.fuel_kg)
        sound = updated & ~failed_bits(health)
        # a virtual tanker is not the one the relative sensor sees, unless it is steered by that sensor
        steered = self.aid is not None and self.peer.coasting and self.peer.level
        fresh = bool(sound & UPD_REL) and f.rel_valid and (steered or not self.peer.coasting)
        self._given[:] = inputs(c, self.peer, f, stages, sound, fresh, dt)
        if self._whole is not None and c.calm and not self.peer.coasting:
            return self._at_once(f, u, sound, fresh, dt, self._whole)
        for t, tk in zip(stages, self._tks, strict=True):
            self.peer.stage(t, tk)
        x, rho = c.ukf.x, density(altitude(f))
        if dt > 0.0:
            dcm_from_euler(*x[EULER], self._R)
            mul33(self._R, self._tks[TK_START, TK_DCM], self._Rn)
            c.noise_factor(self._Rn, dt)
            self.parts.predict(f, u, rho, dt)
        self._rates(u, rho)
        return self._end(f, u, rho, dt, *self._fuse(f, u, sound, fresh, steered))

    def _at_once(
        self, f: SensorFrame, u: np.ndarray, sound: int, fresh: bool, dt: float, whole: tuple[Any, ...]
    ) -> NavState:
        """All of a step in one compiled call; what it finds out of the ordinary is gone on with step by step."""
        c = self.core
        relative_step(self._given, u, *whole)
        out = self._told.tolist()
        m, end, rho, nis = int(out[O_M]), out[O_END], out[O_RHO], out[O_NIS]
        c.took(m, int(out[O_PROBES]), sound)
        if m and end != REFUSED:
            nis = c.sifted(int(out[O_SIFTED]), nis)
        if fresh:
            self._seen(f)
        if end != DONE:
            return self._end(f, u, rho, dt, nis, c.m)
        if c.ears(self.out.valid, dt):
            self._hear(f, u, rho)
            return self._publish(f, nis, m)
        return self._say(f, nis, m, out, out[O_SIGMA:])

    def _end(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float, nis: float, m: int) -> NavState:
        """After the correction by m rows."""
        c, o = self.core, self.out
        if why := c.lost(o.valid):
            self.begin_again(why)
            return o
        self._rates(u, rho)
        if c.ears(o.valid, dt):
            self._hear(f, u, rho)
        return self._publish(f, nis, m)

    def _start(self, f: SensorFrame, u: np.ndarray, updated: int, health: Health) -> NavState:
        need = UPD_AIR | UPD_ATT | UPD_GNSS | UPD_IMU | UPD_REL
        have = updated & ~failed_bits(health)
        c, o = self.core, self.out
        o.t_us = f.t_us
        c.w_air[:] = f.gyro_b
        if self.peer.t_us < 0 or o.peer_age_s > PEER_COAST_S:
            o.valid, o.reason = False, "waiting for the tanker's data link"
            return o
        if have & need != need or not f.rel_valid or c.take_air(f) == 0:
            o.valid, o.reason = False, "waiting for air data, attitude, GNSS, gyro and relative navigation"
            return o
        x, tk = c.ukf.x, self._tk
        self.peer.stage(f.t_us, tk)
        first_state(x, f, c.air, tk)
        c.start_factor()
        self.t_us = self.started_us = self.rel_us = f.t_us
        c.restart(f.t_us)
        self.witness.reset()
        o.valid = False
        self._rates(u, density(altitude(f)))
        self._publish(f, 0.0, 0)
        self.parts.start(f)
        if self.cmw is not None:
            self.cmw.reset()
        return o

    def _fuse(self, f: SensorFrame, u: np.ndarray, updated: int, fresh: bool, steered: bool) -> tuple[float, int]:
        """Queue what is new, and correct; NIS and how many rows were used."""
        c, p, tk, gate = self.core, self.core.p, self._tk, self.core.refusals
        given = self._given[OWN:]
        use, later = int(given[USE]), USE_ATT if self.aid is not None else 0
        c.m, air = 0, False
        if p.local_probes and use & USE_AIR:
            inertial_rates(c.ukf.x, self._R, tk, c.w_air)
            air = c.take_air(f) > 0
            if air:
                relative_aids.single_probes(c, f, self._d.tolist())
            use &= ~USE_AIR
        air = self._queue(use & ~later) or air
        if fresh and steered:
            seen_velocity(f, tk, self._e)
            self.peer.steer(np.array(f.gnss_vel_n) - self._e, (f.rel_t_us - self.rel_us) * 1e-6)
        self._stand_in(f, fresh and not (gate is not None and gate.held(rd.REL_POS)), bool(updated & UPD_GNSS))
        if use & later:
            self._queue(later)
        if c.m == 0:
            return 0.0, 0
        if self.cmw is not None and air:
            self.cmw.queue(c, relative_aids.calculated_wind(f, c.air, tk))
        if self.parts.colour.noise is not None:
            swing_floor(p, c.ukf.x, self.parts.colour.floor)
        nis = self.parts.correct(f, u)
        if fresh:
            self._seen(f)
        return nis, c.m

    def _queue(self, use: int) -> bool:
        """Queue the rows of the sensors in the mask `use` behind those there are; whether there were air data among them."""
        c = self.core
        self._given[BEFORE], self._given[OWN + USE] = c.m, use
        m, probes = relative_rows(
            self._given, c.tune, c.ukf.x, self._d, self._fm, self._R, self._Rn, self._tk, c.probe_pos, c.w_air, c.air, *c.rows
        )  # fmt: skip
        c.took(m, probes, UPD_AIR if use & USE_AIR else 0)
        return probes > 0

    def _seen(self, f: SensorFrame) -> None:
        """A new relative reading has been offered: whether it was taken."""
        gate = self.core.refusals
        if gate is None or gate.taken_now(rd.REL_POS):
            self.rel_us = f.rel_t_us

    def _stand_in(self, f: SensorFrame, trusted: bool, gnss: bool) -> None:
        """Wake position, and the GNSS difference while the relative sensor is silent or kept out (or to calibrate it)."""
        a, c = self.aid, self.core
        if a is None:
            return
        if self.fix is not None:
            a.wake(c, self.fix, self.R_ft, self.x_f)
        stale = not trusted and a.stale((f.t_us - self.rel_us) * 1e-6)
        if gnss and not self.peer.coasting and (trusted or stale):
            a.gnss(c, f, self._tks[TK_END, TK_DCM], self.peer.position(f.gnss_t_us), self._d[POS], trusted)
        if stale and self.rate_fix is not None:
            a.closure_rate(c, self.rate_fix)
