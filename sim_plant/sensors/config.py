"""Sensor settings of a scenario: rate, latency, noise and bias of every group. Defaults: the small noise set of lee.md
section 5 (Table 2.2 of the work it reviews); biases are our choice of a good navigation fit.

`*_std` is white noise per sample, `*_bias_std` the spread of a bias drawn once per run; `tau_s` > 0 colours the noise.
A `grade` other than paper puts its terms in the place of these and of `latency_ms`; `terms` sets single ones over either.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

from flightsw.strict import Range
from sim_plant.sensors.terms import PAPER, Grade, OwnGrade

NonNeg = Annotated[float, Range(0.0)]
Rate = Annotated[float, Range(0.1, 1000.0)]
NM = 1852.0  # [m]
Latency = Annotated[float, Range(0.0, 5000.0)]


@dataclass(frozen=True)
class NoiseCfg:
    """Common to all sensors: noise and bias factor, correlation time (0 = white)."""

    scale: NonNeg = 1.0
    bias_scale: NonNeg = 1.0
    tau_s: NonNeg = 0.0


@dataclass(frozen=True)
class Imu:
    """Body rates [rad/s] and specific force [m/s^2], body axes; 1-sigma per sample and constant of a run."""

    rate_hz: Rate = 100.0
    latency_ms: Latency = 0.0
    gyro_std: NonNeg = 0.0131  # [rad/s] per sample
    acc_std: NonNeg = 0.05  # [m/s^2]
    gyro_bias_std: NonNeg = 2e-4
    acc_bias_std: NonNeg = 0.02
    tau_s: NonNeg = 0.0
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class Baro:
    """Pressure altitude [m]."""

    rate_hz: Rate = 20.0
    latency_ms: Latency = 0.0
    alt_std_m: NonNeg = 0.5
    alt_bias_std_m: NonNeg = 5.0
    tau_s: NonNeg = 0.0
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class Mag:
    """Magnetic field [gauss], body axes."""

    rate_hz: Rate = 20.0
    latency_ms: Latency = 0.0
    std_gauss: NonNeg = 0.002
    bias_std_gauss: NonNeg = 0.003
    tau_s: NonNeg = 0.0
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class Gnss:
    """Position [m] and velocity [m/s], NED."""

    rate_hz: Rate = 20.0
    latency_ms: Latency = 0.0
    pos_std_m: NonNeg = 0.5
    vel_std_mps: NonNeg = 0.1
    vel_down_factor: NonNeg = 1.0  # noise of the vertical velocity relative to that of the horizontal one
    pos_bias_std_m: NonNeg = 1.0
    vel_bias_std_mps: NonNeg = 0.03
    tau_s: NonNeg = 0.0
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class Air:
    """Airspeed [m/s], incidence and sideslip [rad] of every probe."""

    rate_hz: Rate = 20.0
    latency_ms: Latency = 0.0
    V_std_mps: NonNeg = 0.2
    alpha_std: NonNeg = 0.0044  # [rad] per probe
    beta_std: NonNeg = 0.0035
    V_bias_std_mps: NonNeg = 0.2
    alpha_bias_std: NonNeg = 0.0015
    beta_bias_std: NonNeg = 0.0015
    tau_s: NonNeg = 0.0
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class Att:
    """Attitude, an error [rad] about each body axis."""

    rate_hz: Rate = 20.0
    latency_ms: Latency = 0.0
    std: NonNeg = 0.0035  # [rad] about each body axis
    bias_std: NonNeg = 0.001
    tau_s: NonNeg = 0.0
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class Rel:
    """Place [m] and its rate [m/s] in the leader's body axes."""

    rate_hz: Rate = 20.0
    latency_ms: Latency = 0.0
    pos_std_m: NonNeg = 0.5
    vel_std_mps: NonNeg = 0.1
    pos_bias_std_m: NonNeg = 0.05
    vel_bias_std_mps: NonNeg = 0.01
    tau_s: NonNeg = 0.0
    range_max_m: NonNeg = 0.0  # beyond: no samples; 0: no limit
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class Fuel:
    """Mass of fuel [kg]."""

    rate_hz: Rate = 1.0
    latency_ms: Latency = 0.0
    std_kg: NonNeg = 5.0
    bias_std_kg: NonNeg = 10.0
    tau_s: NonNeg = 0.0
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class BoomSignal:
    """Contact, envelope, elevation and azimuth [rad], extension [m]; paper has no errors."""

    rate_hz: Rate = 20.0
    latency_ms: Latency = 0.0
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class Radalt:
    """Radio altimeter, carried by a kind that has one where its grade is not paper: the works have none."""

    rate_hz: Rate = 25.0
    latency_ms: Latency = 0.0
    range_max_m: Annotated[float, Range(1.0, 655.0)] = (
        655.0  # such a set measures to 760 m; DISTANCE_SENSOR's cm end here
    )
    grade: OwnGrade = ""  # "": that of the aircraft
    terms: dict[str, Any] = field(default_factory=dict)  # single terms (sensors/terms.py) over the grade's


@dataclass(frozen=True)
class Tacan:
    """Slant range, one reply per interval; defaults rivard.md section 4."""

    interval_s: Annotated[float, Range(0.01, 600.0)] = 10.0
    first_s: NonNeg = 1.0
    latency_ms: Latency = 0.0
    bias_std_m: NonNeg = 0.1 * NM  # drawn once per run
    std_m: NonNeg = 0.016 * NM  # correlated noise
    tau_s: NonNeg = 3.6
    bearing_std_deg: NonNeg = 0.0  # white; 0: the set gives no bearing
    bearing_bias_std_deg: NonNeg = 0.0  # drawn once per run
    bearing_dt_s: Annotated[float, Range(0.0, 600.0)] = 0.0  # between bearings of their own; 0: one with every range
    bearing_tau_s: NonNeg = 5.0  # correlation time of the noise of those; 0: white, kinder than a set that is reflected
    link_std_m: NonNeg = 0.0  # of the other's own position sent with the reply, per axis, white; 0: no data link
    link_bias_std_m: NonNeg = 0.0  # drawn once per run
    link_dt_s: Annotated[float, Range(0.0, 600.0)] = 0.0  # between positions of their own; 0: one with every range
    link_tau_s: NonNeg = 5.0  # correlation time of the noise of those: ten white ones a second would average to nothing
    link_latency_ms: Latency = 0.0
    link_loss: Annotated[float, Range(0.0, 0.99)] = 0.0  # share of those that never come
    dropout: Annotated[float, Range(0.0, 1.0)] = 0.0  # share of the replies without an answer
    earth_radius_m: Annotated[float, Range(1e6)] = 3444.0 * NM  # the line of sight leaves the flat earth of the world


@dataclass(frozen=True)
class Radar:
    """Lateral position of a real receiver as the crew reads it (that of [traffic] is known to y_sigma_m by itself)."""

    sigma_m: NonNeg = 0.0  # 0: no reading
    at_s: NonNeg = 0.5


@dataclass(frozen=True)
class Suite:
    """Sensors of one aircraft; a group left out keeps the defaults (lee.md section 5, small noise)."""

    grade: Grade = PAPER  # of every sensor that names none of its own; paper: the tables below as they stand
    imu: Imu = field(default_factory=Imu)
    baro: Baro = field(default_factory=Baro)
    mag: Mag = field(default_factory=Mag)
    gnss: Gnss = field(default_factory=Gnss)
    air: Air = field(default_factory=Air)
    att: Att = field(default_factory=Att)
    rel: Rel = field(default_factory=Rel)
    fuel: Fuel = field(default_factory=Fuel)
    radalt: Radalt = field(default_factory=Radalt)
    boom: BoomSignal = field(default_factory=BoomSignal)
    tacan: Tacan = field(default_factory=Tacan)
    radar: Radar = field(default_factory=Radar)
