"""Figures of the gust report; each function returns the PNG's bytes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import signal

from ground.report.figures import SPARE, TRUTH, Array, new_figure, png_bytes

COLORS = {"printed": "#d1581b", "discrete": "#1f5fa8", "ekf": "#5b8c2a", "ekf_bank": "#7b4bb0", "hold": "#8b949e"}
COLORS |= {"default": "#1f5fa8", "vertical": "#5b8c2a", "true": "#20262e", "bank_all": "#7b4bb0", "bank": "#1a9a95"}
COLORS |= {"printed_joined": "#d1581b", "medium": "#d1581b", "light": "#1f5fa8"}
STATES = ((1, "alpha_W [deg]", 180.0 / np.pi), (2, "V_W [m/s]", 1.0), (8, "vane bias [deg]", 180.0 / np.pi))
TICK_S = 0.005  # of a_z in the campaigns


def shade(name: str, k: int = 0) -> str:
    """Colour of an estimator or loop."""
    return COLORS.get(name, SPARE[k % len(SPARE)])


def gains(computed: Array, printed: Array, other: Array) -> bytes:
    """Computed over printed gain of all entries with back-fitted (computed) and with printed noise (other)."""
    fig, axes = new_figure(13.2, 3.4, 1, 1)
    ax = axes[0, 0]
    x = np.arange(printed.size)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio, off = (computed / printed).ravel(), (other / printed).ravel()
    ax.axhspan(0.95, 1.05, color="#1b7a43", alpha=0.14, lw=0, label="within 5 %")
    ax.plot(
        x, np.clip(off, -0.2, 3.0), "s", ms=4, color="#d1581b", label="with the printed noise (beyond 3: on the rim)"
    )
    ax.plot(x, ratio, "o", ms=4.5, color="#1f5fa8", label="with the back-fitted noise")
    ax.set_ylim(-0.25, 3.05)
    columns = printed.shape[1]
    ax.set_xticks(x[::columns], [f"row {i + 1}" for i in range(printed.shape[0])], fontsize=8.5)
    ax.set_ylabel("computed / printed gain", fontsize=9.5)
    ax.legend(fontsize=8.5, frameon=False, ncols=3, loc="upper left")
    return png_bytes(fig)


def flight(tr: Mapping[str, Array], actors: Sequence[str], labels: Mapping[str, str]) -> bytes:
    """Truth and estimates of alpha_W, V_W and vane bias over time, and the errors with the last actor's 2 sigma."""
    fig, axes = new_figure(13.2, 7.2, 3, 2, sharex=True)
    t, truth = tr["t"], tr["truth"]
    for (column, name, factor), (left, right) in zip(STATES, axes, strict=True):
        for k, a in enumerate(actors):
            x = tr[f"{a}.x"][:, column] * factor
            left.plot(t, x, color=shade(a, k), lw=0.9, label=labels.get(a, a))
            right.plot(t, x - truth[:, column] * factor, color=shade(a, k), lw=0.8)
        last = actors[-1]
        s = 2.0 * tr[f"{last}.sigma"][:, column] * factor
        if np.isfinite(s).any():
            right.fill_between(t, -s, s, color=shade(last), alpha=0.16, lw=0)
        left.plot(t, truth[:, column] * factor, color=TRUTH, lw=1.0, label="truth")
        left.set_ylabel(name, fontsize=9.5)
        late = t > t[0] + 2.0
        errors = np.concatenate([(tr[f"{a}.x"][late, column] - truth[late, column]) * factor for a in actors])
        top = max(1.2 * float(np.percentile(np.abs(errors), 99.5)), 1e-3)
        right.set_ylim(-top, top)
    axes[0, 0].set_title("estimates", fontsize=10, loc="left")
    axes[0, 1].set_title(f"errors; band: 2 sigma of {labels.get(actors[-1], actors[-1])}", fontsize=10, loc="left")
    for ax in axes[-1]:
        ax.set_xlabel("time [s]", fontsize=9.5)
    axes[0, 0].legend(fontsize=8.5, frameon=False, ncols=4)
    return png_bytes(fig)


def loads(tr: Mapping[str, Array], actors: Sequence[str], labels: Mapping[str, str]) -> bytes:
    """a_z below 2 Hz over time, and the density of a_z over frequency, for each loop."""
    fig, axes = new_figure(13.2, 4.0, 1, 2, width_ratios=(1.5, 1.0))
    left, right = axes[0]
    sos = signal.butter(4, 2.0, fs=1.0 / TICK_S, output="sos")
    top = 0.1
    for k, a in enumerate(actors):
        az = tr[f"{a}.a_z"]
        t = np.arange(len(az)) * TICK_S
        low = signal.sosfiltfilt(sos, az)
        top = max(top, 1.1 * float(np.abs(low[t > 2.0]).max()))
        left.plot(t, low, color=shade(a, k), lw=1.1, label=labels.get(a, a))
        hz, density = signal.welch(az[round(2.0 / TICK_S) :], 1.0 / TICK_S, nperseg=min(2048, len(az) // 2))
        keep = (hz > 0.1) & (hz < 25.0)
        right.loglog(hz[keep], density[keep], color=shade(a, k), lw=1.1)
    right.axvline(2.0, color="#b3261e", lw=0.9, ls="--")
    left.set_ylim(-top, top)
    left.set(xlabel="time [s]", ylabel="a_z below 2 Hz [m/s²]", xlim=(2.0, min(22.0, float(t[-1]))))
    right.set(xlabel="frequency [Hz]", ylabel="density of a_z [(m/s²)²/Hz]")
    left.legend(fontsize=8.5, frameon=False, ncols=3)
    return png_bytes(fig)


def adaptation(tr: Mapping[str, Array], actors: Sequence[str], labels: Mapping[str, str]) -> bytes:
    """alpha_W error and the estimated intensity over time while the turbulence comes and goes."""
    fig, axes = new_figure(13.2, 4.6, 2, 1, sharex=True)
    t, truth = tr["t"], tr["truth"]
    for k, a in enumerate(actors):
        error = (tr[f"{a}.x"][:, 1] - truth[:, 1]) * 180.0 / np.pi
        axes[0, 0].plot(t, error, color=shade(a, k), lw=0.9, label=labels.get(a, a))
        axes[1, 0].semilogy(t, np.maximum(tr[f"{a}.scale"], 1e-3), color=shade(a, k), lw=1.1)
    axes[0, 0].set_ylim(-2.0, 2.0)
    axes[0, 0].set_ylabel("error of alpha_W [deg]", fontsize=9.5)
    axes[1, 0].set_ylabel("intensity / medium", fontsize=9.5)
    axes[1, 0].set_xlabel("time [s]", fontsize=9.5)
    axes[0, 0].legend(fontsize=8.5, frameon=False, ncols=4)
    return png_bytes(fig)
