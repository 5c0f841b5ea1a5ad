"""Figures of an estimate against the logged wind and the wind triangle, and of the filter against itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import welch
from scipy.stats import chi2

from hil_scripts.estimate.columns import Array, FlightLog
from hil_scripts.estimate.kinematic import KinematicParams
from hil_scripts.estimate.offline import CHANNELS, Track, implied_air, run, triangle
from hil_scripts.estimate.twin import SlowErrors, make

AXES = "ned"
PROBE = ("scale", "beta", "alpha")
SETTLE_S = 2.0  # [s] left out of every figure
Values = dict[str, float]


def _pair(out: Values, key: str, d: Array, sigma: Array | None, axes: str) -> None:
    """Statistics of a difference d [n,3] between two winds; sigma [n,3] of the first, where it has one."""
    for i, a in enumerate(AXES):
        if a in axes:
            out[f"{key}.{a}.mean"] = float(d[:, i].mean())
            out[f"{key}.{a}.rms"] = float(np.sqrt(np.mean(d[:, i] ** 2)))
            out[f"{key}.{a}.p95"] = float(np.percentile(np.abs(d[:, i]), 95))
            if sigma is not None:
                out[f"{key}.{a}.inside_3sigma"] = float(np.mean(np.abs(d[:, i]) <= 3.0 * sigma[:, i]))
    h = np.hypot(d[:, 0], d[:, 1])
    out[f"{key}.horizontal.rms"] = float(np.sqrt(np.mean(h**2)))
    out[f"{key}.horizontal.p95"] = float(np.percentile(h, 95))


def _mean_wind(out: Values, key: str, w: Array) -> None:
    for i, a in enumerate(AXES):
        out[f"{key}.{a}.mean"] = float(w[:, i].mean())
        out[f"{key}.{a}.std"] = float(w[:, i].std())
    n, e = float(w[:, 0].mean()), float(w[:, 1].mean())
    out[f"{key}.speed"] = float(np.hypot(n, e))
    out[f"{key}.from_rad"] = float(np.arctan2(-e, -n) % (2.0 * np.pi))


def _consistency(out: Values, tr: Track, keep: Array, vanes: tuple[bool, bool]) -> None:
    """Whiteness and normalised innovation squared with 95 % bands, over the samples at which all six channels came; of
    channels that were measured, not assumed."""
    z, e = tr.z[keep], tr.e[keep]
    ok = np.isfinite(z).all(axis=1)
    z, e = z[ok], e[ok]
    n = len(z)
    lags = np.arange(1, 26)
    out["innovation.n"] = float(n)
    out["innovation.lag_band95"] = float(1.96 / np.sqrt(n))
    measured = [True, *vanes, True, True, True]
    for i, name in enumerate(CHANNELS):
        if not measured[i]:
            continue
        x = z[:, i] - z[:, i].mean()
        ac = np.array([x[k:] @ x[:-k] / (x @ x) for k in lags])
        out[f"innovation.{name}.std"] = float(z[:, i].std())
        out[f"innovation.{name}.lag1"] = float(ac[0])
        out[f"innovation.{name}.lags_inside95"] = float(np.mean(np.abs(ac) <= 1.96 / np.sqrt(n)))
    # the factor is lower triangular with the air data first: its first three whitened entries are those of the air data alone
    sets = [("velocity", e[:, 3:], 3)]
    if all(vanes):
        sets += [("air", e[:, :3], 3), ("all", e, 6)]
    for name, x, dof in sets:
        s = (x**2).sum(axis=1)
        out[f"nis.{name}.mean"] = float(s.mean())
        out[f"nis.{name}.median"] = float(np.median(s))
        out[f"nis.{name}.band95_lo"] = float(chi2.ppf(0.025, dof * n) / n)
        out[f"nis.{name}.band95_hi"] = float(chi2.ppf(0.975, dof * n) / n)
        out[f"nis.{name}.inside95"] = float(np.mean((s >= chi2.ppf(0.025, dof)) & (s <= chi2.ppf(0.975, dof))))
    out["gate.softened_share"] = tr.softened / (6.0 * n)
    out["gate.refused_share"] = tr.refused / (6.0 * n)


LAG_MAX_S = 2.0  # [s] how far back the logged wind is looked for


def _delay(out: Values, log: FlightLog, wind: Array, keep: Array) -> Array:
    """By how much the logged horizontal wind lags the raw triangle `wind` [n,3]: shift of least RMS difference within 0 to
    LAG_MAX_S. Returns the logged wind [n,3] read that much later, not a number where the log is over; as logged where there is
    no such shift. The triangle judges, not an estimate: the same shift is then fair to all."""
    assert log.wind_n is not None
    dt = float(np.median(np.diff(log.t)))
    k = np.flatnonzero(keep)
    last = min(round(LAG_MAX_S / dt), len(k) // 4)
    shifts = dt * np.arange(last + 1)
    k = k[log.t[k] <= log.t[-1] - shifts[-1]]

    def later(by: float) -> Array:
        """The logged wind `by` seconds after every sample, held as it was logged."""
        assert log.wind_n is not None
        at = np.searchsorted(log.t, log.t + by + 1e-9, side="right") - 1
        return np.where((log.t + by <= log.t[-1] + 0.5 * dt)[:, None], log.wind_n[at], np.nan)

    ms = np.array([np.mean((later(float(s))[k, :2] - wind[k, :2]) ** 2, axis=0) for s in shifts])
    best = int(np.argmin(ms.sum(axis=1)))
    out["delay.found"] = float(best < last)
    if best == last:  # it only gets better: a wind that is slow, not late
        return log.wind_n
    out["delay.logged_s"] = round(float(shifts[best]), 6)
    for i in range(2):
        out[f"delay.{AXES[i]}.rms"] = float(np.sqrt(ms[best, i]))
        out[f"delay.{AXES[i]}.rms_undelayed"] = float(np.sqrt(ms[0, i]))
    return later(float(shifts[best]))


def spectra(log: FlightLog, winds: dict[str, Array]) -> dict[str, tuple[Array, Array]]:
    """One-sided power spectral densities of winds [n,3]: f [k] Hz, S [k,3] m^2/s^2/Hz; windows of 10 s, half overlapped."""
    dt = float(np.median(np.diff(log.t)))
    out = {}
    for name, w in winds.items():
        m = min(len(w), round(10.24 / dt))
        f, s = welch(w, 1.0 / dt, nperseg=m, axis=0, detrend="linear")
        out[name] = (f[1:], s[1:])
    return out


def _slopes(out: Values, psd: dict[str, tuple[Array, Array]]) -> None:
    for name, (f, s) in psd.items():
        for lo, hi, band in ((0.2, 2.0, "0p2_2hz"), (5.0, 20.0, "5_20hz")):
            k = (f >= lo) & (f <= hi)
            for i, a in enumerate(AXES):
                if k.sum() > 3 and float(s[k, i].min()) > 0.0:
                    out[f"spectrum.{name}.{a}.slope_{band}"] = float(np.polyfit(np.log(f[k]), np.log(s[k, i]), 1)[0])


def figures(log: FlightLog, tr: Track, read: Track, p: KinematicParams) -> Values:
    """All figures of a log; tr: estimate with probe errors, read: with the probe taken as it reads. Flat dotted keys, SI."""
    keep = (log.t - log.t[0] >= SETTLE_S) & np.isfinite(tr.wind).all(axis=1) & np.isfinite(read.wind).all(axis=1)
    fresh = log.fresh("airspeed") & log.fresh("beta") & log.fresh("alpha") & log.fresh("velocity")
    tri = np.where(fresh[:, None], triangle(log), np.nan)  # there is none of a reading that is frozen
    out: Values = {
        "log.samples": float(len(log)),
        "log.duration_s": float(log.t[-1] - log.t[0]),
        "log.step_s": float(np.median(np.diff(log.t))),
        "log.settle_s": SETTLE_S,
        "log.rows_skipped": float(len(log.skipped)),
        "estimate.valid_share": float(np.isfinite(tr.wind).all(axis=1).mean()),
    }
    for f in log.frozen:
        key = f"log.frozen.{f.sensor}_s"
        out[key] = out.get(key, 0.0) + f.end_s - f.start_s
    both = keep & fresh
    winds = {"estimate": tr.wind[keep], "as_read": read.wind[keep], "triangle": tri[both]}
    if log.wind_n is not None:
        winds["logged"] = log.wind_n[keep]
    for name, w in winds.items():
        _mean_wind(out, f"wind.{name}", w)
    for i, a in enumerate(AXES):
        out[f"wind.estimate.{a}.sigma_median"] = float(np.median(tr.sigma[keep, i]))
    _pair(out, "diff.estimate_triangle", (tr.wind - tri)[both], tr.sigma[both], AXES)
    _pair(out, "diff.as_read_triangle", (read.wind - tri)[both], None, AXES)
    if log.wind_n is not None:
        # an onboard estimate that is identically zero in the vertical is no estimate of it
        axes = AXES if float(np.ptp(log.wind_n[:, 2])) > 0.0 else "ne"
        caught_up = _delay(out, log, tri, both)
        for when, w in (("", caught_up), ("_undelayed", log.wind_n))[: 2 if out["delay.found"] else 1]:
            k = both & np.isfinite(w).all(axis=1)
            _pair(out, f"diff.estimate_logged{when}", (tr.wind - w)[k], tr.sigma[k], axes)
            _pair(out, f"diff.as_read_logged{when}", (read.wind - w)[k], None, axes)
            _pair(out, f"diff.triangle_logged{when}", (tri - w)[k], None, axes)
    for name, w in (("estimate", tr.wind), ("logged", log.wind_n)):
        if w is not None:
            d = (log.air - implied_air(log, w))[both]
            for i, c in enumerate(CHANNELS[:3]):
                if i and not log.vanes[i - 1]:
                    continue
                out[f"residual.{name}.{c}.mean"] = float(d[:, i].mean())
                out[f"residual.{name}.{c}.rms"] = float(np.sqrt(np.mean(d[:, i] ** 2)))
    _consistency(out, tr, keep, log.vanes)
    for i, name in enumerate(PROBE):
        prior = (p.probe_scale, p.probe_beta, p.probe_alpha)[i]
        out[f"probe.{name}.value"] = float(tr.probe[-1, i])
        out[f"probe.{name}.sigma"] = float(tr.probe_sigma[-1, i])
        out[f"probe.{name}.prior_sigma"] = prior
        out[f"probe.{name}.held"] = float(tr.held[i])
        out[f"probe.{name}.information_gained"] = float(tr.shown[i])
    _slopes(out, spectra(log, winds))
    return out


def without_probe(p: KinematicParams) -> KinematicParams:
    """The same tuning with the probe taken as it reads."""
    return replace(p, probe_scale=0.0, probe_beta=0.0, probe_alpha=0.0)


SHIFTS = (("scale", 0, 0.03), ("beta", 1, np.radians(1.0)), ("alpha", 2, np.radians(1.0)))


def sensitivity(log: FlightLog, tr: Track, read: Track, p: KinematicParams) -> Values:
    """RMS change of the wind estimate when the probe reads 3 % more, or 1 deg more: with probe errors estimated, and without."""
    out: Values = {}
    keep = log.t - log.t[0] >= SETTLE_S
    for name, i, by in SHIFTS:
        if i and not log.vanes[i - 1]:
            continue
        air = log.air.copy()
        air[:, i] = air[:, i] * (1.0 + by) if i == 0 else air[:, i] + by
        wrong = replace(log, air=air)
        for key, base, q in (("estimate", tr, p), ("as_read", read, without_probe(p))):
            d = (run(wrong, q).wind - base.wind)[keep]
            for a in range(3):
                out[f"shift.{name}.{key}.{AXES[a]}.rms"] = float(np.sqrt(np.nanmean(d[:, a] ** 2)))
        out[f"shift.{name}.by"] = float(by)
    return out


def twins(log: FlightLog, p: KinematicParams, n: int) -> Values:
    """Figures over n synthetic flights of each kind on the path of the log."""
    out: Values = {}
    keep = np.flatnonzero(log.t - log.t[0] >= SETTLE_S)
    for kind, slow in (("exact", None), ("like_log", SlowErrors())):
        rms, inside, nees, probe, pnees = [], [], [], [], []
        for seed in range(n):
            tw = make(log, p, seed, slow)
            tr = run(tw.log, p)
            d = tr.wind - tw.wind
            rms.append(np.mean(d[keep] ** 2, axis=0))
            inside.append(np.mean(np.abs(d[keep]) <= 3.0 * tr.sigma[keep]))
            e, P = np.concatenate([d[-1], tr.probe[-1] - tw.probe]), tr.P[-1]
            nees.append(e[:3] @ np.linalg.solve(P[:3, :3], e[:3]))
            pnees.append(e[3:] @ np.linalg.solve(P[3:, 3:], e[3:]))
            probe.append(np.concatenate([e[3:], tr.probe_sigma[-1], tw.probe]))
        ms, pr = np.array(rms), np.array(probe)
        for i, a in enumerate(AXES):
            out[f"twin.{kind}.{a}.rms"] = float(np.sqrt(ms[:, i].mean()))
            half = 1.96 * float(ms[:, i].std(ddof=1)) / np.sqrt(n)
            out[f"twin.{kind}.{a}.ci95_lo"] = float(np.sqrt(max(0.0, ms[:, i].mean() - half)))
            out[f"twin.{kind}.{a}.ci95_hi"] = float(np.sqrt(ms[:, i].mean() + half))
        out[f"twin.{kind}.n"] = float(n)
        out[f"twin.{kind}.inside_3sigma"] = float(np.mean(inside))
        out[f"twin.{kind}.nees_wind"] = float(np.mean(nees))
        out[f"twin.{kind}.nees_probe"] = float(np.mean(pnees))
        out[f"twin.{kind}.nees_band95_lo"] = float(chi2.ppf(0.025, 3 * n) / n)
        out[f"twin.{kind}.nees_band95_hi"] = float(chi2.ppf(0.975, 3 * n) / n)
        for i, name in enumerate(PROBE):
            out[f"twin.{kind}.probe_{name}.rms"] = float(np.sqrt(np.mean(pr[:, i] ** 2)))
            out[f"twin.{kind}.probe_{name}.sigma"] = float(np.sqrt(np.mean(pr[:, 3 + i] ** 2)))
            out[f"twin.{kind}.probe_{name}.untreated_rms"] = float(np.sqrt(np.mean(pr[:, 6 + i] ** 2)))
    return out
