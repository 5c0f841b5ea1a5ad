"""The receiver half of Lee (2011) flown as printed: section 6.6 at the contact point, in the plant, wake and turbulence.

The tanker flies on its true state (section 7.3.3), its estimator sends to the receiver's; readings are the true states and the
noise of Table 2.2, twenty a second, of the effective air data; the estimators' aerodynamics are the aircraft's own. The plant's
servos and engine lag stay: the printed law knows nothing of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.kernels.atmosphere import density
from flightsw.missions.tanker.racetrack import RacetrackGuidance, RacetrackParams
from flightsw.sixdof.actuators import ActuatorModel, surface_limits
from flightsw.sixdof.autopilot import TankerControl, TankerCtrlParams
from flightsw.sixdof.command import ScheduleParams
from flightsw.sixdof.layout import AIR, EULER, NX, POS, RATE, TK, TK_DCM, TK_RATE, TK_RATE_DOT, TK_VEL, WIND
from flightsw.sixdof.motion import air_velocity, free_rates, propagate_free, propagate_relative, relative_rates
from flightsw.sixdof.params import parameter_vector
from flightsw.types import ActuatorCmd, NavState, SensorFrame
from hil_scripts.studies.lee.closed_loop import CONTACT, LOST_M, SETTLE_S, dcm_of, relative_motion
from hil_scripts.studies.lee.filters import wind_figures
from hil_scripts.studies.lee.flight import DT, SMALL, TICKS, WINDS
from hil_scripts.studies.lee.printed_filter import Model, PrintedEstimator, Tune, dcm, free_wind, relative_wind, spread
from hil_scripts.studies.lee.printed_law import PrintedLaw, Weights
from sim_plant.rng import generator
from sim_plant.scenario import Scenario, load_scenario
from sim_plant.truth import Truth
from sim_plant.world import AircraftLostError, World

SPEED = 190.0  # [m/s]
MASSES = (5300.0, 119000.0)  # [kg] receiver's and tanker's, of the designs
N = 12
VELOCITY = 0.1  # [m/s] noise of inertial velocity and of xi', which are not in Table 2.2


@dataclass(frozen=True)
class Setting:
    """One flight. feedback: estimated, measured, true; wind: of flight.WINDS; G, tau_s: factor on the noise, and its colour."""

    feedback: str = "estimated"
    wind: str = "sounding"
    G: float = 1.0
    tau_s: float = 0.0
    sigma_mps: float = 0.39
    duration_s: float = 150.0
    turn_at_s: float = 0.0
    hand_over_s: float = (
        20.0  # true states before: the print's start is not told, and one reading at G = 7 throws it off at once
    )
    weights: Weights = field(default_factory=Weights)
    tune: Tune = field(default_factory=Tune)
    tanker_tune: Tune = field(default_factory=lambda: Tune(q_rate=1e-4, q_euler=1e-5, q_pos=1e-3))


def scenario(c: Setting) -> Scenario:
    """Tanker and receiver at the contact point, aerodynamics as the files have them."""
    base = load_scenario("refueling", {"meta.duration_s": c.duration_s, "link.actuator_delay_ticks": 0})
    tanker, receiver = (replace(a, aero_error_frac=0.0) for a in base.aircraft)
    tanker = replace(tanker, start=replace(tanker.start, V_mps=SPEED))
    receiver = replace(receiver, start=replace(receiver.start, xi_m=CONTACT))
    wind = WINDS[c.wind]
    # both start in steady flight: the law takes an airspeed off its nominal for a reason to leave the tanker
    wind = replace(wind, slow=replace(wind.slow, from_zero=True))
    wind = replace(wind, wake=base.wind.wake, dryden=replace(base.wind.dryden, sigma_mps=c.sigma_mps, V_mps=SPEED))
    return replace(base, aircraft=(tanker, receiver), wind=wind, event=())


class Tanker:
    """The tanker's control law on its true state."""

    def __init__(self, turn_at_s: float) -> None:
        ac = load_aircraft("kc135r")
        s = ScheduleParams(mass_kg=MASSES[1])
        self.ctrl = TankerControl(ac, TankerCtrlParams(s, w_input=(0.1, 0.1, 0.1, 2.0e4)), DT)
        self.guid = RacetrackGuidance(RacetrackParams(V_mps=SPEED, first_leg_s=turn_at_s or 1e5, leg_s=1e4))
        self.act = ActuatorModel(ac, 1)
        self.frame = SensorFrame()
        self.psi_dot, self.u = 0.0, np.zeros(4)

    def step(self, t: Truth, psi: float) -> ActuatorCmd:
        """The command for the next sample; psi [rad] unwrapped heading."""
        if not self.u.any():
            self.act.reset(np.array(t.controls[:3]), t.controls[3])
        euler = (psi, t.euler[1], t.euler[2])
        nav = NavState(
            valid=True, V=t.V, beta=t.beta, alpha=t.alpha, w_b=t.w_b, euler=euler, pos_n=t.pos_n, vel_n=t.vel_n
        )
        self.frame.t_us = t.t_us
        g = self.guid.step(self.frame, nav, DT)
        self.psi_dot = g.psi_dot
        self.u, throttle = self.ctrl.step(nav, g, self.act, DT)
        return ActuatorCmd(t.t_us, float(self.u[0]), float(self.u[1]), float(self.u[2]), throttle)


def stage(x: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """Tanker record tk [18] of its state x [15] and angular acceleration spin [3] rad/s^2."""
    tk = np.zeros(TK)
    R = dcm(x[EULER])
    tk[TK_DCM], tk[TK_RATE], tk[TK_RATE_DOT] = R.ravel(), x[RATE], spin
    tk[TK_VEL] = R.T @ np.array(air_velocity(*x[AIR])) + x[WIND]
    return tk


class Models:
    """Right-hand sides of both estimators for the controls that acted: (2.13) and, in the form of (6.5) and (6.12), (2.31)."""

    def __init__(self) -> None:
        self.ac = load_aircraft("kc135r"), load_aircraft("learjet24")
        self.rho = density(7010.0)
        self._tks = np.zeros((3, TK))
        self._w, self._R, self._fm = np.zeros((5, NX)), np.zeros(9), np.zeros(9)

    def _parameters(self, i: int, kg: float) -> np.ndarray:
        return parameter_vector(self.ac[i], kg)

    def tanker(self, u: np.ndarray, kg: float) -> Model:
        """u [4] mean controls of the step; kg mass."""
        P = self._parameters(0, kg)

        def rates(x: np.ndarray) -> np.ndarray:
            d = np.zeros(NX)
            free_rates(x, u, self.rho, P, self._R, self._fm, d)
            return d

        return Model(lambda X, dt: propagate_free(X, u, self.rho, P, dt, self._w), rates)

    def receiver(self, u: np.ndarray, kg: float, before: np.ndarray, after: np.ndarray) -> Model:
        """before, after [18]: the tanker at start and end of the step."""
        P, tks = self._parameters(1, kg), self._tks
        tks[0], tks[1], tks[2] = before, 0.5 * (before + after), after

        def rates(x: np.ndarray) -> np.ndarray:
            d = np.zeros(NX)
            relative_rates(x, u, self.rho, P, tks[2], self._R, self._fm, d)
            return d

        return Model(lambda X, dt: propagate_relative(X, u, self.rho, P, tks, dt, self._w), rates)


def noises(c: Setting, n: int, seed: int) -> np.ndarray:
    """Noise [n,30] of both aircraft: tanker's twelve states and velocity, receiver's twelve and xi'."""
    g = generator(seed % 2**31, "study.noise").standard_normal((n, 30))
    if c.tau_s > 0.0:
        e = math.exp(-DT / c.tau_s)
        for i in range(1, n):
            g[i] = e * g[i - 1] + math.sqrt(1.0 - e * e) * g[i]
    return g * c.G * np.concatenate((SMALL, SMALL))


def exact(t: Truth, r: Truth, psi: float) -> tuple[np.ndarray, np.ndarray]:
    """What noiseless sensors read [15] each: tanker's twelve states and velocity, receiver's relative ones and xi'."""
    y_t = np.array([t.V, t.beta, t.alpha, *t.w_b, psi, t.euler[1], t.euler[2], *t.pos_n, *t.vel_n])
    e, w = relative_motion(r.q_nb, dcm_of(t.q_nb), r.w_b, t.w_b)
    return y_t, np.array([r.V, r.beta, r.alpha, *w, *e, *r.xi, *r.xi_dot])


class Estimators:
    """Tanker's and receiver's, one after the other."""

    def __init__(self, c: Setting, y_t: np.ndarray, y_r: np.ndarray) -> None:
        """y_* [15]: what the sensors read at the start."""
        self.models = Models()
        s = SMALL * c.G
        one = spread(lambda z: free_wind(z[:N], z[N:]), y_t, s)
        both = spread(
            lambda z: relative_wind(z[15:27], z[27:], z[:N], z[N:15]), np.concatenate((y_t, y_r)), np.tile(s, 2)
        )
        self.t = PrintedEstimator(s[:N], one, c.tanker_tune, c.tau_s, True)
        self.r = PrintedEstimator(s[:N], both, c.tune, c.tau_s, False)
        self.t.start(y_t[:N], free_wind(y_t[:N], y_t[N:]))
        self.r.start(y_r[:N], relative_wind(y_r[:N], y_r[N:], y_t[:N], y_t[N:]))
        self.tk = stage(self.t.flt.x, np.zeros(3))

    def step(
        self, y_t: np.ndarray, y_r: np.ndarray, u: tuple[np.ndarray, np.ndarray], kg: tuple[float, float]
    ) -> np.ndarray:
        """Receiver's state [15] after the readings y_* [15]; u: mean controls [4] of tanker and receiver, kg their masses."""
        m = self.models.tanker(u[0], kg[0])
        x = self.t.step(m, y_t[:N], free_wind(y_t[:N], y_t[N:]), DT)
        tk = stage(x, m.rates(x)[RATE])
        m = self.models.receiver(u[1], kg[1], self.tk, tk)
        self.tk = tk
        return self.r.step(m, y_r[:N], relative_wind(y_r[:N], y_r[N:], y_t[:N], y_t[N:]), DT)


def within(u: np.ndarray, lim: np.ndarray, ac: Aircraft, available: float) -> np.ndarray:
    """u [4] inside what surfaces lim [3,3] and engine (available [N]) can do."""
    low = [*lim[:, 0], ac.engine.idle_frac * available]
    return np.clip(np.nan_to_num(u), low, [*lim[:, 1], available])


def fly(
    c: Setting, seed: int, watch: Callable[[float, np.ndarray], None] | None = None
) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """One run: figures as closed_loop.fly and traces at 20 Hz; `lost`, `lost_after_s`."""
    world = World(scenario(c), seed % 2**31)
    ac = load_aircraft("learjet24")
    lim, pilot = surface_limits(ac), Tanker(c.turn_at_s)
    law = PrintedLaw(ac, load_aircraft("kc135r"), MASSES, CONTACT, c.weights)
    v = noises(c, round(c.duration_s / DT) + 1, seed)
    est: Estimators | None = None
    rows: list[list[Any]] = []
    psi, lost, xi_c = 0.0, False, np.array(CONTACT)
    mean = [np.zeros(4), np.zeros(4)]
    world.sense()
    while not world.done:
        t, r = world.truth(0), world.truth(1)
        psi += math.remainder(t.euler[0] - psi, 2.0 * math.pi)
        y_t, y_r = exact(t, r, psi)
        truth, k = y_r[:N].copy(), len(rows)
        y_t, y_r = y_t + v[k, :15], y_r + v[k, 15:]
        if est is None:
            est = Estimators(c, y_t, y_r)
            x = est.r.flt.x
        else:
            x = est.step(y_t, y_r, (mean[0], mean[1]), (t.mass, r.mass))
        back = {"estimated": x[:N], "measured": y_r[:N], "true": truth}[
            c.feedback if t.t_us >= c.hand_over_s * 1e6 else "true"
        ]
        u = within(law.step(back, xi_c, pilot.psi_dot, SPEED, DT), lim, ac, r.thrust_available)
        rows.append([t.t_us * 1e-6, *r.xi, *r.wind_n, *x[WIND], *est.r.sigmas[WIND], *x[POS]])
        off = float(np.abs(np.array(r.xi) - xi_c).max())
        lost = not (off <= LOST_M and np.isfinite(x).all())
        if lost:
            break
        cmd = ActuatorCmd(t.t_us, float(u[0]), float(u[1]), float(u[2]), float(u[3] / r.thrust_available))
        try:
            _advance(world, [pilot.step(t, psi), cmd], pilot, mean)
        except AircraftLostError:
            lost = True
            break
    return figures(np.array(rows), lost)


def _advance(world: World, cmds: list[ActuatorCmd], pilot: Tanker, mean: list[np.ndarray]) -> None:
    """One sample on; mean [2][4] <- controls that acted."""
    acted = [np.array([world.truth(i).controls for i in (0, 1)])]
    for _ in range(TICKS):
        world.step(cmds)
        pilot.act.step(pilot.u, 0.01)
        world.sense()
        acted.append(np.array([world.truth(i).controls for i in (0, 1)]))
    mean[:] = list(np.trapezoid(acted, axis=0) / TICKS)


def figures(a: np.ndarray, lost: bool) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """Figures and traces of rows a [k,16]: time, xi, wind, estimated wind, its sigma, estimated xi."""
    t, xi = a[:, 0], a[:, 1:4] - np.array(CONTACT)
    out: dict[str, float] = {"lost": float(lost), "held_s": float(t[-1])}
    m = t >= SETTLE_S
    if not lost and m.any():
        for i, axis in enumerate("xyz"):
            e, d = xi[m, i], a[m, 13 + i] - a[m, 1 + i]
            out[f"contact.rms_m.{axis}"] = float(np.sqrt(np.mean(e * e)))
            out[f"contact.p95_m.{axis}"] = float(np.percentile(np.abs(e), 95))
            out[f"contact.max_m.{axis}"] = float(np.abs(e).max())
            out[f"estimate.rms_m.{axis}"] = float(np.sqrt(np.mean(d * d)))
        out |= wind_figures(t, a[:, 4:7], a[:, 7:10], a[:, 10:13], SETTLE_S)
    return out, {"t": t, "error": xi, "wind_true": a[:, 4:7], "wind": a[:, 7:10], "sigma": a[:, 10:13]}
