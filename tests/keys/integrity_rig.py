"""Keys of [integrity]: drawn sources of relative position with everything that may befall them, through the bank in flight."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.integrity.integrity import Integrity
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.refuel import CONTACT, OBSERVATION, PRECONTACT
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.types import UPD_FIX, UPD_GNSS, UPD_REL, Health
from tests.unit.integrity_draws import DT, PLACES, Fault, WakeSeen, frames, slow


@dataclass(frozen=True)
class Scene:
    """So many seconds on the station of `phase`, under the limit of `judged`; gust [m/s^2]; told: the tanker's gains are heard;
    silent_s: nothing but the IMU from then on; wake: the air data tell the place in the wake."""

    seconds: float
    phase: int
    fault: Fault | None = None
    judged: int = -1
    gust: float = 0.0
    told: bool = True
    silent_s: float = np.inf
    wake: bool = False


SCENES = (
    Scene(12.0, CONTACT, gust=0.5),
    Scene(52.0, CONTACT, Fault("rel", walk=0.4, whole=True, at_s=8.0, until_s=14.0)),
    Scene(16.0, CONTACT, Fault("gnss", step=6.0, at_s=8.0)),
    Scene(30.0, PRECONTACT, Fault("gnss", walk=0.15, at_s=10.0), told=False),
    Scene(28.0, PRECONTACT, Fault("rel", off=True, at_s=10.0), silent_s=12.0),
    Scene(9.0, PRECONTACT, judged=OBSERVATION),
    Scene(20.0, PRECONTACT, silent_s=16.0, wake=True),
)


def _scene(seed: int, p: IntegrityParams) -> Iterator[Any]:
    """What is said of the position, who is left out, what is handed on, the reason to leave."""
    if not p.on:
        return
    s = SCENES[seed]
    bank = Integrity(p, load_aircraft("kc135r"), load_aircraft("learjet24"), s.wake)
    n = round(s.seconds / DT)
    t = np.arange(n) * DT
    true = PLACES[s.phase] + 0.3 * np.sin(t[:, None] * np.array([0.2, 0.25, 0.3]))
    gust = slow(np.random.default_rng((seed, 1)), n, 0.7, s.gust)
    peer, air = PeerTracker(), WakeSeen(seed)
    for i, (f, sample) in enumerate(frames(seed, true, s.phase, s.fault, gust, s.told)):
        if i % 2 == 0:
            peer.take(sample)
        if t[i] >= s.silent_s:
            f.updated &= ~(UPD_REL | UPD_GNSS | UPD_FIX)
            f.rel_valid = False
        told = air.rows(f.t_us, true[i]) if s.wake else None
        g, handed, _ = bank.step(f, f.updated, Health(), peer, s.phase if s.judged < 0 else s.judged, told)
        o = bank.out
        yield (o.pl, o.al, o.sigma, o.pos, o.ratio, o.used, o.excluded, o.undecided)
        yield (g.rel_pos_t, g.rel_vel_t, handed, bank.over, len(bank.texts))


INTEGRITY = tuple(partial(_scene, seed) for seed in range(len(SCENES)))
