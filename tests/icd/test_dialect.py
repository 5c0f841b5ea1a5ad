"""The dialect: stock layout where the name is stock, generated files current, fields described, truth kept apart."""

from __future__ import annotations

import dataclasses
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common

from flightsw.icd import codec_receive, gen, mav, wire
from flightsw.missions.receiver.airdata.reports import FdiStatus, WakeFix
from flightsw.process import services

from .conftest import extreme

FUEL_STATUS_CRC_EXTRA = 10  # not in the stock Python dialect of this pymavlink; from the MAVLink documentation
STOCK = sorted(n for n, s in wire.BY_NAME.items() if s.id < 53000 and s.id in common.mavlink_map)
SOURCES = Path(gen.__file__).resolve().parents[1]


def test_every_standard_message_but_one_is_in_the_stock_dialect() -> None:
    assert {n for n, s in wire.BY_NAME.items() if s.id < 53000} - set(STOCK) == {"FUEL_STATUS"}
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


def test_enumeration_values_equal_stock() -> None:
    for name, entries in mav.enums.items():
        if name not in common.enums or name == "MAV_CMD":
            continue
        for value, entry in entries.items():
            if entry.name.endswith("_ENUM_END"):
                continue
            assert common.enums[name][value].name == entry.name
    for value, entry in mav.enums["MAV_CMD"].items():
        if not entry.name.endswith("_ENUM_END"):
            assert common.enums["MAV_CMD"][value].name == entry.name


def test_failure_enumerations_equal_stock() -> None:
    for name in ("FAILURE_UNIT", "FAILURE_TYPE"):
        ours = {v: e.name for v, e in mav.enums[name].items() if not e.name.endswith("_ENUM_END")}
        stock = {v: e.name for v, e in common.enums[name].items() if not e.name.endswith("_ENUM_END")}
        assert ours.items() <= stock.items()
        assert name == "FAILURE_UNIT" or ours == stock
    assert mav.enums["MAV_CMD"][420].name == common.enums["MAV_CMD"][420].name
    assert "channel" in mav.enums["MAV_CMD"][420].param[4]


@pytest.mark.parametrize("name", ["FDI_STATUS", "WAKE_POSITION"])
def test_air_data_messages_have_a_field_for_every_value_of_their_type(name: str) -> None:
    kind = {"FDI_STATUS": FdiStatus, "WAKE_POSITION": WakeFix}[name]
    slots = wire.BY_NAME[name].slots
    renamed = {"t_us": "time_usec", "pos_f": "pos", "vel_f": "vel", "wind_f": "wind", "height_m": "height"}
    renamed |= dict.fromkeys(("cov_yy", "cov_yz", "cov_zz"), "cov")
    assert {renamed.get(f.name, f.name) for f in dataclasses.fields(kind)} == set(slots)
    assert wire.BY_NAME[name].size <= 255


def test_generated_files_are_current(capsys: pytest.CaptureFixture[str]) -> None:
    assert gen.main(["--check"]) == 0, capsys.readouterr().err
    assert gen.make_module() == gen.make_module()


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
    root = gen.check_xml(gen.XML.read_text())
    dimensionless = re.compile(
        r"^(q\d|q_nb|attitude_q|repr_offset_q|nis|gamma|threshold|residual|scale|scale_sigma|window_nis|window_drift|weight|hazard|hazard_states|hazard_monitor|quick|slow|throttle|controls|rates|position_cov|param\d|param_value|.*_ratio)$"
    )
    for m in root.iter("message"):
        for f in m.findall("field"):
            floating = f.attrib["type"].startswith(("float", "double"))
            if floating and not dimensionless.match(f.attrib["name"]):
                assert f.attrib.get("units"), f"{m.attrib['name']}.{f.attrib['name']} has no units"


def test_icd_rules_are_enforced() -> None:
    def xml(body: str) -> str:
        return f"<mavlink><messages>{body}</messages></mavlink>"

    big = '<message id="1" name="BIG"><description>x</description><field type="double[32]" name="a">x</field></message>'
    with pytest.raises(gen.IcdError, match="message BIG: payload 256 bytes"):
        gen.check_xml(xml(big))
    bare = '<message id="1" name="M"><description>x</description><field type="float" name="a"></field></message>'
    with pytest.raises(gen.IcdError, match="message M, field a: no description"):
        gen.check_xml(xml(bare))
    ok = '<message id="1" name="{}"><description>x</description></message>'
    with pytest.raises(gen.IcdError, match="id 1 is already used by A"):
        gen.check_xml(xml(ok.format("A") + ok.format("B")))
    with pytest.raises(gen.IcdError, match="no description"):
        gen.check_xml(xml('<message id="1" name="A"/>'))


def test_own_messages_start_at_53000_and_do_not_collide() -> None:
    own = {n: s.id for n, s in wire.BY_NAME.items() if n not in STOCK and n != "FUEL_STATUS"}
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
