"""Integrity of the relative position in flight: sources heard and left out, what stands in for the relative sensor, and whether
the phase may go on.

separation.md 5: a source that steps alone is left out at once (its readings leave the prediction of all while
the others' do not); one that walks off is left out only where two others bear it out; where nobody can tell, nobody is left out
and the receiver leaves.
"""

from __future__ import annotations

import math
from dataclasses import replace

from flightsw.aircraft import Aircraft
from flightsw.kernels.rotations import added, less
from flightsw.missions.receiver.airdata.witness import WakeRows
from flightsw.missions.receiver.integrity.bank import Bank
from flightsw.missions.receiver.integrity.flown import Flown
from flightsw.missions.receiver.integrity.horizon import Horizon
from flightsw.missions.receiver.integrity.layout import BOOM, GNSS, NAMES, REL, SOURCES, WAKE
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.integrity.readings import Readings
from flightsw.missions.receiver.integrity.report import IntegrityReport
from flightsw.missions.receiver.integrity.verdict import Verdict
from flightsw.missions.receiver.refuel import (
    CONTACT,
    DISCONNECT,
    HOLD,
    INIT,
    OBSERVATION,
    PRECONTACT,
    TO_CONTACT,
    TO_PRECONTACT,
)
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.sixdof.estimator_core import failed_bits
from flightsw.types import HF_REL, UPD_FIX, UPD_GNSS, UPD_REL, ZERO3, Health, NavState, SensorFrame, Text, Vec3, copied

CRITICAL, WARNING, NOTICE = 2, 4, 5  # MAV_SEVERITY
NEAR = (TO_PRECONTACT, PRECONTACT, TO_CONTACT, DISCONNECT, HOLD)  # phases held to the limit of closing in
CALM_S = 30.0  # [s] without a failed test until a disagreement is over
CALM = 0.7  # [-] of the thresholds
SUSPECT_S, SUSPECT_LEAD = 12.0, 10.0  # [s] of a dispute, [-] log-likelihood in which the suspect may become the other
WORD, WORD_S = 4.0, 2.0  # [-] log-likelihood by which the wake position bears somebody out, [s] it is given to do so
OTHERS_S = 0.5  # [s] within which another source must have been taken for a step to be the source's own


class Integrity:
    """The bank in flight. One `step` a navigation step, before the estimator."""

    def __init__(self, p: IntegrityParams, tanker: Aircraft, receiver: Aircraft, wake: bool = False) -> None:
        """wake: there are air data to tell the place in the wake."""
        self.p = p
        self.bank = Bank(p, reach(tanker), wake and p.wake is not False)
        self.rows, self.horizon = Readings(p, tanker, receiver), Horizon(p, self.bank)
        self._wake_number = -1  # of the rows it goes by
        self.out = IntegrityReport()
        self.texts: list[Text] = []
        self.excluded = self.undecided = 0
        self._heard = 0  # sources taken since the bank began
        self.suspect, self._disputed_s, self._word_s = -1, 0.0, WORD_S
        self.over = ""  # why the phase may not go on, "" if it may
        self.ready = False
        self._used_us = [-1] * SOURCES  # stamp of the last reading taken or refused,
        self._live_us = [-1] * SOURCES  # when one was last heard, taken or not,
        self._taken_us = [-1] * SOURCES  # and taken
        self._wild = [0] * SOURCES  # spikes in a row
        self._outs = [0] * SOURCES  # times left out
        self._agrees_us = [-1] * SOURCES  # since when a source left out agrees with the others
        self._wait_us = self._known_us = -1
        self._calm_s = self._over_s = 0.0
        self.rel_confirmed = True  # what is handed on is the sensor's or two others', and no source disputes it
        self._off = ZERO3  # [m] what is flown by less the bank
        self._flown = Flown()
        self._place: tuple[Vec3, Vec3] | None = None  # [m], [m/s] now by the sources not suspected; None: not known
        limits = ((OBSERVATION, p.al_observation_m), (CONTACT, p.al_latched_m), *((k, p.al_closing_m) for k in NEAR))
        self._limit = dict(limits)

    def publish(self, nav: NavState, rejoined: bool, unseen: bool) -> None:
        """Put into the estimate whether its relative position serves the phase, and the position of the bank with the sigma that
        has (separation.md 7). rejoined: the tanker's frame has jumped, begin anew in it; unseen: the estimate stands in a frame
        that the sensors do not see, and what the bank has of them is no place in it. What was left out stays so."""
        nav.rel_doubt = self.over
        self._off = ZERO3
        if rejoined or unseen or not (self.ready and nav.valid) or self._place is None:
            self._flown.forget()
        else:
            xi = self._flown.step(nav.t_us, nav.rel_pos_t, *self._place, self.out.used << SOURCES | self.suspect + 1)
            nav.pos_n = added(nav.pos_n, self.horizon.turned(less(xi, nav.rel_pos_t)))
            nav.rel_pos_t = xi
        if self.ready and nav.valid:
            x, y, z = self._off = less(nav.rel_pos_t, self.bank.xi)
            a, b, c = self.bank.sigma
            nav.rel_sigma = (math.hypot(x, a), math.hypot(y, b), math.hypot(z, c))
        self.ready &= not rejoined

    def step(
        self, f: SensorFrame, updated: int, health: Health, peer: PeerTracker, phase: int, wake: WakeRows | None = None
    ) -> tuple[SensorFrame, int, Health]:
        """Frame, what is new in it and health for the estimator: the relative reading less its estimated errors, or what is left
        of the sources in its place.

        updated: UPD_* of this step; peer: the tanker as of the last step; phase: of refuel.NAMES; wake: what the air data say.
        """
        al = self._limit.get(phase, math.inf)
        new = updated & ~failed_bits(health)
        dt = self.horizon.feel(f, new)
        if updated & UPD_GNSS:
            self.rows.own(f)
        if not self.ready:
            # until navigation is valid nobody flies the aircraft, and then it is caught first: no motion the bank expects
            self._wait_us = f.t_us if phase == INIT or self._wait_us < 0 else self._wait_us
            if (f.t_us - self._wait_us) * 1e-6 < self.p.settle_s or not (
                new & UPD_REL and f.rel_valid and not peer.coasting and peer.t_us > 0
            ):
                return f, updated, health
            self.horizon.start(f, peer, self.excluded)
            self._heard = 0
            self.ready = True
        self.horizon.advance(f.t_us, peer, self._live(f.t_us))
        self._listen(f, new, peer)
        self._listen_to_air(f.t_us, wake)
        live = self._live(f.t_us)
        verdict = self.bank.judge(live, self._heard & ~self.excluded)
        self._decide(verdict, live, dt)
        self._publish(f.t_us, verdict, live & ~self.excluded, al)
        self._rule(dt, al)
        self._suspect(dt)
        return self._feed(f, updated, health, live & ~self.excluded)

    # --- readings -----------------------------------------------------------------------------------------------------
    def _listen(self, f: SensorFrame, updated: int, peer: PeerTracker) -> None:
        used, linked, which = self._used_us, not peer.coasting, 0
        if updated & UPD_REL and f.rel_valid and f.rel_t_us > used[REL]:
            which |= 1 << REL
        if updated & UPD_FIX and linked and f.fix.t_us > used[GNSS]:
            which |= 1 << GNSS
        if f.boom_contact and linked and f.boom_t_us > used[BOOM] and self.rows.latches:
            which |= 1 << BOOM
        if which:
            excluded = self.excluded
            for source, t_us, k, off in self.horizon.offer(self.rows, which, f, peer):
                # one that is left out, or taken again, changes what is expected of the next
                self._take(source, t_us, k, off if self.excluded == excluded else self.horizon.surprise(k), f.t_us)
        if not f.boom_contact and self._live_us[BOOM] >= 0:
            self._live_us[BOOM] = self._taken_us[BOOM] = -1
            self.horizon.waiting.drop(BOOM)
            self.bank.unlatched()

    def _listen_to_air(self, now_us: int, wake: WakeRows | None) -> None:
        """The wake position; other rows have another lasting error, of which nothing is known."""
        if wake is None or self.bank.sources <= WAKE or wake.t_us <= self._used_us[WAKE]:
            return
        if wake.number != self._wake_number:
            self._wake_number = wake.number
            self.horizon.waiting.drop(WAKE)
            self.bank.wake_anew(wake.lasting)
        k = self.rows.wake(wake, self.horizon.waiting)
        self._take(WAKE, wake.t_us, k, self.horizon.surprise(k), now_us)

    def _take(self, source: int, t_us: int, k: int, off: float, now_us: int) -> None:
        """Let the reading at place k, of t_us, wait for the bank; one that is `off` what is expected at its time, in its sigmas,
        by far is a spike until it repeats itself."""
        self._used_us[source], self._live_us[source] = t_us, now_us
        if self.excluded >> source & 1:
            self._hear_again(source, off, now_us)
            return
        if off > self.p.gate:
            self._wild[source] += 1
            if self._wild[source] <= self.p.spikes or self._steps_alone(source, now_us):
                return
        else:
            self._wild[source] = 0
        self._taken_us[source] = now_us
        self._heard |= 1 << source
        self.horizon.waiting.wait(k)

    def _hear_again(self, k: int, off: float, now_us: int) -> None:
        """A source left out comes back by agreeing with the others for long, never by lasting; one left out twice stays out."""
        agrees = bool(self._live(now_us)) and off < self.p.again_sigma
        if not agrees or self._agrees_us[k] < 0:
            self._agrees_us[k] = now_us if agrees else -1
        elif self._outs[k] < 2 and (now_us - self._agrees_us[k]) * 1e-6 >= self.p.again_s:
            self.excluded &= ~(1 << k)
            self._wild[k] = 0
            self.bank.take_again(k)
            self.texts.append(Text(NOTICE, f"{NAMES[k]} taken again"))

    def _steps_alone(self, source: int, now_us: int) -> bool:
        """Whether a source that leaves the prediction does so while another, heard now, does not: then it is left out."""
        # the wake position tells nothing along the tanker's path: it bears nobody out by itself
        others = [k for k in (REL, GNSS, BOOM) if k != source and not self.excluded >> k & 1]
        sound = [k for k in others if self._taken_us[k] >= 0 and self._wild[k] == 0]
        heard = any((now_us - self._taken_us[k]) * 1e-6 < OTHERS_S for k in sound)
        if self.undecided or not (heard and self.horizon.felt):
            return False  # in a dispute, and without the own accelerations, the prediction may be what is wrong
        self._leave_out(source, self.bank.oldest(0), "stepped away from the others")
        return True

    def _live(self, now_us: int) -> int:
        """Sources heard of late and not left out, as a mask."""
        live, live_s = 0, self.p.live_s
        for k, taken_us in enumerate(self._taken_us):
            if taken_us >= 0 and (now_us - taken_us) * 1e-6 < live_s:
                live |= 1 << k
        return live & ~self.excluded

    # --- who is wrong -------------------------------------------------------------------------------------------------
    def _leave_out(self, source: int, slot: int, why: str) -> None:
        self.excluded |= 1 << source
        self._outs[source] += 1
        self._agrees_us[source] = -1
        self.undecided = 0
        self.bank.exclude(source, slot)
        self.horizon.waiting.drop(source)
        self.texts.append(Text(WARNING, f"{NAMES[source]} left out: {why}"))

    def _decide(self, v: Verdict, live: int, dt: float) -> None:
        if not v.disagree:
            self._calm_s = self._calm_s + dt if max(v.ratio) < CALM else 0.0
            if self.undecided and self._calm_s > CALM_S:
                self.undecided = 0
                self.texts.append(Text(NOTICE, "sources of position agree again"))
            return
        self._calm_s = 0.0
        if v.blamed >= 0 and self._witnesses(v, live) >= 3:
            self._leave_out(v.blamed, v.slot, "walks away from the others")
        elif not self.undecided:
            self.undecided, self._disputed_s = live, 0.0
            full = [k for k in range(WAKE) if live >> k & 1]
            self._word_s = 0.0 if len(full) == 2 and self.bank.along(*full) else WORD_S
            names = ", ".join(NAMES[k] for k in range(SOURCES) if live >> k & 1)
            self.texts.append(Text(WARNING, f"{names} disagree"))

    def _witnesses(self, v: Verdict, live: int) -> int:
        """Sources live; the wake position, which is slow to tell and does not tell what is along the tanker's path, is one only
        where its own readings say who is wrong."""
        mute = live >> WAKE & 1 and v.blamed != WAKE and self.bank.borne_out(v.blamed, v.slot, live) < WORD
        return live.bit_count() - int(mute)

    @property
    def _two(self) -> int:
        """The two in dispute, as a mask, where nobody can tell who of them is wrong; 0: among three the bound covers it."""
        if not self.undecided:
            return 0
        full = self.undecided & ~(1 << WAKE)
        if self.undecided.bit_count() == 2:
            return self.undecided
        return full if full.bit_count() == 2 and self._disputed_s > self._word_s else 0

    def _suspect(self, dt: float) -> None:
        """Of two in dispute, the one more likely to be wrong: not left out, but not flown by while the receiver leaves."""
        self._disputed_s += dt
        mask = self._two
        if not mask:
            self.suspect = -1
            return
        two = [k for k in range(SOURCES) if mask >> k & 1]
        lead = self.bank.more_likely(*two)
        if (
            self._disputed_s < SUSPECT_S and abs(lead) > SUSPECT_LEAD
        ):  # later the forks have begun in the dispute themselves
            self.suspect = two[0] if lead > 0.0 else two[1]

    # --- what is done -------------------------------------------------------------------------------------------------
    def _publish(self, t_us: int, v: Verdict, live: int, al: float) -> None:
        o = self.out
        o.t_us, o.pl, o.al, o.sigma, o.pos = t_us, v.pl, (al, al, al), self.bank.sigma, self.bank.xi
        o.used, o.excluded, o.undecided, o.ratio = live, self.excluded, self.undecided, v.ratio

    def _rule(self, dt: float, al: float) -> None:
        """Whether the phase may go on: its limit not passed for long, and no dispute that nobody can ever settle."""
        (x, y, z), (a, b, c) = self.out.pl, self._off
        worst = max(x + abs(a), y + abs(b), z + abs(c))
        self._over_s = self._over_s + dt if worst > al else 0.0
        if self._two and math.isfinite(al):
            self.over = "two sources of position disagree"
        elif self._over_s > self.p.over_s:
            self.over = (
                f"position bound {worst:.1f} m, allowed {al:g}" if math.isfinite(worst) else "no bound on the position"
            )
        else:
            self.over = ""

    def _feed(self, f: SensorFrame, updated: int, health: Health, live: int) -> tuple[SensorFrame, int, Health]:
        """The relative reading without its estimated errors; the bank's position where it is silent or left out, carried on by
        specific force for a while where nothing is left."""
        own = (f.t_us - self._live_us[REL]) * 1e-6 <= self.p.stand_in_s
        by_itself = bool(live >> REL & 1) and own and not self._wild[REL]
        all_axes = live & ~(1 << WAKE)  # sources that tell of
        self.rel_confirmed = not self.undecided and (by_itself or all_axes.bit_count() > 1)
        m = 1 + self.suspect  # the filter that has not heard it; 0 without one
        if self.excluded >> GNSS & 1 or self.suspect == GNSS:
            updated &= ~UPD_GNSS  # whose of the two it is nobody knows: the estimator does not fly by its own either
        if all_axes:
            self._known_us = f.t_us
        # without a source it goes by the own accelerations; without those too the estimator's model knows more
        longest = self.p.coast_s if self.horizon.felt else self.p.live_s
        self._place = None if (f.t_us - self._known_us) * 1e-6 > longest else self.horizon.place(m)
        if live >> REL & 1 and self.suspect != REL and own:
            if updated & UPD_REL and f.rel_valid:
                if self._wild[REL] and not self.undecided:  # a spike; in a dispute it may be filter 0 that is off
                    return f, updated & ~UPD_REL, health
                pos, vel = self.bank.relative_error(m)
                g = copied(f)
                g.rel_pos_t, g.rel_vel_t = less(f.rel_pos_t, pos), less(f.rel_vel_t, vel)
                return g, updated, health
            return f, updated, health
        if self._place is None:
            return f, updated & ~UPD_REL if self.excluded >> REL & 1 else updated, health
        xi, rate = self._place
        g = copied(f)
        g.rel_t_us, g.rel_valid, g.rel_pos_t, g.rel_vel_t, g.updated = f.t_us, True, xi, rate, f.updated | UPD_REL
        return g, updated | UPD_REL, replace(health, failed=health.failed & ~HF_REL)


def reach(tanker: Aircraft) -> tuple[float, float]:
    """Length [m] and elevation [rad] of the boom in mid-envelope, 0 without one."""
    boom = tanker.boom
    if boom is None:
        return 0.0, 0.0
    return boom.length_retracted_m + 0.5 * sum(boom.extension_m), math.radians(0.5 * sum(boom.elevation_deg))
