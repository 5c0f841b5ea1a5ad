"""Pictures of the plant's air for docs/air.md: what is drawn beside its closed form, by the code that flies."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hil_scripts.air import law as gustlaw
from hil_scripts.air.wakes import bow, wake
from hil_scripts.launch.plate import plates
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.wind.config import Dryden
from sim_plant.wind.extent import Filtered
from sim_plant.wind.forms import ShapedSeries
from sim_plant.wind.gusts import RING, Gusts
from sim_plant.wind.levels import FT, LENGTH_FT, LEVELS, SPECTRA, strength
from sim_plant.wind.prevailing import read_sounding
from sim_plant.wind.span import Across

Arr = NDArray[np.float64]
V, DT = 195.0, 0.01
TICKS = 200_000
SPANS = {"tanker": 39.88, "receiver": 10.36}  # [m]
ASCENTS = ("sounding_oun_20181222_12z_uwyo.txt", "sounding_oax_20140616_19z_spc.txt")


def bins(x: Arr, y: Arr | None = None) -> tuple[Arr, Arr]:
    """Angular frequencies [rad/s] and (cross) PSD per rad/s of columns [ticks], means over thirds of an octave."""
    from scipy.signal import csd

    f, p = csd(x, x if y is None else y, 1.0 / DT, nperseg=1 << 14, detrend=False)
    om, p = 2.0 * np.pi * f[3:], np.real(p[3:]) / (2.0 * np.pi)
    at = np.floor(3.0 * np.log2(om / om[0])).astype(np.int64)
    count = np.bincount(at)
    some = count > 0
    return np.bincount(at, om)[some] / count[some], np.bincount(at, p)[some] / count[some]


def levels(axes: list[Any]) -> None:
    """Intensity [m/s] and scale length [m] of the levels against height [m] (docs/air.md 1, 2)."""
    h = np.geomspace(3.0, 24e3, 600)
    for i, level in enumerate(LEVELS):
        both = [strength(level, "dryden", x) for x in h.tolist()]
        axes[0].plot([s[0] for s, _ in both], h, color=f"C{i}", label=level)
        axes[0].plot([s[2] for s, _ in both], h, ":", color=f"C{i}")
        s = strength(level, "dryden", 7010.0)[0][0]
        axes[0].annotate(f"{s:.2f}", (s, 7010.0), color=f"C{i}", xytext=(4, 2), textcoords="offset points")
        axes[0].plot(s, 7010.0, "o", color=f"C{i}", ms=4)
    for i, model in enumerate(SPECTRA):
        both = [strength("light", model, x) for x in h.tolist()]
        axes[1].plot([L[0] for _, L in both], h, color=f"C{i}", label=model)
        axes[1].plot([L[2] for _, L in both], h, ":", color=f"C{i}")
    axes[0].set(yscale="log", ylabel="height [m]", xlabel="1 sigma [m/s], u and v; dotted: w", title="Intensity")
    axes[1].set(yscale="log", xlabel="scale length [m], u and v; dotted: w", title="Length")
    for ax in axes:
        ax.legend(frameon=False)


def spectra() -> Callable[[list[Any]], None]:
    """What draws the spectra of u and w as flown beside their closed forms (docs/air.md 3)."""
    drawn = {}
    for model in SPECTRA:
        series = ShapedSeries(3, "picture", model, V, np.full(3, LENGTH_FT[model] * FT), DT, 1000)
        drawn[model] = np.concatenate([series.advance().copy() for _ in range(TICKS // 1000)])

    def draw(axes: list[Any]) -> None:
        for ax, axis in zip(axes, (0, 2), strict=True):
            for i, (model, x) in enumerate(drawn.items()):
                om, p = bins(x[:, axis])
                law = gustlaw.spectrum(model, axis, om, 1.0, LENGTH_FT[model] * FT, V)
                ax.loglog(om, law, color=f"C{i}", label=f"{model}, closed form")
                ax.loglog(om, p, ".", color=f"C{i}")
            ax.set(xlabel="frequency [rad/s]", title=f"PSD of {'uvw'[axis]}, 1 m/s [(m/s)² s/rad]")
            ax.legend(frameon=False)

    return draw


def turning() -> Callable[[list[Any]], None]:
    """What draws the spectra of rotational gusts beside those of MIL-F-8785C (docs/air.md 4)."""
    d = Dryden(sigma_mps=2.1, over="mil")
    drawn = {}
    for who, b in SPANS.items():
        g = Gusts("picture", d, 3, DT, 0, 7010.0)
        over, s, wind, out = Filtered(g, 3, who, b, V, DT), np.zeros(n.NS), np.zeros(n.NW), np.zeros((TICKS, 3))
        s[0] = 1.0
        for k in range(TICKS):
            g.lay((1.0, 0.0), k, 7010.0)
            wind[:] = 0.0
            over.turn(s, k, 0.0, wind, np.zeros((0, 3)))
            out[k] = wind[n.W_ROT :]
        drawn[who] = out

    def draw(axes: list[Any]) -> None:
        for ax, (who, x) in zip(axes, drawn.items(), strict=True):
            b = SPANS[who]
            for i, axis in enumerate((0, 2, 1)):
                om, p = bins(x[:, i])
                law = (
                    gustlaw.roll(om, 2.1, d.L_m, V, b)
                    if not i
                    else gustlaw.turning("dryden", axis, om, 2.1, d.L_m, V, b)
                )
                ax.loglog(om, law, color=f"C{i}", label=f"{'pqr'[i]}, MIL-F-8785C")
                ax.loglog(om, p, ".", color=f"C{i}")
            ax.set(xlabel="frequency [rad/s]", title=f"{who}, moderate [(rad/s)² s/rad]", ylim=(1e-8, None))
        axes[0].legend(frameon=False)

    return draw


def across() -> Callable[[list[Any]], None]:
    """What draws the coherence of lines side by side beside theory (docs/air.md 5)."""
    y = (0.0, 5.2, 14.1)
    drawn: dict[str, Arr] = {}
    for model in SPECTRA:
        g, rows = Gusts("picture", Dryden(sigma_mps=1.0, model=model, over="field"), 3, DT, 0, 7010.0, Across(y)), []
        for k in range(TICKS // RING * RING):
            g.lay((1.0, 0.0), k, 7010.0)
            if k % RING == RING - 1:
                rows.append(g.rings.transpose(1, 0, 2).copy())
        drawn[model] = np.concatenate(rows)

    def draw(axes: list[Any]) -> None:
        L = Dryden().L_m
        for ax, (model, x) in zip(axes, drawn.items(), strict=True):
            for i, side in enumerate(y[1:], 1):
                for axis, mark in ((0, "o"), (2, "s")):
                    om, p = (b[:-4] for b in bins(x[:, 0, axis]))  # the law is a quadrature: not up to the last
                    ax.semilogx(om, bins(x[:, 0, axis], x[:, i, axis])[1][:-4] / p, mark, color=f"C{i}", ms=3)
                    line = "-" if axis == 0 else "--"
                    label = f"{'uvw'[axis]}, {side:g} m apart"
                    ax.semilogx(om, gustlaw.coherence(model, axis, om, side, L, V), line, color=f"C{i}", label=label)
            ax.set(xlabel="frequency [rad/s]", title=f"Cross spectrum over spectrum, {model}")
        axes[0].legend(frameon=False)

    return draw


def density(axes: list[Any]) -> None:
    """How warm [K] two ascents are, and how much denser the standard believed on board is (docs/air.md 6)."""
    for i, name in enumerate(ASCENTS):
        a = read_sounding(name).air
        a = a[a[:, 0] < 14e3]
        t0 = np.array([isa(h)[0] for h in a[:, 0].tolist()])
        word = name.split("_")[1].upper() + " " + name.split("_")[2]
        axes[0].plot(a[:, 2] - t0, a[:, 0], color=f"C{i}", label=word)
        axes[1].plot(100.0 * (t0 / a[:, 2] - 1.0), a[:, 0], color=f"C{i}", label=word)
    axes[0].set(xlabel="warmer than the standard [K]", ylabel="height [m]", title="Temperature")
    axes[1].set(xlabel="denser than the standard believed on board [%]", title="Density")
    axes[1].legend(frameon=False)


def draw(out: Path) -> list[Path]:
    """All pictures of docs/air.md, both themes; the files written."""
    files = plates(out, "air-levels", levels) + plates(out, "air-spectra", spectra())
    files += plates(out, "air-turning", turning()) + plates(out, "air-across", across())
    files += plates(out, "air-wake", wake, 3, 13.0) + plates(out, "air-bow", bow)
    return files + plates(out, "air-density", density)
