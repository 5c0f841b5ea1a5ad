"""Figures of a closed-loop flight with air-data faults: position in the wake, station keeping, exclusions against the truth."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hil_scripts.studies.sevil.loop_flight import (
    BREAKAWAY,
    CONTACT,
    CONTACT_M,
    EVERY,
    OBSERVATION,
    TO_CONTACT,
    TO_PRECONTACT,
    VARIABLES,
    Track,
)

Arr = NDArray[np.float64]
Mask = NDArray[np.bool_]
SETTLE_S = 3.0  # in contact before samples count
FIRST_S = 2.0  # [s] of a flight before its monitor counts
BOX_M = 2.0  # [m] from the contact point in any axis
FAULTS = ("bias", "drift", "garbage", "scale", "stuck", "delayed", "intermittent", "off", "dropout", "spike")


def channels(e: dict[str, Any]) -> int:
    """9-bit mask (V, beta, alpha; probes 0..2 each) of the air-data channels an event concerns."""
    if e.get("sensor") != "air" or e["kind"] not in FAULTS:
        return 0
    probes = [e["index"]] if e.get("index", -1) >= 0 else range(3)
    variables = [VARIABLES.index(e["channel"])] if e.get("channel") else range(3)
    return sum(1 << (3 * v + p) for v in variables for p in probes)


def figures(tr: Track, events: tuple[dict[str, Any], ...]) -> dict[str, float]:
    """All figures of a flight whose faults are `events`; the window of the first event is the fault's."""
    contact = _settled(tr)
    away = np.flatnonzero(tr.phase == BREAKAWAY)
    out = {"breakaway": float(len(away) > 0), "contact.time_s": float(contact.sum()) * 0.01 * EVERY}
    out |= _position("contact.wake", tr, contact)
    out |= _station("contact", tr, contact)
    out["left_box"] = float(_excursion(tr, tr.mask(CONTACT)) > BOX_M)
    out |= _monitor(tr, events)
    if events:
        t0 = float(events[0]["t_s"])
        t1 = t0 + float(events[0].get("for_s", 0.0) or math.inf)
        fault = contact & (tr.t >= t0) & (tr.t < t1)
        out |= _position("fault.wake", tr, fault) | _station("fault", tr, fault)
        held = fault & tr.held
        out["held_s"] = float(held.sum()) * 0.01 * EVERY
        out |= _station("held", tr, held)
        if len(away):
            out["breakaway_s"] = float(tr.t[away[0]]) - t0
            out["breakaway_excursion_m"] = _excursion(tr, contact & (tr.t < tr.t[away[0]]))
    return out


def leg_figures(tr: Track) -> dict[str, float]:
    """Error of the wake position on every leg of the approach (sevil.md 8.3)."""
    y = np.abs(tr.ref[:, 1])
    approach = tr.phase == TO_PRECONTACT
    legs = {
        "observation": tr.mask(OBSERVATION, t0=10.0),
        "down": approach & (y > 56.0),
        "lateral": approach & (y <= 56.0) & (y > 0.3),
        "forward": (approach & (y <= 0.3)) | (tr.phase == TO_CONTACT),
        "contact": _settled(tr),
    }
    out: dict[str, float] = {}
    for name, m in legs.items():
        out |= _position(name, tr, m)
        if m.any():
            out[f"{name}.valid_pct"] = 100.0 * float(tr.valid[m].mean())
    return out | {"exclusions.wrong": _monitor(tr, ())["exclusions.wrong"]}


def _settled(tr: Track) -> Mask:
    since = np.flatnonzero(tr.phase == CONTACT)
    return tr.mask(CONTACT, t0=float(tr.t[since[0]]) + SETTLE_S) if len(since) else np.zeros(len(tr.t), dtype=bool)


def _rms(x: Arr) -> float:
    return float(np.sqrt(np.mean(x * x)))


def _position(name: str, tr: Track, m: Mask) -> dict[str, float]:
    """Wake position less truth, across the tanker's axes, whether or not it calls itself valid."""
    if not m.any():
        return {}
    d = (tr.wake - tr.xi)[m, 1:]
    r = np.hypot(d[:, 0], d[:, 1])
    return {
        f"{name}.rms_m.y": _rms(d[:, 0]), f"{name}.rms_m.z": _rms(d[:, 1]), f"{name}.rms_m.radial": _rms(r),
        f"{name}.p95_m": float(np.percentile(r, 95)), f"{name}.sigma_m": _rms(np.hypot(*tr.sigma[m].T)),
        f"{name}.nees": _nees(d, tr.sigma[m], tr.cov_yz[m]),
    }  # fmt: skip


def _nees(d: Arr, sigma: Arr, cov_yz: Arr) -> float:
    """Mean of d^T C^-1 d over errors d [n,2] with 1-sigma [n,2] and covariance [n] of both axes: 2 where C is right."""
    yy, zz = np.square(sigma).T
    (y, z), det = d.T, yy * zz - cov_yz * cov_yz
    return float(np.mean((zz * y * y - 2.0 * cov_yz * y * z + yy * z * z) / det)) if (det > 0.0).all() else math.nan


def _station(name: str, tr: Track, m: Mask) -> dict[str, float]:
    """True position less the reference, and less the estimate of the relative navigation."""
    if not m.any():
        return {}
    g, n = (tr.xi - tr.ref)[m], (tr.nav - tr.xi)[m]
    out = {f"{name}.station.rms_m.{a}": _rms(g[:, i]) for i, a in enumerate("xyz")}
    out |= {f"{name}.nav.rms_m.{a}": _rms(n[:, i]) for i, a in enumerate("xyz")}
    out[f"{name}.station.rms_m.all"] = _rms(np.linalg.norm(g, axis=1))
    out[f"{name}.station.max_m"] = float(np.abs(g).max())
    return out


def _excursion(tr: Track, m: Mask) -> float:
    """Largest distance [m] from the contact point in any axis."""
    return float(np.abs(tr.xi[m] - np.array(CONTACT_M)).max()) if m.any() else 0.0


def _monitor(tr: Track, events: tuple[dict[str, Any], ...]) -> dict[str, float]:
    """Exclusions: wrong ones, delay and duration of the right ones. A channel whose fault has ended counts as faulty until it
    is back."""
    bad = np.zeros(len(tr.t), dtype=np.int64)
    for e in events:
        t1 = e["t_s"] + (e.get("for_s") or math.inf)
        bad[(tr.t >= e["t_s"]) & (tr.t < t1)] |= channels(e)
    new = tr.excluded & ~np.concatenate([[0], tr.excluded[:-1]])
    wrong = right = 0
    for k in np.flatnonzero(new):
        ok = int(new[k] & bad[k])
        right += ok.bit_count()
        wrong += int(new[k]).bit_count() - ok.bit_count()
    out = {"exclusions.wrong": float(wrong), "false_exclusion": float(wrong > 0), "exclusions.right": float(right)}
    known = tr.t > FIRST_S
    shut = [_shut_out_pct(tr.excluded >> c & 1, bad >> c & 1, known) for c in range(9)]
    out["healthy_out_pct"] = max(shut)
    for v, name in enumerate(VARIABLES):
        sound = known & ((bad >> 3 * v) & 7 == 0)
        out[f"false_alarm_pct.{name}"] = 100.0 * float(np.mean(tr.alarm[sound] >> v & 1)) if sound.any() else math.nan
    mask = int(np.bitwise_or.reduce(bad))
    if mask:
        first, last = int(np.flatnonzero(bad)[0]), int(np.flatnonzero(bad)[-1])
        done = np.flatnonzero((tr.excluded[first : last + 1] & mask) == mask)
        out["isolated"] = float(len(done) > 0)
        if len(done):
            out["delay_samples"] = float(done[0] + 1)
            out["kept_out_pct"] = 100.0 * float(np.mean((tr.excluded[first + done[0] : last + 1] & mask) == mask))
        if last + 1 < len(tr.t):
            out["readmitted"] = float((tr.excluded[-1] & mask) == 0)
            back = np.flatnonzero((tr.excluded[last + 1 :] & mask) == 0)
            if len(back):
                out["readmit_s"] = float(back[0] + 1) * 0.01 * EVERY
    return out


def _shut_out_pct(out: NDArray[np.int64], faulty: NDArray[np.int64], known: Mask) -> float:
    """Share [%] of the time `known` in which a channel is `out` though sound; after a fault that counts from when it was back."""
    first = np.flatnonzero(faulty)
    if len(first):
        end = int(first[-1])
        back = np.flatnonzero(out[end:] == 0)
        faulty = faulty.copy()
        faulty[first[0] : end + (int(back[0]) if len(back) else len(out))] = 1
    return 100.0 * float(np.mean((out & ~faulty)[known]))
