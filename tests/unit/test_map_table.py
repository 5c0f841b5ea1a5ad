"""A wake map of somebody's own: the table becomes the stored form and works as the others do, or is refused."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.airdata.contour.algorithms import locate
from flightsw.missions.receiver.airdata.contour.contours import Contours
from flightsw.missions.receiver.airdata.contour.params import ContourParams
from flightsw.missions.receiver.airdata.contour.position import ContourPosition
from flightsw.missions.receiver.airdata.contour.wake_map import READINGS, MapOrigin, load_map
from flightsw.strict import ConfigError, read_toml
from hil_scripts.studies.sevil.map_table import read_table
from hil_scripts.studies.sevil.wake_map import main

PROBES = [list(p.position_m) for p in load_aircraft("learjet24").probe]
HEAD = {
    "x_m": "-35.14", "V_mps": "195.0", "rho_kgpm3": "0.589", "psi_deg": "0.0", "theta_deg": "2.08", "phi_deg": "0.0",
    "probes_m": str(PROBES), "source": '"somebody\'s RANS, table 4"', "licence": '"CC BY 4.0"',
}  # fmt: skip


def table(head: dict[str, str], columns: list[str], rows: np.ndarray) -> str:
    lines = [f"# {k} = {v}" for k, v in head.items()] + [",".join(columns)]
    return "\n".join([*lines, *(",".join(repr(float(v)) for v in r) for r in rows)]) + "\n"


def of_contact(seed: int | None = None) -> tuple[list[str], np.ndarray]:
    """Columns and rows of the map `contact`, sideslip in degrees; seed: both in another order."""
    m = load_map("contact")
    cols = ["y_m", "z_m", *(f"{r}_{'mps' if r[0] == 'V' else 'deg' if r[0] == 'b' else 'rad'}" for r in READINGS)]
    r = m.readings.reshape(9, -1).T.copy()
    r[:, 3:6] = np.degrees(r[:, 3:6])
    rows = np.hstack([m.nodes(), r])
    if seed is not None:
        g = np.random.default_rng(seed)
        order = g.permutation(len(cols))
        cols, rows = [cols[i] for i in order], rows[g.permutation(len(rows))][:, order]
    return cols, rows


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    csv = tmp_path / "rans.csv"
    csv.write_text(table(HEAD, *of_contact(seed=5)))
    main(["import", str(csv), "--out", str(tmp_path / "maps")])
    return tmp_path / "maps" / "rans.toml"


def test_rows_and_columns_in_any_order_give_the_map(stored: Path) -> None:
    m, own = load_map(str(stored)), load_map("contact")
    assert (
        isinstance(m.spec, MapOrigin) and m.spec.source == "somebody's RANS, table 4" and m.spec.licence == "CC BY 4.0"
    )
    assert (m.spec.x_m, m.spec.theta_deg, [list(p) for p in m.spec.probes_m]) == (-35.14, 2.08, PROBES)
    assert (m.y == own.y).all() and (m.z == own.z).all()
    assert np.abs(m.readings - own.readings).max() < 1e-15
    meta = read_toml(stored)
    csv = stored.parent.parent / "rans.csv"
    assert meta["table_sha256"] == hashlib.sha256(csv.read_bytes()).hexdigest() and meta["nodes"] == 441


def test_it_is_flown_and_scored_as_those_of_the_software(stored: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = Contours(load_map("contact"))
    est = ContourPosition(load_aircraft("learjet24"), "algorithm_11", ContourParams(map=str(stored), window=1))
    y = own.map.readings[:, 7, 13]
    fix = est.step(0, y, 0x1FF, np.array([-35.0, 0.0, 9.0]), np.zeros(3))
    assert fix.valid and fix.pos_f[1:] == pytest.approx(locate(11, own, y), abs=1e-6)
    capsys.readouterr()
    main(["score", "--map", str(stored)])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("441 nodes") and len(lines) == 18
    main(["score", "--map", "contact"])
    assert capsys.readouterr().out.splitlines()[0].startswith("441 nodes")


def test_uneven_nodes_are_a_grid_too(tmp_path: Path) -> None:
    cols, rows = of_contact()
    keep = (np.abs(rows[:, 0] + 1.8) > 1e-9) & (np.abs(rows[:, 1] - 7.1) > 1e-9)
    (tmp_path / "a.csv").write_text(table(HEAD, cols, rows[keep]))
    m = read_table(tmp_path / "a.csv")
    assert (len(m.y), len(m.z)) == (20, 20)


def changed(cell: str, value: float, row: int = 6) -> str:
    cols, rows = of_contact()
    rows[row, cols.index(cell)] = value
    return table(HEAD, cols, rows)


def without_row(rows_kept: slice) -> str:
    cols, rows = of_contact()
    return table(HEAD, cols, rows[rows_kept])


def doubled() -> str:
    cols, rows = of_contact()
    return table(HEAD, cols, np.vstack([rows, rows[3]]))


def headed(**change: str | None) -> str:
    head = {k: v for k, v in {**HEAD, **change}.items() if v is not None}
    return table(head, *of_contact())


def named(old: str, new: str) -> str:
    cols, rows = of_contact()
    return table(HEAD, [new if c == old else c for c in cols], rows)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (changed("V1_mps", 380.0), "line 17: V1 = '380.0': allowed 97.5 to 292.5"),  # knots
        (changed("beta2_deg", 60.0), "line 17: beta2 = '60.0': allowed -45 to 45"),
        (changed("alpha3_rad", 2.1), "line 17: alpha3 = '2.1': allowed -0.7854 to 0.7854"),  # degrees under rad
        (changed("alpha3_rad", float("nan")), "line 17: alpha3 = 'nan': allowed"),
        (changed("y_m", float("inf")), "line 17: y = 'inf': allowed -500 to 500"),
        (without_row(slice(1, None)), "node y = -2, z = 6.5 is missing; allowed: every y with every z, once"),
        (doubled(), "node y = -1.4, z = 6.5 is there twice"),
        (without_row(slice(0, 21)), "z: shape (1,); allowed: two or more nodes"),
        (without_row(slice(0, 0)), "allowed: two or more nodes"),
        (headed(theta_deg=None), "theta_deg: missing key; needed: x_m"),
        (headed(licence=None), "licence: missing key"),
        (headed(licence='" "'), "licence = ' ': allowed: whose data"),
        (headed(theta_deg="90.0"), "theta_deg = 90.0: allowed -45 to 45"),
        (headed(speed_kt="380.0"), "speed_kt: unknown key; allowed: x_m"),
        (headed(probes_m="[[6.0, 0.0, 0.0]]"), "probes_m"),
        (headed(V_mps="= 3"), "not valid TOML"),
        (named("V1_mps", "V1_kt"), "column 'V1_kt': allowed: y_m, z_m, V1_mps"),
        (named("alpha1_rad", "alpha2_deg"), "alpha2 is there twice"),
        ("# x_m = 1.0\n", "V_mps: missing key"),
        ("\n".join(headed().splitlines()[:9]), "no line with the names of the columns"),
        (headed().replace("\n-2.0,6.5,", "\n-2.0,6.5,7.0,", 1), "line 11: 12 values; allowed: 11"),
    ],
)
def test_tables_are_refused_by_field_and_value(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(ConfigError) as e:
        read_table(tmp_path / "a.csv")
    assert words in str(e.value) and "a.csv" in str(e.value)


def test_a_column_that_is_not_there_is_named(tmp_path: Path) -> None:
    cols, rows = of_contact()
    (tmp_path / "a.csv").write_text(table(HEAD, cols[:-1], rows[:, :-1]))
    with pytest.raises(ConfigError, match="no column alpha3_rad or alpha3_deg"):
        read_table(tmp_path / "a.csv")
    with pytest.raises(ConfigError, match="cannot be read"):
        read_table(tmp_path / "none.csv")


def test_the_command_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.csv").write_text(doubled())
    with pytest.raises(SystemExit):
        main(["import", str(tmp_path / "a.csv"), "--out", str(tmp_path)])
    assert "is there twice" in capsys.readouterr().err and not list(tmp_path.glob("*.npz"))


def test_stored_data_that_are_no_map_are_refused(stored: Path) -> None:
    """Hashes alone do not make a map: somebody else's program may have written them."""
    good = dict(np.load(stored.with_suffix(".npz")))
    spoilt = good["readings"].copy()
    spoilt[3, 4, 5] = np.nan
    broken = {
        "readings: shape": {**good, "readings": good["readings"][:8]},
        "rising": {**good, "y": good["y"][::-1]},
        "1 values not finite": {**good, "readings": spoilt},
        "missing array z": {k: v for k, v in good.items() if k != "z"},
    }  # fmt: skip
    for words, arrays in broken.items():
        np.savez(stored.with_suffix(".npz"), **arrays)
        old = read_toml(stored)["data_sha256"]
        new = hashlib.sha256(stored.with_suffix(".npz").read_bytes()).hexdigest()
        stored.write_text(stored.read_text().replace(old, new))
        with pytest.raises(ConfigError, match=words):
            load_map(str(stored))
