"""True state of one aircraft, for the truth log, for judging, never for flightsw. The log has part of it: a row."""

from __future__ import annotations

from dataclasses import dataclass

from flightsw.types import Quat, Vec3
from sim_plant.aircraft.base import Member
from sim_plant.kernels import layout as n

Four = tuple[float, float, float, float]
Row = tuple[float, ...]  # values of a TRUTH message after its time, as the wire orders them


@dataclass(slots=True)
class Truth:
    """True state of one aircraft at a tick; units and frames as in flightsw.types."""

    t_us: int
    pos_n: Vec3
    vel_n: Vec3
    q_nb: Quat
    w_b: Vec3
    euler: Vec3  # [rad] psi, theta, phi
    acc_n: Vec3  # [m/s^2]
    wind_n: Vec3  # [m/s] effective translational wind
    wind_rot: Vec3  # [rad/s] effective rotational wind, body axes
    V: float
    beta: float
    alpha: float
    controls: Four  # aileron (flap of an aircraft without), elevator, rudder [rad], thrust [N]
    thrust_available: float
    xi: Vec3  # [m] cg in the leader's body axes (leader: zero)
    xi_dot: Vec3
    mass: float
    fuel_kg: float
    boom_elevation: float
    boom_azimuth: float
    boom_extension: float
    contact: bool
    inside: bool

    @property
    def row(self) -> Row:
        """What the log has of it."""
        return (
            *self.pos_n, *self.vel_n, *self.q_nb, *self.xi, *self.w_b, *self.wind_n, *self.wind_rot, self.V, self.beta,
            self.alpha, *self.controls, self.mass, self.boom_elevation, self.boom_azimuth, self.boom_extension,
            self.contact, self.inside,
        )  # fmt: skip


def vec3(x: list[float], at: int) -> Vec3:
    """Three entries of a list as a tuple."""
    return x[at], x[at + 1], x[at + 2]


def truth_of(m: Member, t_us: int) -> Truth:
    """Truth of a member whose view is that of time t_us [us]."""
    s, o, w = m.view.s, m.view.o, m.wind.tolist()
    own, boom = m.view.rel, m.view.boom
    return Truth(
        t_us=t_us,
        pos_n=vec3(s, n.S_P),
        vel_n=vec3(s, n.S_V),
        q_nb=(s[0], s[1], s[2], s[3]),
        w_b=vec3(s, n.S_W),
        euler=vec3(o, n.O_EULER),
        acc_n=vec3(o, n.O_ACC),
        wind_n=vec3(w, n.W_N),
        wind_rot=vec3(w, n.W_ROT),
        V=o[n.O_V],
        beta=o[n.O_BETA],
        alpha=o[n.O_ALPHA],
        controls=(s[n.S_SURF], s[n.S_SURF + 1], s[n.S_SURF + 2], s[n.S_T]),
        thrust_available=o[n.O_AVAIL],
        xi=vec3(own, n.R_XI),
        xi_dot=vec3(own, n.R_XIDOT),
        mass=o[n.O_MASS],
        fuel_kg=s[n.S_FUEL],
        boom_elevation=boom[n.R_EL],
        boom_azimuth=boom[n.R_AZ],
        boom_extension=boom[n.R_EXT],
        contact=m.view.contact,
        inside=m.view.inside,
    )


def row_of(m: Member) -> Row:
    """`Truth.row` of a member as its view is, the rest left out."""
    v = m.view
    s, o, boom, wind = v.s, v.o, v.boom, m.wind.tolist()
    return (
        *s[n.S_P : n.S_P + 3], *s[n.S_V : n.S_V + 3], *s[n.S_Q : n.S_Q + 4], *v.rel[n.R_XI : n.R_XI + 3],
        *s[n.S_W : n.S_W + 3], *wind[n.W_N : n.W_N + 3], *wind[n.W_ROT : n.W_ROT + 3], o[n.O_V], o[n.O_BETA], o[n.O_ALPHA],
        *s[n.S_SURF : n.S_SURF + 3], s[n.S_T], o[n.O_MASS], boom[n.R_EL], boom[n.R_AZ], boom[n.R_EXT], v.contact, v.inside,
    )  # fmt: skip
