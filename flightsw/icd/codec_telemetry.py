"""Snapshot to the telemetry messages every mission has: one encoder per message, all of the same shape, in one table."""

from __future__ import annotations

import math

from flightsw.icd import codec_stock
from flightsw.icd.codec_flight import wind_fields
from flightsw.icd.codec_terms import control_terms
from flightsw.icd.context import MODE_BASE, Context, Encoder
from flightsw.icd.dialect import VALUES
from flightsw.icd.stamps import boot_ms
from flightsw.icd.wire import BY_NAME, Sender
from flightsw.types import HF_AIR, HF_ATT, HF_GNSS, HF_IMU, HF_NAV, HF_REL, HF_UPSET, GroupCost, Snapshot

PHASE_BREAKAWAY = 8  # WKF_PHASE
READINGS = 12  # WKF_READING
RATIO_MAX = 1e9  # [-] of a reading that was no number
# readings behind the test ratios of ESTIMATOR_STATUS
_VELOCITY, _POSITION, _AIRSPEED = (
    tuple(VALUES[f"WKF_READING_{name}"] for name in names)
    for names in (
        ("GNSS_VELOCITY", "REL_VELOCITY", "GNSS_RATE"),
        ("GNSS_POSITION", "REL_POSITION", "WAKE", "GNSS_DIFFERENCE"),
        ("AIRSPEED",),
    )
)
_TAU = 2.0 * math.pi


_S = BY_NAME


def _wrap(a: float) -> float:
    """Angle [rad] to (-pi, pi]."""
    a = math.remainder(a, _TAU)
    return math.pi if a == -math.pi else a


def _clamp(v: float, lo: int, hi: int) -> int:
    return max(lo, min(hi, round(v)))


def _i16(v: float) -> int:
    return _clamp(v, -32768, 32767)


def _nav_state(s: Snapshot, c: Context) -> bytes:
    n = s.nav
    return c.send.pack(
        _S["NAV_STATE"], s.t_us, n.V, n.beta, n.alpha, *n.w_b, *n.euler, *n.wind_n, *n.wind_sigma, *n.pos_sigma,
        *n.att_sigma, n.nis, min(n.nis_dof, 255), 1 if n.valid else 0,
    )  # fmt: skip


def _quaternion(s: Snapshot, c: Context) -> bytes:
    return c.send.pack(_S["ATTITUDE_QUATERNION"], boot_ms(s.t_us), *s.nav.q_nb, *s.nav.w_b, 0.0, 0.0, 0.0, 0.0)


def _local(s: Snapshot, c: Context) -> bytes:
    return c.send.pack(_S["LOCAL_POSITION_NED"], boot_ms(s.t_us), *s.nav.pos_n, *s.nav.vel_n)


def _relative(s: Snapshot, c: Context) -> bytes:
    n, g = s.nav, s.guid
    return c.send.pack(
        _S["RELATIVE_STATE"], s.t_us, *n.rel_pos_t, *n.rel_vel_t, *n.rel_euler, *n.rel_sigma, *g.rel_pos_t,
        *g.rel_vel_t, n.rel_age_s, n.peer_age_s, 1 if n.rel_valid else 0, *n.rel_att_sigma,
    )  # fmt: skip


def _mission(s: Snapshot, c: Context) -> bytes:
    g, u = s.guid, s.cmd
    return c.send.pack(
        _S["MISSION_STATUS"], s.t_us, g.phase_t_s, g.V, g.alt_m, g.psi_dot, u.aileron, u.elevator, u.rudder, u.throttle,
        g.phase, 1 if g.measure else 0, 1 if s.sensors.boom_contact else 0, 1 if g.latch else 0,
        g.reason.encode("ascii", "replace")[:50],
    )  # fmt: skip


def _wind(s: Snapshot, c: Context) -> bytes:
    return c.send.pack(_S["WIND_COV"], s.t_us, *wind_fields(s.nav, -s.nav.pos_n[2]))


def _attitude(s: Snapshot, c: Context) -> bytes:
    psi, theta, phi = s.nav.euler
    return c.send.pack(_S["ATTITUDE"], boot_ms(s.t_us), _wrap(phi), theta, _wrap(psi), *s.nav.w_b)


def _global(s: Snapshot, c: Context) -> bytes:
    lat, lon, alt = c.geo.encode(s.nav.pos_n)
    vx, vy, vz = s.nav.vel_n
    return c.send.pack(
        _S["GLOBAL_POSITION_INT"], boot_ms(s.t_us), lat, lon, round(alt * 1000.0), round(-s.nav.pos_n[2] * 1000.0),
        _i16(vx * 100.0), _i16(vy * 100.0), _i16(vz * 100.0), round(math.degrees(s.nav.euler[0]) * 100.0) % 36000,
    )  # fmt: skip


def _hud(s: Snapshot, c: Context) -> bytes:
    n = s.nav
    return c.send.named(
        "VFR_HUD",
        airspeed=n.V_cal,
        groundspeed=math.hypot(n.vel_n[0], n.vel_n[1]),
        heading=round(math.degrees(n.euler[0])) % 360,
        throttle=_clamp(s.cmd.throttle * 100.0, 0, 100),
        alt=c.geo.alt0 - n.pos_n[2],
        climb=-n.vel_n[2],
    )


def _heartbeat(s: Snapshot, c: Context) -> bytes:
    if s.guid.phase == PHASE_BREAKAWAY or s.health.flags & HF_UPSET:
        state = 6
    elif not s.nav.valid:
        state = 2
    else:
        state = 5 if s.health.flags & (HF_IMU | HF_GNSS | HF_AIR | HF_ATT | HF_REL | HF_NAV) else 4
    # custom, automatic, guided, stabilised; HIL, armed
    mode = 0x1D | (0x20 if c.simulated else 0) | (0x80 if s.cmd.armed else 0)
    number = MODE_BASE + s.guid.phase
    return c.send.named("HEARTBEAT", type=1, autopilot=0, base_mode=mode, custom_mode=number, system_status=state)


# HF_* -> MAV_SYS_STATUS_SENSOR
_FITTED = ((HF_IMU, 0x3), (HF_AIR, 0x10), (HF_GNSS, 0x20), (HF_ATT | HF_NAV, 0x200000))
_REL_BIT, _MAG_BIT, _BARO_BIT, _FENCE_BIT, _READY_BIT = 0x80, 0x4, 0x8, 0x100000, 0x10000000
_OWN = HF_IMU | HF_AIR | HF_GNSS | HF_ATT | HF_NAV
SILENT_US = 1_000_000  # [us] magnetometer or static pressure without a sample for longer is not healthy


def _sys_status(s: Snapshot, c: Context) -> bytes:
    fitted = (*_FITTED, (HF_REL, _REL_BIT)) if c.relative else _FITTED
    present = sum(bits for _, bits in fitted) | _READY_BIT
    healthy = sum(bits for flag, bits in fitted if not s.health.flags & flag)
    healthy |= _FENCE_BIT  # there is none: nothing is breached
    for bit, last_us in ((_MAG_BIT, c.mag_us), (_BARO_BIT, c.baro_us)):
        present |= bit if last_us >= 0 else 0
        healthy |= bit if last_us >= 0 and s.t_us - last_us < SILENT_US else 0
    if s.nav.valid and not s.health.flags & _OWN:
        healthy |= _READY_BIT
    tried = c.sent + c.dropped
    return c.send.named(
        "SYS_STATUS",
        onboard_control_sensors_present=present,
        onboard_control_sensors_enabled=present,
        onboard_control_sensors_health=healthy,
        load=_clamp(1000.0 * c.timing.exec_us_mean / c.period_us, 0, 65535),
        voltage_battery=0xFFFF,
        current_battery=-1,
        battery_remaining=-1,
        drop_rate_comm=10000 * c.dropped // tried if tried else 0,
        errors_comm=min(c.dropped, 65535),
        errors_count1=min(c.count.bad, 65535),
        errors_count2=min(s.health.rejected + c.count.untimely, 65535),
        errors_count3=min(c.timing.slips, 65535),
        errors_count4=min(c.excess, 65535),
    )


def _test_ratio(ratios: tuple[float, ...], kinds: tuple[int, ...]) -> float:
    """Largest innovation test ratio of the sensors of some kinds, 0 if none is judged."""
    return min(max((ratios[k] for k in kinds), default=0.0), RATIO_MAX) if ratios else 0.0


def _estimator(s: Snapshot, c: Context) -> bytes:
    n = s.nav
    flags = 0
    if n.valid:
        flags = 0x37 | (0x8 if n.rel_valid else 0)
    if s.health.flags & HF_GNSS:
        flags |= 0x400
    ratios = s.health.ratios
    vel, pos, tas = (_test_ratio(ratios, kinds) for kinds in (_VELOCITY, _POSITION, _AIRSPEED))
    return c.send.named(
        "ESTIMATOR_STATUS",
        time_usec=s.t_us,
        flags=flags,
        vel_ratio=vel,
        pos_horiz_ratio=pos,
        pos_vert_ratio=pos,
        tas_ratio=tas,
        pos_horiz_accuracy=math.hypot(n.pos_sigma[0], n.pos_sigma[1]),
        pos_vert_accuracy=n.pos_sigma[2],
    )


def _timing(s: Snapshot, c: Context) -> bytes:
    t = c.timing
    return c.send.pack(
        _S["LOOP_TIMING"], s.t_us, t.ticks, t.slips, t.exec_us_last, t.exec_us_max, t.exec_us_mean, t.late_us_p50,
        t.late_us_p99, c.late_p999_us, t.late_us_max,
    )  # fmt: skip


def _health(s: Snapshot, c: Context) -> bytes:
    h = s.health
    refused = ([min(n, 0xFFFF) for n in h.refused] + [0] * READINGS)[:READINGS]
    return c.send.pack(
        _S["HEALTH_STATUS"], s.t_us, c.count.bad, h.rejected + c.count.untimely, h.flags, *refused, h.kept_out
    )


def _terms(s: Snapshot, c: Context) -> bytes:
    return control_terms(c.send, s.t_us, s.laws)


def rate_group(send: Sender, t_us: int, k: int, g: GroupCost) -> bytes:
    """RATE_GROUP packet of the group at place k."""
    return send.named(
        "RATE_GROUP", time_usec=t_us, runs=g.runs, last=g.last_us, mean=g.mean_us, p99=g.p99_us, max=g.max_us,
        divisor=g.divisor, offset=g.offset, group=k, label=g.name,
    )  # fmt: skip


ENCODERS: dict[str, Encoder] = {
    "NAV_STATE": _nav_state,
    "ATTITUDE_QUATERNION": _quaternion,
    "LOCAL_POSITION_NED": _local,
    "RELATIVE_STATE": _relative,
    "MISSION_STATUS": _mission,
    "WIND_COV": _wind,
    "ATTITUDE": _attitude,
    "GLOBAL_POSITION_INT": _global,
    "VFR_HUD": _hud,
    "HEARTBEAT": _heartbeat,
    "SYS_STATUS": _sys_status,
    "ESTIMATOR_STATUS": _estimator,
    "LOOP_TIMING": _timing,
    "HEALTH_STATUS": _health,
    "CONTROL_TERMS": _terms,
    **codec_stock.ENCODERS,
}
# messages that carry the tick's time and may lead a datagram; those of one mission only carry their own sample's
TIMED = frozenset(n for n in ENCODERS if {"time_usec", "time_boot_ms"} & set(_S[n].slots))
