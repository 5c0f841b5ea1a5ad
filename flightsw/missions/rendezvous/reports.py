"""What a rendezvous has to say on the wire: the receiver's track, the turn planned on it, the estimator's components."""

from __future__ import annotations

from dataclasses import dataclass

from flightsw.missions.base import Packets, report
from flightsw.types import ZERO3, Vec3


@dataclass(slots=True)
class RendezvousState:
    """Estimate of a receiver to be met, and the turn planned on it. Rendezvous frame R (missions/rendezvous/frame.py), SI:
    x to the initial point, y and psi counter-clockwise, bank positive LEFT."""

    t_us: int = 0
    valid: bool = False
    reason: str = "no range yet"
    mean: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # x, v_x, y, v_y over ground
    cov: tuple[float, ...] = (0.0,) * 10  # of mean: upper triangle row by row
    own: Vec3 = ZERO3  # [m, m, rad] x, y, course through the air (unwrapped) of the own aircraft
    bank: float = 0.0  # [rad]
    bank_cmd: float = 0.0  # [rad]
    speed_cmd: float = 0.0  # [m/s]
    time_to_go_s: float = 0.0  # to the start of the turn; 1e9: not known to come
    turn_time_s: float = 0.0  # from now to wings level
    miss: tuple[float, float] = (0.0, 0.0)  # [m] x_m, y_m predicted for the roll-out
    radii: tuple[float, float] = (0.0, 0.0)  # [m] of the two arcs planned, 0: none
    final_psi: float = 0.0  # [rad]
    estimator: int = 0  # index in params.ESTIMATORS
    law: int = 0  # index in guidance.LAWS
    phase: int = 0  # index in guidance.PHASES
    limited: bool = False
    range_m: float = 0.0  # last slant range
    range_age_s: float = 1e9
    innovation_m: float = 0.0
    nis: float = 0.0
    window_nis: float = 0.0
    window_drift: float = 0.0
    alarm: bool = False
    updates: int = 0
    refused: int = 0
    frame: Vec3 = ZERO3  # [m, m, rad] north, east of the control point, heading of +x
    fix_us: int = 0  # time the components belong to
    weights: tuple[float, ...] = ()  # of the estimator's components
    xs: tuple[float, ...] = ()  # [m] where they are
    ys: tuple[float, ...] = ()


CLOUD_PART, CLOUD_PARTS = 16, 4  # components in a RENDEZVOUS_CLOUD, messages at most


def state_values(r: RendezvousState) -> Packets:
    """Fields of RENDEZVOUS_STATE."""
    yield (
        r.t_us, *r.mean, *r.cov, *r.own, r.bank, r.bank_cmd, r.speed_cmd, r.time_to_go_s, r.turn_time_s, *r.miss, *r.radii,
        r.final_psi, r.range_m, r.range_age_s, r.innovation_m, r.nis, r.window_nis, r.window_drift, *r.frame,
        min(r.updates, 0xFFFF), min(r.refused, 0xFFFF), r.estimator, r.law, r.phase, 1 if r.limited else 0,
        1 if r.alarm else 0, 1 if r.valid else 0,
    )  # fmt: skip


def cloud_values(r: RendezvousState) -> Packets:
    """Fields of RENDEZVOUS_CLOUD, part after part; the heaviest components where there are more than fit."""
    w = r.weights
    keep = list(range(len(w)))
    if len(w) > CLOUD_PART * CLOUD_PARTS:
        keep = sorted(sorted(keep, key=lambda i: -w[i])[: CLOUD_PART * CLOUD_PARTS])
    parts = -(-len(keep) // CLOUD_PART)
    for k in range(parts):
        at = keep[k * CLOUD_PART : (k + 1) * CLOUD_PART]
        pad = (0.0,) * (CLOUD_PART - len(at))
        rows = [x for v in (r.xs, r.ys, w) for x in (*(v[i] for i in at), *pad)]
        yield (r.fix_us, *rows, k, parts, len(at))


REPORTS = (
    report("RENDEZVOUS_STATE", RendezvousState, state_values, rate_hz=2.0, offset=1),
    report("RENDEZVOUS_CLOUD", RendezvousState, cloud_values, rate_hz=0.5, offset=3),
)
