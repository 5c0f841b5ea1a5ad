"""Radiosonde files: every form gives the wind it states, whatever cannot be is refused by file and line."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from flightsw.strict import ConfigError
from sim_plant.scenario import load_scenario
from sim_plant.wind.prevailing import DATA, read_sounding
from sim_plant.wind.sounding import KNOT, Sounding, read

FILES = Path(__file__).resolve().parent.parent / "data" / "soundings"
RULE = "-" * 77
HEAD = "   PRES   HGHT   TEMP   DWPT   RELH   MIXR   DRCT   SKNT   THTA   THTE   THTV"
UNIT = "    hPa     m      C      C      %    g/kg    deg   knot     K      K      K "
LEVELS = [
    " 1000.0    111   15.0    5.0     50   5.00    270     20  280.0  290.0  280.5",
    "  700.0   3012    0.0  -10.0     45   2.50    270     20  280.0  290.0  280.5",
    "  400.0   7185  -30.0  -40.0     30   0.20    270     20  280.0  290.0  280.5",
    "  250.0  10363  -50.0  -60.0     20   0.03    270     20  280.0  290.0  280.5",
]


def listing(path: Path, levels: list[str] = LEVELS, head: str = HEAD, unit: str = UNIT) -> Path:
    path.write_text("\n".join([RULE, head, unit, RULE, *levels]) + "\n")
    return path


def speeds(s: Sounding) -> np.ndarray:
    return np.hypot(s.wind[:, 1], s.wind[:, 2])


@pytest.mark.parametrize(
    ("name", "speed"),
    [
        ("sounding_uwyo_metres_per_second.txt", 20.0),
        ("sounding_uwyo_new_csv.csv", 20.0),
        ("sounding_latin1.txt", 20.0 * KNOT),
    ],
)
def test_the_header_decides_the_unit(name: str, speed: float) -> None:
    """A wind from 270 deg blows east, at every level."""
    s = read(FILES / name)
    assert s.wind[:, 0].tolist() == [111.0, 3012.0, 7185.0, 10363.0]
    assert s.wind[:, 2] == pytest.approx([speed] * 4, rel=1e-12)
    assert np.abs(s.wind[:, 1]).max() < 1e-12


def test_spc_file_gives_its_levels() -> None:
    """Omaha: 69 levels with wind, 28 of them below 12.5 km; 55 kt at 3048 m, 23 kt from 150 deg at the ground."""
    s = read_sounding("sounding_oax_20140616_19z_spc.txt")
    assert len(s.wind) == 69 and int((s.wind[:, 0] < 12500.0).sum()) == 28
    a = math.radians(150.0)
    assert s.wind[0] == pytest.approx([350.0, -23.0 * KNOT * math.cos(a), -23.0 * KNOT * math.sin(a)])
    low = s.wind[:, 0] < 12500.0
    assert speeds(s)[low].max() == pytest.approx(55.0 * KNOT, abs=0.01)
    assert s.wind[low][np.argmax(speeds(s)[low]), 0] == 3048.0


def test_temperature_and_pressure_are_kept_also_where_the_wind_is_missing() -> None:
    """Omaha: 27.8 C and 965 hPa at 350 m; 27.4 C at 377.51 m, a level without wind."""
    s = read_sounding("sounding_oax_20140616_19z_spc.txt")
    assert len(s.air) > len(s.wind)
    assert s.air[0] == pytest.approx([350.0, 96500.0, 300.95])
    assert s.temperature(377.51) == pytest.approx(300.55)
    assert s.temperature(0.5 * (350.0 + 377.51)) == pytest.approx(300.75)
    with pytest.raises(ValueError, match=r"oax.*temperature at 349 m; known: 350 to"):
        s.temperature(349.0)
    oun = read_sounding("sounding_oun_20181222_12z_uwyo.txt")
    assert oun.temperature(345.0) == pytest.approx(273.15 + 3.6)
    assert oun.temperature(3658.0) == pytest.approx(273.15 - 1.7)


def test_other_columns_are_refused_by_file_and_line() -> None:
    with pytest.raises(ConfigError, match=r"sounding_other_columns\.txt': line 1: columns .*uwin.*missing: direction"):
        read(FILES / "sounding_other_columns.txt")


def test_kelvin_and_swapped_columns_are_read_by_their_names(tmp_path: Path) -> None:
    """Speed before direction, temperature in kelvin: a position would get both wrong."""
    levels = [v[:42] + v[49:56] + v[42:49] + v[56:] for v in LEVELS]
    s = read(
        listing(
            tmp_path / "a.txt",
            [v[:14] + "  288.0" + v[21:] for v in levels],
            HEAD[:42] + HEAD[49:56] + HEAD[42:49] + HEAD[56:],
            UNIT[:14].replace("C", "K") + "     K " + UNIT[21:42] + UNIT[49:56] + UNIT[42:49] + UNIT[56:],
        )
    )
    assert s.wind[:, 2] == pytest.approx([20.0 * KNOT] * 4) and s.temperature(5000.0) == pytest.approx(288.0)


@pytest.mark.parametrize(
    ("at", "cell", "said"),
    [
        (49, "   9999", r"line 6: speed = 9999; allowed 0 to 388"),
        (42, "    999", r"line 6: direction = 999; allowed 0 to 360"),
        (7, "  99999", r"line 6: height = 99999; allowed -500 to 60000"),
        (14, "  999.0", r"line 6: temperature = 999\.0; allowed -143"),
        (49, "     2O", r"line 6: speed = '2O'; allowed: a number"),
    ],
)
def test_a_level_that_cannot_be_is_refused_by_its_line(tmp_path: Path, at: int, cell: str, said: str) -> None:
    levels = [LEVELS[0], LEVELS[1][:at] + cell + LEVELS[1][at + 7 :], *LEVELS[2:]]
    with pytest.raises(ConfigError, match=r"a\.txt': " + said):
        read(listing(tmp_path / "a.txt", levels))


def test_an_unknown_unit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"line 3: unit of column sknt = 'mph'; allowed: knot, .*m/s"):
        read(listing(tmp_path / "a.txt", unit=UNIT.replace("knot", " mph")))
    with pytest.raises(ConfigError, match=r"unit of column hght"):
        read(listing(tmp_path / "b.txt", unit=RULE))


def test_two_ascents_in_one_file_are_refused(tmp_path: Path) -> None:
    one = listing(tmp_path / "one.txt").read_text()
    (tmp_path / "two.txt").write_text(one + "\n72357 OUN Observations at 00Z\n\n" + one)
    with pytest.raises(ConfigError, match=r"line 13: a second ascent begins here"):
        read(tmp_path / "two.txt")
    with pytest.raises(ConfigError, match=r"line 9: height 111 m after 10363 m: a second ascent"):
        read(listing(tmp_path / "glued.txt", LEVELS + LEVELS))


def test_station_data_below_the_levels_are_not_levels_and_text_between_them_is_refused(tmp_path: Path) -> None:
    tail = ["Station information and sounding indices", "    Station identifier: OUN", "    Station elevation: 345.0"]
    assert len(read(listing(tmp_path / "a.txt", LEVELS + tail)).wind) == 4
    with pytest.raises(ConfigError, match=r"line 7: not a level, but levels follow in line 8"):
        read(listing(tmp_path / "b.txt", [*LEVELS[:2], "##### telemetry lost #####".replace("#", "x"), *LEVELS[2:]]))


def test_a_balloon_that_sinks_a_little_loses_those_levels_only(tmp_path: Path) -> None:
    sinking = LEVELS[1].replace("3012", "2990").replace("     20", "     99", 1)
    s = read(listing(tmp_path / "a.txt", [*LEVELS[:2], sinking, *LEVELS[2:]]))
    assert s.wind[:, 0].tolist() == [111.0, 3012.0, 7185.0, 10363.0] and speeds(s) == pytest.approx([20 * KNOT] * 4)


def test_a_file_without_header_or_without_wind_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("\n".join(LEVELS))
    with pytest.raises(ConfigError, match=r"a\.txt': no line names the columns; known: Wyoming"):
        read(tmp_path / "a.txt")
    with pytest.raises(ConfigError, match=r"fewer than two levels"):
        read(listing(tmp_path / "b.txt", [v[:42] + " " * 14 + v[56:] for v in LEVELS]))


# --- an ascent that did not measure the wind where it is flown -----------------------------------------------------
def fly_in(name: str | Path) -> None:
    load_scenario("refueling", {"wind.sounding": str(name)}).load_aircraft()


def test_an_ascent_that_ends_below_the_flight_is_refused_with_both_heights() -> None:
    with pytest.raises(ConfigError, match=r"wind up to 3012 m, and aircraft\.tanker starts at 7010 m"):
        fly_in(FILES / "sounding_wind_lost_above_3km.txt")
    fly_in(FILES / "sounding_uwyo_metres_per_second.txt")


def test_wind_lost_over_a_stretch_is_refused_there_and_flown_elsewhere(tmp_path: Path) -> None:
    lost = [LEVELS[0], LEVELS[1], LEVELS[2][:42] + " " * 14 + LEVELS[2][56:], LEVELS[3]]
    s = read(listing(tmp_path / "a.txt", lost))
    assert s.lost(7010.0) == "no wind between 3012 and 10363 m"
    assert s.lost(2000.0) == s.lost(111.0) == s.lost(0.0) == ""
    late = read(listing(tmp_path / "b.txt", [LEVELS[0][:42] + " " * 14 + LEVELS[0][56:], *LEVELS[1:]]))
    assert late.lost(500.0) == "levels from 111 m, wind from 3012 m only" and late.lost(50.0) == ""


def test_shipped_ascents_are_read() -> None:
    for path in DATA.glob("sounding*.txt"):
        assert len(read(path).wind) > 60
