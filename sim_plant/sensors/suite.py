"""The sensors of one aircraft, built from its scenario table, in the order in which they are read."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeVar

from sim_plant.aircraft.kind import OWN
from sim_plant.sensors.airdata import AirSensor
from sim_plant.sensors.base import Sensor
from sim_plant.sensors.config import NoiseCfg, Suite
from sim_plant.sensors.errors import Errors
from sim_plant.sensors.onboard import (
    AttitudeSensor,
    BaroSensor,
    FuelSensor,
    GnssSensor,
    ImuSensor,
    MagSensor,
    RadaltSensor,
)
from sim_plant.sensors.pair import BoomSensor, RelSensor
from sim_plant.sensors.rows import NoiseRows
from sim_plant.sensors.tacan import BearingSensor, PositionSensor, RadarSensor, TacanSensor
from sim_plant.sensors.terms import PAPER, grade_of, group_terms

if TYPE_CHECKING:
    from sim_plant.scenario import AircraftCfg, Scenario

S = TypeVar("S", bound=Sensor)


def build_sensors(
    name: str,
    suite: Suite,
    common: NoiseCfg,
    base_hz: int,
    seed: int,
    probes: int,
    has_rel: bool,
    has_boom: bool,
    groups: tuple[str, ...] = OWN,
) -> list[Sensor]:
    """Sensors of aircraft `name` with `probes` air-data probes and, of its own aircraft's sensors, those of `groups`. Raises
    ConfigError for a rate that does not fit.

    Each draws from generators named "<aircraft>.<sensor>.noise" and ".bias" (paper), or as errors.py says. A sensor's
    own tau_s wins over the common one.
    """

    def make(cls: type[S], cfg: Any, std: list[float], bias: list[float]) -> S:
        at, grade = f"sensors.{name}.{cls.group}", grade_of(cfg.grade, suite.grade)
        terms = group_terms(cls.group, grade, cfg.terms, f"{at}.terms")
        noise = _paper(seed, f"{name}.{cls.group}", cfg, common, std, bias) if std and grade == PAPER else None
        if terms is None:
            return cls(at, cfg.rate_hz, cfg.latency_ms, base_hz, noise, len(std) or cls.exact)
        latency = cfg.latency_ms if terms.latency_ms is None else terms.latency_ms
        graded = Errors(seed, name, cls.group, terms, 1.0 / cfg.rate_hz, probes, common.scale, common.bias_scale)
        s = cls(at, cfg.rate_hz, latency, base_hz, noise, graded.width)
        s.graded = graded
        return s

    u = suite
    out: list[Sensor] = []

    def fit(cls: type[Sensor], cfg: Any, std: list[float], bias: list[float]) -> None:
        if cls.group in groups:
            out.append(make(cls, cfg, std, bias))

    fit(
        ImuSensor,
        u.imu,
        [u.imu.gyro_std] * 3 + [u.imu.acc_std] * 3,
        [u.imu.gyro_bias_std] * 3 + [u.imu.acc_bias_std] * 3,
    )
    fit(BaroSensor, u.baro, [u.baro.alt_std_m], [u.baro.alt_bias_std_m])
    fit(MagSensor, u.mag, [u.mag.std_gauss] * 3, [u.mag.bias_std_gauss] * 3)
    fit(
        GnssSensor,
        u.gnss,
        [u.gnss.pos_std_m] * 3 + [u.gnss.vel_std_mps] * 2 + [u.gnss.vel_std_mps * u.gnss.vel_down_factor],
        [u.gnss.pos_bias_std_m] * 3 + [u.gnss.vel_bias_std_mps] * 3,
    )
    fit(AttitudeSensor, u.att, [u.att.std] * 3, [u.att.bias_std] * 3)
    fit(FuelSensor, u.fuel, [u.fuel.std_kg], [u.fuel.bias_std_kg])
    if "radalt" in groups:
        radalt = make(RadaltSensor, u.radalt, [], [])
        radalt.range_max_m = u.radalt.range_max_m
        out.append(radalt)
    if probes:
        out.append(
            make(
                AirSensor,
                u.air,
                [u.air.V_std_mps, u.air.alpha_std, u.air.beta_std] * probes,
                [u.air.V_bias_std_mps, u.air.alpha_bias_std, u.air.beta_bias_std] * probes,
            )
        )
    if has_rel:
        rel = make(
            RelSensor,
            u.rel,
            [u.rel.pos_std_m] * 3 + [u.rel.vel_std_mps] * 3,
            [u.rel.pos_bias_std_m] * 3 + [u.rel.vel_bias_std_mps] * 3,
        )
        rel.range_max_m = u.rel.range_max_m
        out.append(rel)
    if has_boom:
        out.append(make(BoomSensor, u.boom, [], []))
    return out


def _paper(seed: int, at: str, cfg: Any, common: NoiseCfg, std: list[float], bias: list[float]) -> NoiseRows:
    """Errors of the works: white or coloured, and a constant of the run."""
    tau = cfg.tau_s if cfg.tau_s > 0.0 else common.tau_s
    scaled = [x * common.scale for x in std], [x * common.bias_scale for x in bias]
    return NoiseRows(seed, at, *scaled, tau_s=tau, period_s=1.0 / cfg.rate_hz)


def tacan_sensors(
    name: str, suite: Suite, common: NoiseCfg, base_hz: int, seed: int, known_sigma_m: float
) -> list[Sensor]:
    """TACAN of aircraft `name`, what it gives at a rate of its own, and its crew's radar reading. known_sigma_m >= 0: the truth
    is spread about the reading by that much already. Raises ConfigError for an interval or latency that does not fit."""
    c = suite.tacan
    noise = NoiseRows(
        seed, f"{name}.tacan", [c.std_m * common.scale], [c.bias_std_m * common.bias_scale], c.tau_s, c.interval_s
    )
    own = TacanSensor(name, c, base_hz, noise, seed)
    out: list[Sensor] = [own]
    if c.bearing_std_deg > 0.0 and c.bearing_dt_s > 0.0:
        std, bias = (
            math.radians(x) * k
            for x, k in ((c.bearing_std_deg, common.scale), (c.bearing_bias_std_deg, common.bias_scale))
        )
        rows = NoiseRows(seed, f"{name}.bearing", [std], [bias], c.bearing_tau_s, c.bearing_dt_s)
        out.append(BearingSensor(name, c, base_hz, rows, own))
    if c.link_std_m > 0.0 and c.link_dt_s > 0.0:
        std, bias = c.link_std_m * common.scale, c.link_bias_std_m * common.bias_scale
        rows = NoiseRows(seed, f"{name}.position", [std] * 2, [bias] * 2, c.link_tau_s, c.link_dt_s)
        out.append(PositionSensor(name, c, base_hz, rows, seed))
    sigma = known_sigma_m if known_sigma_m >= 0.0 else suite.radar.sigma_m
    if sigma > 0.0:
        out.append(RadarSensor(name, suite.radar, base_hz, seed, sigma))
    return out


def sensors_of(sc: Scenario, a: AircraftCfg, probes: tuple[str, ...], seed: int) -> list[Sensor]:
    """Every sensor the aircraft `a` of a scenario carries; probes: names of its air-data probes. Raises ConfigError for a rate or
    latency that does not fit."""
    have, suite, base_hz = sc.groups(a), sc.suite(a.name), sc.clock.base_rate_hz
    own = tuple(g for g in OWN if g in have)
    out = build_sensors(a.name, suite, sc.noise, base_hz, seed, len(probes), "rel" in have, "boom" in have, own)
    if "tacan" in have:
        known = sc.traffic.y_sigma_m if a.tacan_to == sc.traffic_name else -1.0
        out += tacan_sensors(a.name, suite, sc.noise, base_hz, seed, known)
    for s in out:
        if isinstance(s, AirSensor):
            s.names = list(probes)
    return out
