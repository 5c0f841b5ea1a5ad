"""Pictures of a wake that lies where it was flown, and of a follower's bow wave."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft, load_airframe
from sim_plant.kernels import layout as n
from sim_plant.wind.config import Wake
from sim_plant.wind.trail import AWAY, RING, Trail
from sim_plant.wind.vortex import wake_velocity
from sim_plant.wind.wake import bow_vector, source_vector

Arr = NDArray[np.float64]
V, DT, RHO, TANKER_KG, TAKER_KG = 195.0, 0.01, 0.59, 120e3, 5000.0
AT = (-36.0, 0.0, 8.5)  # [m] of a receiver in contact, tanker's axes


def record(name: str) -> Aircraft:
    """A six-DOF aircraft's file."""
    ac = load_airframe(name)
    assert isinstance(ac, Aircraft)
    return ac


def seen(mass_kg: float, bank: float = 0.0) -> Arr:
    """Observation of an aircraft that bears its weight in this bank [rad]."""
    obs = np.zeros(n.NO)
    obs[n.O_V], obs[n.O_RHO], obs[n.O_MASS], obs[n.O_LIFT] = V, RHO, mass_kg, mass_kg * n.G0 / math.cos(bank)
    return obs


def trail(cfg: Wake, bank: float = 0.0, gust: Arr | None = None) -> Trail:
    """The trail of a tanker after ten seconds in this bank, in gusts [RING, 3] if there are any."""
    src = source_vector(record("kc135r"), cfg.core_wing_m, cfg.core_tail_m, cfg.nu_m2ps, cfg.tail_lift_frac)
    t, s, obs, calm = Trail(cfg, src, DT), np.zeros(n.NS), seen(TANKER_KG, bank), np.zeros(3)
    rate = n.G0 * math.tan(bank) / V
    for k in range(RING):
        psi = rate * k * DT - 0.5 * math.pi
        cb, sb, cp, sp = (f(0.5 * x) for x in (bank, psi) for f in (math.cos, math.sin))
        s[0:4] = cb * cp, sb * cp, sb * sp, cb * sp
        s[n.S_V : n.S_V + 2] = V * math.cos(psi), V * math.sin(psi)
        if k:
            s[n.S_P : n.S_P + 2] += DT * s[n.S_V : n.S_V + 2]
            t.shed(s, obs, calm, calm if gust is None else gust[k])
        else:
            t.begin(s, obs, calm)
    return t


def wake(axes: list[Any]) -> None:
    """A flown wake from above in a turn, from the side in gusts, and its circulation against age (docs/air.md 7)."""
    turn = trail(Wake(path="flown", sink=False), math.radians(25.0))
    last = -0.5 * math.pi + n.G0 * math.tan(math.radians(25.0)) / V * (RING - 1) * DT
    ahead = np.array([math.cos(last), math.sin(last)])
    right = np.array([-ahead[1], ahead[0]])
    for leg in range(2):
        p = turn.nodes[leg, :9, :2]
        axes[0].plot(-(p @ ahead), p @ right, "C0", label=None if leg else "flown")
        axes[0].plot(AWAY[:9], np.full(9, p[0] @ right), "C1--", label=None if leg else "straight")
    axes[0].set(xlabel="behind [m]", ylabel="to the right [m]", title="25° of bank, from above")
    unit = np.random.default_rng(3).standard_normal(RING)
    slow = np.convolve(unit, np.exp(-np.arange(300) / 270.0))[:RING]
    gust = np.zeros((RING, 3))
    gust[:, 2] = 0.94 * slow / slow.std()
    words = (("sinks", 0.0), ("and drifts with light gusts", 1.0))
    for i, (word, share) in enumerate(words):
        t = trail(Wake(path="flown", meander=share), gust=gust)
        axes[1].plot(AWAY, t.nodes[0, :, 2], "C" + str(i), marker=".", label=word)
    axes[1].axvspan(30.0, 42.0, alpha=0.3, color="C2", label="contact")
    axes[1].set(xlabel="behind [m]", ylabel="below the cg [m]", title="Level, from the side", xlim=(0.0, 1900.0))
    axes[1].invert_yaxis()
    age = np.linspace(0.0, 120.0, 100)
    for edr in (1e-5, 1e-3, 1e-2):
        axes[2].plot(age, np.exp(-trail(Wake(path="flown", edr_m2ps3=edr)).fade * age), label=f"{edr:g} m²/s³")
    axes[2].set(xlabel="age [s]", title="Circulation left, by dissipation rate", ylim=(0.0, 1.05))
    for ax in axes:
        ax.legend(frameon=False)


def bow(axes: list[Any]) -> None:
    """Velocities in the plane of symmetry about a receiver in contact, and along the tanker's axis."""
    tanker, src, obs = record("kc135r"), bow_vector(record("learjet24"), 0.3, 0.0), seen(TAKER_KG)
    x, z = np.linspace(-48.0, 20.0, 137), np.linspace(-12.0, 12.0, 49)
    met = np.array([[wake_velocity(a - AT[0], 1e-9, b - AT[2], obs, src) for a in x.tolist()] for b in z.tolist()])
    size = np.hypot(met[:, :, 0], met[:, :, 2])
    lines = axes[0].contour(x, z, size, levels=[0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0], colors="0.55", linewidths=1.0)
    axes[0].clabel(lines, fmt="%g")
    step = (slice(None, None, 4), slice(None, None, 6))
    u, w = met[:, :, 0][step] / size[step], met[:, :, 2][step] / size[step]
    axes[0].quiver(x[step[1]], z[step[0]], u, w, angles="xy", scale=40.0, color="C0", width=0.003)
    for ac, at, colour in ((tanker, (0.0, 0.0), "C1"), (record("learjet24"), (AT[0], AT[2]), "C2")):
        for b in ac.structure.bars:
            axes[0].plot([at[0] + b[0], at[0] + b[3]], [at[1] + b[2], at[1] + b[5]], colour, lw=3, alpha=0.6)
    boom, hole = tanker.boom, record("learjet24").receptacle
    assert boom is not None and hole is not None
    tip = (AT[0] + hole.position_m[0], AT[2] + hole.position_m[2])
    axes[0].plot([boom.pivot_m[0], tip[0]], [boom.pivot_m[2], tip[1]], "C3", lw=2)
    axes[0].set(xlim=(-48.0, 20.0), ylim=(12.0, -12.0), xlabel="ahead of the tanker's cg [m]", ylabel="below it [m]")
    axes[0].set_title("Air moved by a receiver in contact [m/s]")
    share = np.linspace(0.0, 1.0, 60)
    along = [(1.0 - f) * np.array(boom.pivot_m)[[0, 2]] + f * np.array(tip) for f in share.tolist()]
    on = np.array([wake_velocity(p[0] - AT[0], 0.0, p[1] - AT[2], obs, src) for p in along])
    axes[1].semilogy(share, np.abs(on[:, 0]), label="forward, along the boom")
    axes[1].semilogy(share, np.abs(on[:, 2]), label="upward, along the boom")
    tail = tanker.wake.tail_ac_m
    at_tail = wake_velocity(tail[0] - AT[0], 0.0, tail[2] - AT[2], obs, src)
    wing = wake_velocity(-AT[0], 0.0, -AT[2], obs, src)
    for v, word, c in ((-at_tail[2], "upward at the tail", "C2"), (-wing[2], "upward at the wing's middle", "C3")):
        axes[1].axhline(v, ls="--", color=c, label=f"{word}: {v:.3f}")
    axes[1].set(
        ylim=(1e-3, 10.0),
        xlabel="share of the way from pivot to receptacle",
        title="Along the boom, and at the tanker [m/s]",
    )
    axes[1].legend(frameon=False)
