"""The dialect: stock layout where the name is stock, generated files current, fields described, truth kept apart."""

from __future__ import annotations

import dataclasses
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common

from flightsw.icd import codec_receive, dialect, gen, wire
from flightsw.missions.receiver.airdata.reports import FdiStatus, WakeFix
from flightsw.missions.receiver.integrity.report import IntegrityReport, integrity_values
from flightsw.process import services
from flightsw.sixdof.windcal.record import WindReport

from .conftest import extreme
from .generated import mav

FUEL_STATUS_CRC_EXTRA = 10  # not in the stock Python dialect of this pymavlink; from the MAVLink documentation
LATER = {"AVAILABLE_MODES", "CURRENT_MODE"}  # stock, and in its dialect `development` only
STOCK = sorted(n for n, s in wire.BY_NAME.items() if s.id < 53000 and s.id in common.mavlink_map)
SOURCES = Path(gen.__file__).resolve().parents[1]


def test_every_standard_message_but_one_is_in_the_stock_dialect() -> None:
    from pymavlink.dialects.v20 import development  # slow to import: only where it is needed

    assert {n for n, s in wire.BY_NAME.items() if s.id < 53000} - set(STOCK) == {"FUEL_STATUS", *LATER}
    for name in LATER:
        stock = development.mavlink_map[wire.BY_NAME[name].id]
        assert (stock.msgname, stock.crc_extra) == (name, wire.BY_NAME[name].crc_extra)
        assert stock.fieldnames == list(wire.BY_NAME[name].fields)
    assert wire.BY_NAME["FUEL_STATUS"].crc_extra == FUEL_STATUS_CRC_EXTRA
    assert len(STOCK) >= 24


@pytest.mark.parametrize("name", STOCK)
def test_layout_and_crc_extra_equal_stock(name: str) -> None:
    ours = mav.mavlink_map[wire.BY_NAME[name].id]
    stock = common.mavlink_map[wire.BY_NAME[name].id]
    assert stock.msgname == name
    assert ours.crc_extra == stock.crc_extra
    for part in ("fieldnames", "ordered_fieldnames", "fieldtypes", "array_lengths", "orders"):
        a, b = getattr(ours, part), getattr(stock, part)
        assert a == b[: len(a)] if name == "TIMESYNC" else a == b, part


@pytest.mark.parametrize("name", STOCK)
def test_stock_decoder_reads_our_packets_and_we_read_its(name: str) -> None:
    fields = extreme(name, 1)
    packet = wire.Sender(3, 1).named(name, **fields)
    [m] = common.MAVLink(None, 1, 1).parse_buffer(packet)
    assert m.get_type() == name and m.get_srcSystem() == 3
    for field, value in fields.items():
        got = getattr(m, field)
        assert (tuple(got) if isinstance(value, tuple) else got) == value
    [p] = wire.split(m.pack(common.MAVLink(None, 3, 1)), wire.SPECS, wire.Counters())
    assert p[0].to_dict(p[1]) == fields


OURS = 64  # failures the standard has no number for, from here up
OURS_TOO = ("FAILURE_UNIT", "FAILURE_TYPE")


def test_enumeration_values_equal_stock() -> None:
    for name, entries in mav.enums.items():
        if name not in common.enums or name == "MAV_CMD":
            continue
        for value, entry in entries.items():
            if entry.name.endswith("_ENUM_END"):
                continue
            if name not in OURS_TOO or value in common.enums[name]:
                assert common.enums[name][value].name == entry.name
            else:
                assert value >= OURS
    for value, entry in mav.enums["MAV_CMD"].items():
        if not entry.name.endswith("_ENUM_END"):
            assert common.enums["MAV_CMD"][value].name == entry.name


def test_failure_enumerations_equal_stock() -> None:
    for name in ("FAILURE_UNIT", "FAILURE_TYPE"):
        ours = {v: e.name for v, e in mav.enums[name].items() if not e.name.endswith("_ENUM_END")}
        stock = {v: e.name for v, e in common.enums[name].items() if not e.name.endswith("_ENUM_END")}
        more = {v: e for v, e in ours.items() if v not in stock}
        assert (ours.items() - more.items()) <= stock.items() and all(v >= OURS for v in more)
        assert name == "FAILURE_UNIT" or stock.items() <= ours.items()
    assert mav.enums["MAV_CMD"][420].name == common.enums["MAV_CMD"][420].name
    assert "channel" in mav.enums["MAV_CMD"][420].param[4]


@pytest.mark.parametrize("name", ["FDI_STATUS", "WAKE_POSITION", "WIND_CALIBRATION"])
def test_air_data_messages_have_a_field_for_every_value_of_their_type(name: str) -> None:
    kind = {"FDI_STATUS": FdiStatus, "WAKE_POSITION": WakeFix, "WIND_CALIBRATION": WindReport}[name]
    slots = wire.BY_NAME[name].slots
    renamed = {"t_us": "time_usec", "pos_f": "pos", "vel_f": "vel", "wind_f": "wind", "height_m": "height"}
    renamed |= dict.fromkeys(("cov_yy", "cov_yz", "cov_zz"), "cov")
    assert {renamed.get(f.name, f.name) for f in dataclasses.fields(kind)} == set(slots)
    assert wire.BY_NAME[name].size <= 255


def test_integrity_on_the_wire_has_no_infinity_and_the_stock_decoder_reads_it() -> None:
    r = IntegrityReport(
        20_000, (0.9, 1.1, math.inf), (10.0, 3.0, math.inf), (0.2, 0.3, math.nan), (-35.5, 0.25, 8.5), 5, 8, 2,
        (0.4, 0.0, math.inf, 2.5), 2.25, math.inf,
    )  # fmt: skip
    [values] = integrity_values(r)
    [m] = mav.MAVLink(None).parse_buffer(wire.Sender(2, 1).pack(wire.BY_NAME["INTEGRITY_STATUS"], *values))
    got = {k: getattr(m, k) for k in m.get_fieldnames()}
    want = {
        "pl": (0.9, 1.1, 1e9),
        "al": (10.0, 3.0, 1e9),
        "sigma": (0.2, 0.3, 1e9),
        "pos": r.pos,
        "ratio": (0.4, 0.0, 1e9, 2.5),
    }
    assert got == {
        "time_usec": 20_000, "used": 5, "excluded": 8, "undecided": 2, "turbulence": 2.25, "turbulence_max": 1e9,
        **{k: pytest.approx(v) for k, v in want.items()}
    }  # fmt: skip
    [nothing] = integrity_values(IntegrityReport())
    assert nothing[1:10] == (1e9,) * 9 and not any(nothing[10:-1]) and nothing[-1] == 1e9


def test_generated_files_are_current(capsys: pytest.CaptureFixture[str]) -> None:
    assert gen.main(["--check"]) == 0, capsys.readouterr().err


@pytest.mark.parametrize("name", sorted(wire.BY_NAME))
def test_layout_read_from_the_file_is_that_of_the_stock_generator(name: str) -> None:
    m = dialect.HOUSE.messages[wire.BY_NAME[name].id]
    made = mav.mavlink_map[m.id]
    assert (made.msgname, made.crc_extra, made.unpacker.size) == (m.name, m.crc_extra, m.packer.size)
    assert made.fieldnames == [f.name for f in m.fields]
    assert made.fieldtypes == [f.type for f in m.fields]
    assert made.ordered_fieldnames == [f.name for f in m.wire]
    assert made.array_lengths == [f.length for f in m.wire]


def test_enumerations_read_from_the_file_are_those_of_the_stock_generator() -> None:
    made = {n: {v: e.name for v, e in es.items() if not e.name.endswith("_ENUM_END")} for n, es in mav.enums.items()}
    assert {n: {v: e.name for v, e in es.items()} for n, es in dialect.ENUMS.items()} == made
    assert all(getattr(mav, n) == v for n, v in dialect.VALUES.items())


def test_check_names_a_stale_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stale = tmp_path / "icd.md"
    stale.write_text("old")
    monkeypatch.setattr(gen, "DOC", stale)
    assert gen.main(["--check"]) == 1
    assert str(stale) in capsys.readouterr().err
    assert stale.read_text() == "old"


def test_every_physical_field_has_units_and_every_field_a_meaning() -> None:
    root = ET.parse(gen.XML).getroot()
    dimensionless = re.compile(
        r"^(q\d?|q_nb|quaternion|attitude_q|repr_offset_q|nis|gamma|threshold|residual|scale|scale_sigma|lead|lift|lift_sigma|window_nis|window_drift|weight|hazard|hazard_states|hazard_monitor|quick|slow|throttle|controls|proportional|integral|feedforward|cut|error|error_integral|schedule|rates|position_cov|param\d|param_value|(.*_)?ratio)$"
    )
    for m in root.iter("message"):
        for f in m.findall("field"):
            floating = f.attrib["type"].startswith(("float", "double"))
            if floating and not dimensionless.match(f.attrib["name"]):
                assert f.attrib.get("units"), f"{m.attrib['name']}.{f.attrib['name']} has no units"


def test_icd_rules_are_enforced(tmp_path: Path) -> None:
    def judged(body: str, enums: str = "") -> dialect.Dialect:
        path = tmp_path / "own.xml"
        path.write_text(f"<mavlink><enums>{enums}</enums><messages>{body}</messages></mavlink>")
        return dialect.read([dialect.XML, path])

    text = '<message id="60000" name="{}"><description>x</description>{}</message>'
    with pytest.raises(dialect.IcdError, match=r"own\.xml: message BIG: payload 256 bytes"):
        judged(text.format("BIG", '<field type="double[32]" name="a">x</field>'))
    with pytest.raises(dialect.IcdError, match="message M, field a: no description"):
        judged(text.format("M", '<field type="float" name="a"></field>'))
    with pytest.raises(dialect.IcdError, match="message M, field a: type 'long': allowed: char, int8_t"):
        judged(text.format("M", '<field type="long" name="a">x</field>'))
    ok = '<field type="float" name="a">x</field>'
    with pytest.raises(dialect.IcdError, match="message B: id 60000 or name is already used by A"):
        judged(text.format("A", ok) + text.format("B", ok))
    with pytest.raises(dialect.IcdError, match="message HEARTBEAT: id 60000 or name is already used"):
        judged(text.format("HEARTBEAT", ok))
    with pytest.raises(dialect.IcdError, match="no description"):
        judged('<message id="60000" name="A"/>')
    with pytest.raises(dialect.IcdError, match="WKF_ACTION: AGAIN = 3: name or value is already used"):
        judged("", '<enum name="WKF_ACTION"><entry value="3" name="AGAIN"/></enum>')
    more = judged(text.format("A", ok), '<enum name="WKF_PHASE"><entry value="99" name="WKF_PHASE_OWN"/></enum>')
    assert more.messages[60000].name == "A" and more.words("WKF_PHASE")[99] == "own"


def test_own_messages_start_at_53000_and_do_not_collide() -> None:
    own = {n: s.id for n, s in wire.BY_NAME.items() if n not in STOCK and n not in ("FUEL_STATUS", *LATER)}
    assert all(53000 <= i < 53100 for i in own.values())
    assert not set(own.values()) & set(common.mavlink_map)


def test_no_onboard_receiver_accepts_truth() -> None:
    truth = wire.BY_NAME["TRUTH"].id
    assert truth not in codec_receive.ACCEPT
    assert truth not in services.ACCEPT


def test_onboard_sources_never_name_truth() -> None:
    files = [p for p in SOURCES.rglob("*.py") if p.parent.name != "icd"]
    assert len(files) > 10
    for p in [*files, SOURCES / "icd" / "codec_receive.py", SOURCES / "icd" / "codec_flight.py"]:
        assert not re.search(r"\bTRUTH\b|53020", p.read_text()), p


def test_xml_is_well_formed_and_has_no_include() -> None:
    root = ET.parse(gen.XML).getroot()
    assert root.find("include") is None
