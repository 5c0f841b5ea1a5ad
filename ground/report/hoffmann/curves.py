"""The print's own figures from our flights: five aircraft states (Fig. 6), errors as distributions (Fig. 8, 12), spectra of truth
and estimate (Fig. 9, 10, 13, 14). Each function returns the PNG's bytes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import signal

from ground.report.figures import TRUTH, Array, new_figure, png_bytes
from ground.report.hoffmann.figures import shade

DEG = 180.0 / np.pi
# state, reading, name, factor
AIRCRAFT = ((3, 0, "q [deg/s]", DEG), (4, 1, "alpha_K [deg]", DEG), (5, 2, "V_K [m/s]", 1.0),
            (6, 3, "Theta [deg]", DEG), (7, 4, "H [m]", 1.0))  # fmt: skip
ERRORS = ((1, "alpha_W [deg]", DEG), (2, "V_W [m/s]", 1.0), (8, "vane bias [deg]", DEG))
WIND = ((1, "alpha_W [deg²/Hz]", DEG), (2, "V_W [(m/s)²/Hz]", 1.0))
TRIM = (0.0, 0.0, 20.0, 0.0, 100.0)
DROP_S = 2.0
WINDOW = 512


def states(tr: Mapping[str, Array], name: str, label: str) -> bytes:
    """Fig. 6: the aircraft's states, what is measured of them (of alpha_K and V_K: alpha and V_A), and the estimate."""
    fig, axes = new_figure(13.2, 8.6, 5, 1, sharex=True)
    t = tr["t"]
    for (column, reading, text, factor), ax in zip(AIRCRAFT, axes[:, 0], strict=True):
        ax.plot(t, (tr["y"][:, reading] - TRIM[reading]) * factor, ".", ms=1.2, color="#b8c0cc", label="measured")
        ax.plot(t, tr[f"{name}.x"][:, column] * factor, color=shade(name), lw=0.9, label=label)
        ax.plot(t, tr["truth"][:, column] * factor, color=TRUTH, lw=0.9, label="truth")
        ax.set_ylabel(text, fontsize=8)
    axes[0, 0].legend(fontsize=8, frameon=False, ncols=3, loc="upper right")
    axes[-1, 0].set_xlabel("time [s]", fontsize=9)
    return png_bytes(fig)


def distributions(tr: Mapping[str, Array], names: Sequence[str], labels: Mapping[str, str]) -> bytes:
    """Fig. 8, 12: distribution of the errors of the states nobody measures, their mean and deviation in the legend."""
    fig, axes = new_figure(13.2, 3.8, 1, 3)
    late = tr["t"] >= DROP_S
    for (column, text, factor), ax in zip(ERRORS, axes[0], strict=True):
        for k, name in enumerate(names):
            e = (tr["truth"][late, column] - tr[f"{name}.x"][late, column]) * factor
            words = f"{labels.get(name, name)}: {e.mean():.2f}, {e.std():.2f}"
            ax.hist(e, bins=60, density=True, histtype="step", color=shade(name, k), label=words)
        ax.set_xlabel(f"error of {text}", fontsize=9)
        ax.legend(fontsize=7, frameon=False)
    return png_bytes(fig)


def spectra(tr: Mapping[str, Array], names: Sequence[str], labels: Mapping[str, str]) -> bytes:
    """Fig. 9, 10, 13, 14: power spectra of truth and estimates of alpha_W and V_W."""
    fig, axes = new_figure(13.2, 4.4, 1, 2)
    late = tr["t"] >= DROP_S
    rate = 1.0 / float(np.median(np.diff(tr["t"])))
    window = min(WINDOW, int(np.sum(late)))
    for (column, text, factor), ax in zip(WIND, axes[0], strict=True):
        for k, name in enumerate(names):
            f, power = signal.welch(tr[f"{name}.x"][late, column] * factor, rate, nperseg=window)
            ax.loglog(f[1:], power[1:], color=shade(name, k), lw=1.0, label=labels.get(name, name))
        f, power = signal.welch(tr["truth"][late, column] * factor, rate, nperseg=window)
        ax.loglog(f[1:], np.maximum(power[1:], 1e-12), color=TRUTH, lw=1.2, label="truth")
        ax.set_xlabel("frequency [Hz]", fontsize=9)
        ax.set_ylabel(text, fontsize=9)
        ax.legend(fontsize=8, frameon=False)
    return png_bytes(fig)
