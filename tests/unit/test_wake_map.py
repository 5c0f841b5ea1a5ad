"""Wake maps: what is stored is what the command makes, and says where it comes from."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.airdata.contour.wake_map import MAPS, MapSpec, load_map
from flightsw.strict import ConfigError, read_toml
from hil_scripts.studies.sevil.wake_map import SPECS, expected_readings, main, make_map, spec_for

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("small", "extended")


@pytest.mark.parametrize(
    ("name", "y", "z"), [("small", (-2, 2, 21), (6.5, 10.5, 21)), ("extended", (-4, 68, 73), (-6, 14, 21))]
)
def test_grids_are_those_of_the_source(name: str, y: tuple, z: tuple) -> None:
    """441 and 1533 nodes (sevil.md section 2)."""
    m = load_map(name)
    assert np.allclose(m.y, np.linspace(*y), atol=1e-12)
    assert np.allclose(m.z, np.linspace(*z), atol=1e-12)
    assert m.readings.shape == (9, len(m.z), len(m.y))
    assert len(m.nodes()) == {"small": 441, "extended": 1533}[name]


@pytest.mark.parametrize("name", NAMES)
def test_stored_map_is_what_its_specification_makes(name: str) -> None:
    """Made again from the stored provenance and from the program's defaults: equal to rounding of the C library."""
    stored = load_map(name)
    assert stored.spec == SPECS[name]
    assert np.abs(make_map(stored.spec).readings - stored.readings).max() < 1e-12


def test_command_writes_the_same_bytes_every_time(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        main(["make", "--out", str(tmp_path / folder)])
    for name in NAMES:
        for kind in ("npz", "toml"):
            a, b = ((tmp_path / f / f"{name}.{kind}").read_bytes() for f in ("a", "b"))
            assert a == b
        again, stored = read_toml(tmp_path / "a" / f"{name}.toml"), read_toml(MAPS / f"{name}.toml")
        assert again["parameters"] == stored["parameters"]
        assert again["parameters_sha256"] == stored["parameters_sha256"]
        assert stored["data_sha256"] == hashlib.sha256((MAPS / f"{name}.npz").read_bytes()).hexdigest()


def test_command_for_other_aircraft(tmp_path: Path) -> None:
    main(["make", "--out", str(tmp_path), "--tanker", "kc135r", "--receiver", "learjet24", "--mass", "1.1e5"])
    m = load_map("small", tmp_path)
    assert m.spec.probes_m[1] == (-0.5, -5.2, 0.0)
    assert m.spec.wake.mass_kg == 1.1e5
    assert m.spec == spec_for(SPECS["small"], "kc135r", "learjet24", 1.1e5)


@pytest.mark.parametrize(
    ("args", "word"),
    [
        (["--tanker", "kc135r"], "--tanker and --receiver: give both"),
        (["--mass", "5"], "--mass = 5.0: allowed 1000"),
        (["--tanker", "kc135r", "--receiver", "none"], "none"),
        (
            ["--tanker", "kc135r", "--receiver", "learjet24", "--flight", "receiver_airdata"],
            "--flight: allowed without",
        ),
        (["--name", "other"], "--name: allowed with --grid"),
        (["--theta", "60"], "theta_deg = 60.0: allowed -45 to 45"),
        (["--flight", "nowhere"], "nowhere.toml"),
    ],
)
def test_command_refuses_bad_arguments(
    tmp_path: Path, args: list[str], word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["make", "--out", str(tmp_path), *args])
    assert word in capsys.readouterr().err


def test_map_of_a_flight_file_has_its_wake_and_the_probes_of_its_aircraft(tmp_path: Path) -> None:
    main(
        [
            "make",
            "--out",
            str(tmp_path),
            "--flight",
            "receiver_airdata",
            "--grid",
            "small",
            "--name",
            "mine",
            "--V",
            "195",
        ]
    )
    spec = load_map(str(tmp_path / "mine.toml")).spec
    believed = read_toml(ROOT / "flightsw/params/receiver_airdata.toml")["airdata"]["wake"]
    assert isinstance(spec, MapSpec) and list(tmp_path.glob("*.npz")) == [tmp_path / "mine.npz"]
    assert (spec.wake.mass_kg, list(spec.wake.tail_m)) == (believed["mass_kg"], believed["tail_m"])
    assert (spec.V_mps, spec.probes_m) == (195.0, tuple(p.position_m for p in load_aircraft("learjet24").probe))


def test_map_that_is_not_its_provenance_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"allowed: .*extended, small"):
        load_map("large")
    for kind in ("npz", "toml"):
        shutil.copy(MAPS / f"small.{kind}", tmp_path)
    toml = tmp_path / "small.toml"
    text = toml.read_text()
    toml.write_text(text.replace("theta_deg = 3.0", "theta_deg = 2.0"))
    with pytest.raises(ConfigError, match="parameters_sha256"):
        load_map("small", tmp_path)
    toml.write_text(text)
    data = tmp_path / "small.npz"
    data.write_bytes(data.read_bytes()[:-1] + b"\x01")
    with pytest.raises(ConfigError, match="data_sha256"):
        load_map("small", tmp_path)


def test_map_is_mirror_symmetric() -> None:
    """V and alpha left(y) = right(-y), beta left(y) = -beta right(-y), nose beta odd (sevil.md trap 3)."""
    r = load_map("small").readings
    for first, sign in ((0, 1.0), (3, -1.0), (6, 1.0)):
        assert np.abs(r[first + 1] - sign * r[first + 2][:, ::-1]).max() < 1e-10
        assert np.abs(r[first] - sign * r[first][:, ::-1]).max() < 1e-10


def test_map_has_right_on_the_right() -> None:
    """At y = +1: nose and right tip read negative sideslip, left tip positive. Swapped tips or a mirrored y fail."""
    m = load_map("small")
    beta = m.readings[3:6, 10, 15]
    assert m.y[15] == 1.0
    assert beta[0] < 0 and beta[1] > 0 and beta[2] < 0
    assert abs(beta[2]) > abs(beta[1])


def test_e02_expected_sideslip_passes_through_zero() -> None:
    """Erratum E2 (map side): at contact the expected sideslips are (0, b, -b), at observation all near 0: no quotient of
    measured and expected sideslip is defined, only a difference."""
    contact = expected_readings(SPECS["small"], np.array([[0.0, 8.5]]))[0, 3:6]
    assert contact[0] == pytest.approx(0.0, abs=1e-15)
    assert contact[1] == pytest.approx(-contact[2], rel=1e-12)
    assert np.degrees(contact[1]) == pytest.approx(0.36, abs=0.02)
    far = expected_readings(replace(SPECS["small"], x_m=-59.13), np.array([[56.33, 0.0]]))[0, 3:6]
    assert np.degrees(np.abs(far)).max() < 0.05


def test_uniform_wind_shifts_all_probes_alike() -> None:
    """In a uniform wind along y every probe's sideslip shifts by nearly the same angle, -w / V."""
    pts = np.array([[0.5, 8.0], [-1.0, 9.0]])
    d = expected_readings(SPECS["small"], pts, np.array([0.0, 1.0, 0.0])) - expected_readings(SPECS["small"], pts)
    assert d[:, 3:6] == pytest.approx(np.full((2, 3), -1.0 / 200.0), rel=2e-3)
