"""Logs of other formats: circles in a known wind, written by pymavlink, by a DataFlash writer that pymavlink reads back, and
as ULog that pyulog reads; read here whole, and with bytes spoiled.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v10 import ardupilotmega as v1
from pymavlink.dialects.v20 import ardupilotmega as v2
from typer.testing import CliRunner

from ground.__main__ import app
from ground.columns import LogError
from ground.export import ulog
from ground.export.sheets import Sheet, Text
from ground.reading.log import in_order, read
from hil_scripts.estimate import flightlog, foreign, offline
from hil_scripts.estimate.columns import LogError as CannotError

HZ, SECONDS, BANK, RATE = 20, 40, 0.3, 0.15
WIND = np.array([3.0, -4.0, 0.0])
HEIGHT = 2000.0
T = np.arange(HZ * SECONDS) / HZ
T_US = np.arange(len(T), dtype=np.int64) * (1_000_000 // HZ)
V = 20.0 + np.sin(0.3 * T)
TURNING = RATE + 0.02 * np.sin(T)
PSI = (RATE * T + 0.02 * (1.0 - np.cos(T)) + np.pi) % (2.0 * np.pi) - np.pi
EULER = np.column_stack([PSI, np.zeros_like(T), np.full_like(T, BANK)])
TURN = np.column_stack([0.0 * T, TURNING * np.sin(BANK), TURNING * np.cos(BANK)])
VEL = V[:, None] * np.column_stack([np.cos(PSI), np.sin(PSI), 0.0 * T]) + WIND
EQUIVALENT = V * float(np.sqrt(foreign.density_ratio(np.array([HEIGHT]))[0]))
QUATERNION = np.column_stack([np.cos(PSI / 2) * np.cos(BANK / 2), np.cos(PSI / 2) * np.sin(BANK / 2),
                              np.sin(PSI / 2) * np.sin(BANK / 2), np.sin(PSI / 2) * np.cos(BANK / 2)])  # fmt: skip


def write_ulog(path: Path) -> None:
    def sheet(name: str, columns: dict[str, np.ndarray]) -> Sheet:
        return Sheet(name, T_US, columns)

    sheets = [
        sheet("airspeed_validated", {"true_airspeed_m_s": V}),
        sheet("vehicle_attitude", {f"q[{i}]": QUATERNION[:, i] for i in range(4)}),
        sheet("vehicle_angular_velocity", {f"xyz[{i}]": TURN[:, i] for i in range(3)}),
        sheet("vehicle_local_position", {k: VEL[:, i] for i, k in enumerate(("vx", "vy", "vz"))}),
        sheet("wind", {"windspeed_north": np.full_like(T, WIND[0]), "windspeed_east": np.full_like(T, WIND[1])}),
    ]
    ulog.write(path, sheets, [Text(1_000_000, "uav", "armed")], "circle", {"MPC_X": 0.5})


FORMATS = {
    1: ("ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw"), 2: ("IMU", "QBfff", "TimeUS,I,GyrX,GyrY,GyrZ"),
    3: ("XKF1", "QBfff", "TimeUS,C,VN,VE,VD"), 4: ("ARSP", "QBf", "TimeUS,I,Airspeed"), 5: ("GPS", "QLLe", "TimeUS,Lat,Lng,Alt"),
    6: ("XKF2", "QBff", "TimeUS,C,VWN,VWE"), 7: ("MSG", "QZ", "TimeUS,Message"),
}  # fmt: skip
CODES = {"Q": "Q", "f": "f", "B": "B", "L": "i", "e": "i", "Z": "64s"}


def write_dataflash(path: Path) -> None:
    out = io.BytesIO()

    def fmt(kind: int, size: int, name: str, text: str, columns: str) -> None:
        out.write(
            b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size, name.encode(), text.encode(), columns.encode())
        )

    fmt(0x80, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    packers = {k: struct.Struct("<" + "".join(CODES[c] for c in f[1])) for k, f in FORMATS.items()}
    for kind, f in FORMATS.items():
        fmt(kind, 3 + packers[kind].size, *f)

    def row(kind: int, *values: object) -> None:
        out.write(b"\xa3\x95" + bytes((kind,)) + packers[kind].pack(*values))

    row(7, 0, b"circle")
    for k, t in enumerate(T_US.tolist()):
        row(1, t, np.degrees(BANK), 0.0, np.degrees(PSI[k]) % 360.0)
        row(2, t, 0, *TURN[k])
        row(3, t, 0, *VEL[k])
        row(4, t, 0, EQUIVALENT[k])
        if k % 4 == 0:
            row(5, t, -353632610, 1491652300, round(HEIGHT * 100))
            row(6, t, 0, WIND[0], WIND[1])
    path.write_bytes(out.getvalue())


def write_tlog(path: Path, dialect: object = v2) -> None:
    mav = dialect.MAVLink(None, srcSystem=3)  # type: ignore[attr-defined]
    start = 1_760_000_000_000_000
    with path.open("wb") as f:
        for k, t in enumerate(T_US.tolist()):
            vel = np.rint(100.0 * VEL[k]).astype(int)
            packets = [
                mav.attitude_encode(t // 1000, BANK, 0.0, PSI[k], *TURN[k]),
                mav.global_position_int_encode(t // 1000, 0, 0, int(HEIGHT * 1000), 0, *vel, 0),
                mav.vfr_hud_encode(EQUIVALENT[k], 0.0, 0, 0, HEIGHT, 0.0),
            ]
            if k % 10 == 0:
                packets.append(
                    mav.wind_encode(np.degrees(np.arctan2(-WIND[1], -WIND[0])) % 360.0, float(np.hypot(*WIND[:2])), 0.0)
                )
            for m in packets:
                f.write(struct.pack(">Q", start + t) + m.pack(mav))


Writer = Callable[[Path], None]
WRITERS: dict[str, Writer] = {
    "log.ulg": write_ulog, "log.bin": write_dataflash, "log.tlog": write_tlog, "one.tlog": lambda p: write_tlog(p, v1),
}  # fmt: skip
DAMAGED = {"log.ulg": "bytes damaged", "log.bin": "bytes damaged", "log.tlog": "bytes damaged"}


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    for name, write in WRITERS.items():
        write(folder / name)
    return folder


def test_pymavlink_reads_the_dataflash_log_made_here(logs: Path) -> None:
    from pymavlink.DFReader import DFReader_binary  # slow to import: only where it is needed

    reader = DFReader_binary(str(logs / "log.bin"))
    mine, at = read(logs / "log.bin"), 0
    sheet = mine.get("ATT")
    assert sheet is not None and mine.lost == ""
    while (m := reader.recv_match(type="ATT")) is not None:
        assert sheet.columns["Yaw"][at] == np.float32(m.Yaw) and sheet.t_us[at] == m.TimeUS
        at += 1
    assert at == len(sheet) == len(T)
    gps = mine.get("GPS")
    assert gps is not None and gps.columns["Alt"][0] == HEIGHT and gps.columns["Lat"][0] == pytest.approx(-35.3632610)
    assert [x.text for x in mine.texts] == ["circle"]


@pytest.mark.parametrize("name", WRITERS)
def test_the_wind_of_a_circle_is_found_in_every_format(logs: Path, name: str) -> None:
    log = flightlog.read(logs / name)
    assert len(log) > 0.9 * len(T)
    at = np.searchsorted(T, log.t + 1e-6, side="right") - 1
    assert np.allclose(log.air[:, 0], V[at], rtol=2e-4)
    wind = offline.triangle(log)
    assert np.allclose(wind, WIND, atol=0.03)  # cm/s on the wire; the angles between two samples
    assert log.wind_n is not None and np.allclose(log.wind_n, WIND, atol=1e-4)
    assert np.allclose(log.w_b, TURN[at], atol=1e-6)


@pytest.mark.parametrize("name", DAMAGED)
def test_damage_is_counted_and_never_shown(logs: Path, tmp_path: Path, name: str) -> None:
    raw = bytearray((logs / name).read_bytes())
    rng = np.random.default_rng(5)
    for at in rng.integers(len(raw) // 4, len(raw) - 100, 12).tolist():
        raw[at : at + 40] = bytes(40)
    spoilt = tmp_path / name
    spoilt.write_bytes(raw[:-7])
    whole, log = read(logs / name), read(spoilt)
    assert log.damage[DAMAGED[name]] > 0 and sum(log.damage.values()) >= 40
    rows = {
        s.name: dict(zip(s.t_us.tolist(), zip(*s.columns.values(), strict=True), strict=True)) for s in whole.sheets
    }
    kept = sum(len(s) for s in log.sheets)
    if name == "log.ulg":  # without synchronisation messages nothing behind the damage can be found again
        assert kept > 0
    else:
        assert kept > 0.9 * sum(len(s) for s in whole.sheets)
    if name == "log.tlog":  # the only format here with a CRC
        for s in log.sheets:
            for t, row in zip(s.t_us.tolist(), zip(*s.columns.values(), strict=True), strict=True):
                assert rows[s.name][t] == row


def test_a_packet_of_the_stock_dialect_with_a_wrong_crc_is_left_out(logs: Path, tmp_path: Path) -> None:
    raw = bytearray((logs / "log.tlog").read_bytes())
    mark = v2.MAVLINK_MSG_ID_WIND.to_bytes(3, "little")
    at = next(i for i in range(len(raw)) if raw[i] == 0xFD and raw[i + 7 : i + 10] == mark)
    raw[at + 12] ^= 0x40
    path = tmp_path / "a.tlog"
    path.write_bytes(raw)
    log = read(path)
    wind, before = log.get("3/WIND"), read(logs / "log.tlog").get("3/WIND")
    assert wind is not None and before is not None and len(wind) == len(before) - 1
    assert log.damage["packets damaged"] == 1
    assert before.units["direction"] == "deg" and np.ptp(before.columns["speed"]) == 0.0


def test_stamps_that_run_away_cost_their_rows_only() -> None:
    t = np.arange(10) * 100_000
    t[4] += 10**12
    t[7] = 0
    assert in_order(t).tolist() == [k not in (4, 7) for k in range(10)]


def test_what_a_log_does_not_have_is_said(tmp_path: Path) -> None:
    ulog.write(tmp_path / "a.ulg", [Sheet("airspeed", T_US, {"true_airspeed_m_s": T})], [], "a")
    with pytest.raises(CannotError, match=r"needs, and this has not: attitude: vehicle_attitude; rates: .*; velocity"):
        flightlog.read(tmp_path / "a.ulg")
    (tmp_path / "b.bin").write_bytes(b"\xa3\x95" + bytes(500))
    with pytest.raises(LogError, match=r"b\.bin: is no DataFlash log"):
        read(tmp_path / "b.bin")
    (tmp_path / "c.csv").write_text("x,y\n1,2\n")
    with pytest.raises(LogError, match="no column of time; known are t, "):
        read(tmp_path / "c.csv")


@pytest.mark.parametrize("name", ["log.bin", "log.tlog"])
def test_a_log_is_converted_and_drawn(logs: Path, tmp_path: Path, name: str) -> None:
    from rerun.chunk import RrdReader

    out = tmp_path / "csv"
    said = CliRunner().invoke(app, ["export", str(logs / name), "--to", "csv", "--out", str(out)])
    assert said.exit_code == 0, said.output
    sheet = max(read(logs / name).sheets, key=len)
    table = read(out / f"{sheet.name.replace('/', '.')}.csv").sheets[0]
    assert np.array_equal(table.t_us, sheet.t_us - sheet.t_us[0])
    copy = tmp_path / name
    copy.write_bytes((logs / name).read_bytes())
    assert CliRunner().invoke(app, ["convert", str(copy)]).exit_code == 0
    drawn: Iterable[str] = {str(c.entity_path) for c in RrdReader(f"{copy}.rrd").stream()}
    assert f"/{sheet.name}/{next(iter(sheet.numbers))}" in drawn
