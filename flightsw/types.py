"""Port types: what crosses the boundary between onboard components, and between codec and application.

SI and radians. `_n` = north-east-down navigation axes, `_b` = body axes (forward-right-down) of the aircraft
concerned, `q_nb` = Hamilton quaternion, scalar first, rotating body vectors into `_n`. `t_us` = sample time [us].
Plain tuples and floats: they are cheap to fill from the wire 100 times a second, and the estimators copy them into
their own arrays. NaN never stands for "invalid" here: validity is a mask, a flag or an age.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from operator import attrgetter
from typing import NamedTuple, Protocol, TypeVar

from flightsw.terms import Laws

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
R = TypeVar("R")

ZERO3: Vec3 = (0.0, 0.0, 0.0)
IDENTITY_Q: Quat = (1.0, 0.0, 0.0, 0.0)

# SensorFrame.updated bits: which groups carry a new sample in this tick
UPD_IMU = 1
UPD_BARO = 2
UPD_MAG = 4
UPD_GNSS = 8
UPD_AIR = 16
UPD_ATT = 32
UPD_REL = 64
UPD_FUEL = 128
UPD_BOOM = 256
UPD_PEER = 512
UPD_TACAN = 1024
UPD_RADAR = 2048
UPD_RADALT = 4096
UPD_FIX = 8192
UPD_BEARING = 16384
UPD_POSITION = 32768


@dataclass(slots=True)
class PeerState:
    """State estimate of another aircraft as received over the data link (sample time is the sender's)."""

    t_us: int = 0
    pos_n: Vec3 = ZERO3  # [m] local navigation frame
    vel_n: Vec3 = ZERO3  # [m/s] inertial velocity
    acc_n: Vec3 = ZERO3  # [m/s^2] inertial acceleration
    q_nb: Quat = IDENTITY_Q  # [-]
    w_b: Vec3 = ZERO3  # [rad/s] body rates
    wind_n: Vec3 = ZERO3  # [m/s] the sender's wind estimate
    wind_valid: bool = False
    pos_sigma: Vec3 = ZERO3  # [m] the sender's 1-sigma of pos_n
    flags: int = 0  # HF_* of the sender


class Gain(NamedTuple):
    """Velocity an aircraft's accelerometers gained, gravity included, in the time `span_s` [s] that ended at t_us."""

    t_us: int = 0
    span_s: float = 0.0  # [s] 0: nothing known
    vel_n: Vec3 = ZERO3  # [m/s] NED


NO_GAIN = Gain()


@dataclass(slots=True)
class PeerFix:
    """What another aircraft measured (not its estimate): its GNSS fix as its receiver gave it, with the time of the sample, and
    the velocity gained by its accelerometers."""

    t_us: int = 0
    pos_n: Vec3 = ZERO3  # [m] local navigation frame
    vel_n: Vec3 = ZERO3  # [m/s]
    # 1-sigma as the receiver states it; 0: it states none
    pos_sigma: Vec3 = ZERO3  # [m] NED
    vel_sigma: Vec3 = ZERO3  # [m/s] NED
    gain: Gain = NO_GAIN


# MAV_RESULT
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED = 0, 1, 2, 3


@dataclass(slots=True)
class Command:
    """A MAVLink command as received, before it is accepted or refused."""

    command: int  # MAV_CMD
    params: tuple[float, ...]  # param1..param7
    src_system: int
    src_component: int
    confirmation: int = 0

    def choice(self, names: Mapping[int, str], what: str) -> tuple[int, str]:
        """param1 as one of the whole numbers `names`, and ""; any other value (3.7, NaN): -1 and why it is refused."""
        p = self.params[0]
        if p in names:  # false for NaN; 3.0 is 3
            return int(p), ""
        allowed = ", ".join(f"{k} {n}" for k, n in names.items())
        return -1, f"{what} {p:g}: allowed {allowed}"


@dataclass(frozen=True, slots=True)
class Setting:
    """A parameter the ground wants changed: key of the flight file, value of its type and within its limits, who asks."""

    key: str
    value: float | int | bool | str
    src_system: int = 0
    src_component: int = 0


@dataclass(frozen=True, slots=True)
class Settled:
    """What became of a Setting: "" it is in force, else why it is not."""

    setting: Setting
    why: str = ""


@dataclass(slots=True)
class SensorFrame:
    """One tick's sensor intake. Groups keep their last value; `updated` says which are new this tick."""

    t_us: int = 0
    updated: int = 0
    # IMU, 100 Hz
    gyro_b: Vec3 = ZERO3  # [rad/s]
    gyro_mean_b: Vec3 = (
        ZERO3  # [rad/s] mean of the good samples since the last navigation step (filled by the application)
    )
    gyro_count: int = 0  # how many; 0: none
    gyro_age_s: float = 0.0  # [s] age of the middle of that window
    acc_mean_b: Vec3 = ZERO3  # [m/s^2] mean specific force over the same window
    acc_b: Vec3 = ZERO3  # [m/s^2] specific force (level and still: -9.81 on z)
    mag_b: Vec3 = ZERO3  # [gauss]
    pressure_pa: float = 0.0  # [Pa] static
    baro_alt_m: float = 0.0  # [m] pressure altitude, positive up
    # GNSS
    gnss_t_us: int = 0
    gnss_pos_n: Vec3 = ZERO3  # [m] in the local navigation frame
    gnss_vel_n: Vec3 = ZERO3  # [m/s]
    # air data, N probes
    air_t_us: int = 0
    air_mask: int = 0  # bit i: probe i valid
    air_bad: int = 0  # bit 3 variable + probe (V, beta, alpha): reading refused, by its range or by fault detection
    air_V: tuple[float, ...] = ()  # [m/s] true airspeed at the probe
    air_alpha: tuple[float, ...] = ()  # [rad]
    air_beta: tuple[float, ...] = ()  # [rad]
    # attitude reference
    att_t_us: int = 0
    att_q_nb: Quat = IDENTITY_Q
    # relative navigation: own position in the tanker's body axes
    rel_t_us: int = 0
    rel_valid: bool = False
    rel_pos_t: Vec3 = ZERO3  # [m] xi, tanker body axes
    rel_vel_t: Vec3 = ZERO3  # [m/s] d(xi)/dt, tanker body axes
    # fuel gauge, boom signal
    fuel_t_us: int = 0
    fuel_kg: float = 0.0
    fuel_flow_kgps: float = 0.0  # + = receiving
    boom_t_us: int = 0
    boom_contact: bool = False
    boom_inside: bool = False  # receptacle inside the envelope
    boom_elevation: float = 0.0  # [rad] negative below the tanker's longitudinal axis
    boom_azimuth: float = 0.0  # [rad] positive to the right
    boom_extension_m: float = 0.0
    # air-to-air TACAN
    tacan_t_us: int = 0  # time of validity
    tacan_range_m: float | None = None  # slant range; None: none in this reply
    tacan_bearing: float | None = None  # [rad] clockwise from the own nose; None: the set gives none
    tacan_link: tuple[float, float] | None = None  # [m] the other's own position north, east; None: it sends none
    # of a set, or a data link, that gives them at a rate of its own
    bearing_t_us: int = 0  # time of validity
    bearing: float = 0.0  # [rad] clockwise from the own nose
    position_t_us: int = 0
    position: tuple[float, float] = (0.0, 0.0)  # [m] the other's own position north, east
    # what the crew read off the radar
    radar_t_us: int = 0
    radar_y_m: float = 0.0  # [m] receiver off the refuelling track, left of +x (rendezvous frame)
    radar_sigma_m: float = 0.0  # [m]
    # radio altimeter
    radalt_t_us: int = 0
    radalt_m: float = 0.0  # [m] above the ground
    # data link
    peer: PeerState = field(default_factory=PeerState)
    fix: PeerFix = field(default_factory=PeerFix)
    # commands and changes of parameters that arrived with this tick
    commands: list[Command] = field(default_factory=list)
    settings: list[Setting] = field(default_factory=list)


_EVERY = attrgetter(*(x.name for x in fields(SensorFrame)))


def copied(f: SensorFrame) -> SensorFrame:
    """A frame of its own with the same entries: dataclasses.replace in a tenth of the time."""
    return SensorFrame(*_EVERY(f))


@dataclass(slots=True)
class ActuatorCmd:
    """What goes to the actuators. Surfaces in radians, throttle 0..1 of the thrust available."""

    t_us: int = 0
    aileron: float = 0.0  # [rad] + rolls right
    elevator: float = 0.0  # [rad] + trailing edge down
    rudder: float = 0.0  # [rad] + trailing edge left (yaws left)
    throttle: float = 0.0  # [-]
    latch: bool = False  # receptacle latch: False releases the boom
    armed: bool = True
    flap: float = 0.0  # [rad] + trailing edge down (lifts); aircraft that have one to move in flight


@dataclass(slots=True)
class NavState:
    """Navigation output. `x` holds the filter's state in its own order (sixdof/motion.py), `sigma` its 1-sigma."""

    t_us: int = 0
    valid: bool = False
    reason: str = "not initialised"
    V: float = 0.0  # [m/s] airspeed
    V_cal: float = 0.0  # [m/s] calibrated airspeed (filled by the application)
    beta: float = 0.0  # [rad]
    alpha: float = 0.0  # [rad]
    w_b: Vec3 = ZERO3  # [rad/s]
    euler: Vec3 = ZERO3  # [rad] psi, theta, phi (3-2-1), psi unwrapped
    q_nb: Quat = IDENTITY_Q
    pos_n: Vec3 = ZERO3  # [m]
    vel_n: Vec3 = ZERO3  # [m/s]
    acc_n: Vec3 = ZERO3  # [m/s^2]
    wind_n: Vec3 = ZERO3  # [m/s] air moves towards
    # 1-sigma of what is published, lasting errors of the sensors included
    wind_sigma: Vec3 = ZERO3  # [m/s]
    pos_sigma: Vec3 = ZERO3  # [m] NED
    att_sigma: Vec3 = ZERO3  # [rad] psi, theta, phi
    scatter: Vec3 = ZERO3  # [m] of it the filter's own part of the position: what changes from sample to sample
    wind_valid: bool = True  # the wind may be given out
    trouble: str = ""  # why a valid estimate is not to be trusted; empty: it is
    nis: float = 0.0  # [-] normalised innovation squared of the last update
    nis_dof: int = 0
    # relative to another aircraft, where one is followed; its axes: _t
    rel_valid: bool = False
    rel_age_s: float = 1e9
    rel_pos_t: Vec3 = ZERO3  # [m]
    rel_vel_t: Vec3 = ZERO3  # [m/s]
    rel_euler: Vec3 = ZERO3  # [rad] psi, theta, phi from tanker body to receiver body
    rel_w_b: Vec3 = ZERO3  # [rad/s] w_R - R w_T, receiver body axes
    rel_sigma: Vec3 = ZERO3  # [m] 1-sigma, tanker body axes
    rel_att_sigma: Vec3 = ZERO3  # [rad] of rel_euler
    rel_held: bool = False  # the position is good without the relative sensor or without the data link
    rel_doubt: str = ""  # why the relative position does not serve the phase; empty: it does, or nobody looks
    peer_age_s: float = 1e9
    wind_rot: Vec3 = ZERO3  # [rad/s] effective rotational wind, own body axes (where it is estimated)
    wind_rot_sigma: Vec3 = ZERO3  # [rad/s]


@dataclass(slots=True)
class GuidanceCmd:
    """Guidance output: mission phase and the references of the control law."""

    phase: int = 0  # mission enumeration WKF_PHASE
    phase_t_s: float = 0.0  # [s] time in phase
    reason: str = ""
    V: float = 0.0  # [m/s] commanded airspeed (tanker)
    alt_m: float = 0.0  # [m] commanded altitude (tanker)
    psi_dot: float = 0.0  # [rad/s] commanded turn rate
    rel_pos_t: Vec3 = ZERO3  # [m] commanded xi (receiver)
    rel_vel_t: Vec3 = ZERO3  # [m/s] its rate
    latch: bool = False
    measure: bool = False  # holding contact: this sample counts for station keeping


# Health.flags bits
HF_IMU = 1
HF_GNSS = 2
HF_AIR = 4
HF_ATT = 8
HF_REL = 16
HF_PEER = 32
HF_FUEL = 64  # low, exhausted, or its gauge lost
HF_NAV = 128  # not valid after it has been, or valid and not to be trusted
HF_ACT = 256  # last guard replaced a non-finite command
HF_SAT = 512  # a command has been at its limit for long
HF_ENGINE = 2048  # thrust is not what is commanded
HF_ROUGH = 4096  # the air is rougher than refuelling bears
HF_UPSET = 1024  # outside its envelope or without navigation: recovery has the command


class Judged(Protocol):
    """What navigation refuses of its readings, one entry per WKF_READING; worked out when asked for, which is seldom."""

    @property
    def counts(self) -> tuple[int, ...]:
        """Refused so far."""
        ...

    @property
    def ratios(self) -> tuple[float, ...]:
        """[-] of the last reading: above 1 it is refused."""
        ...


@dataclass(slots=True)
class Health:
    """Which inputs are usable, and what else is wrong. HF_* bits in all but `kept_out`."""

    failed: int = 0  # input stale, out of range or stuck; last guard acted
    radalt_bad: bool = False  # the radio altimeter's last reading was refused
    held: int = 0  # input that arrives, and that navigation keeps out because the others contradict it
    condition: int = 0  # of the aircraft: navigation, limits, fuel
    kept_out: int = 0  # bit = WKF_READING
    judged: Judged | None = None  # readings, by navigation
    reason: str = ""
    bad_packets: int = 0  # dropped: CRC, length, unknown id
    rejected: int = 0  # samples rejected by range, age or order

    @property
    def flags(self) -> int:
        """All that is wrong, HF_*."""
        return self.failed | self.held | self.condition

    @property
    def refused(self) -> tuple[int, ...]:
        """Readings refused by navigation so far, per WKF_READING; empty: none is judged."""
        return () if self.judged is None else self.judged.counts

    @property
    def ratios(self) -> tuple[float, ...]:
        """[-] of the last reading, per WKF_READING: above 1 it is refused; empty: none is judged."""
        return () if self.judged is None else self.judged.ratios


@dataclass(slots=True)
class Timing:
    """Loop accounting for LOOP_TIMING."""

    ticks: int = 0
    slips: int = 0
    exec_us_last: float = 0.0
    exec_us_max: float = 0.0
    exec_us_mean: float = 0.0
    late_us_p50: float = 0.0
    late_us_p99: float = 0.0
    late_us_max: float = 0.0


@dataclass(frozen=True, slots=True)
class GroupCost:
    """What one rate group costs, for RATE_GROUP: every `divisor` base ticks at `offset`; durations [us]."""

    name: str
    divisor: int
    offset: int
    runs: int
    last_us: float
    mean_us: float
    p99_us: float
    max_us: float


@dataclass(slots=True)
class Text:
    """One STATUSTEXT."""

    severity: int  # MAV_SEVERITY
    text: str  # what is longer than 50 characters goes down in chunks


@dataclass(slots=True)
class Ack:
    """Answer to a Command. A refusal says why: the reason goes down as the STATUSTEXT the COMMAND_ACK names."""

    command: int
    result: int  # MAV_RESULT
    target_system: int
    target_component: int
    reason: str = ""


@dataclass(slots=True)
class Snapshot:
    """Everything telemetry may send about one tick. References, not copies: read it before the next tick."""

    t_us: int
    tick: int
    sensors: SensorFrame
    nav: NavState
    guid: GuidanceCmd
    cmd: ActuatorCmd
    health: Health
    timing: Timing
    texts: list[Text] = field(default_factory=list)
    acks: list[Ack] = field(default_factory=list)
    reports: Mapping[type, object] = field(
        default_factory=dict
    )  # what only this mission sends, by the class of the record
    laws: Laws = ()  # what the command is made of, law by law
    settled: list[Settled] = field(default_factory=list)
    commanded: bool = True  # the command was worked out in this tick; False: it is the last one's, but for its time

    def report(self, kind: type[R]) -> R | None:
        """The mission's record of class `kind`; None: it has none now."""
        found = self.reports.get(kind)
        return found if isinstance(found, kind) else None
