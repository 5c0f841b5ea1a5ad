"""Algorithms 11 and 15 on board: straight contours in closed form, lag, no answer, the offline result, refusals."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.missions.receiver.airdata.airdata_params import AirDataParams
from flightsw.missions.receiver.airdata.contour.algorithms import locate
from flightsw.missions.receiver.airdata.contour.choice import make_contours
from flightsw.missions.receiver.airdata.contour.contours import Contours
from flightsw.missions.receiver.airdata.contour.params import METHODS, ContourParams
from flightsw.missions.receiver.airdata.contour.position import ContourPosition
from flightsw.missions.receiver.airdata.contour.wake_map import MAPS, MapOrigin, WakeMap, load_map
from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.told import Told
from flightsw.strict import ConfigError, convert
from hil_scripts.studies.sevil.wake_map import save_map

ALL = 0x1FF
BETA, ALPHA = 0b111 << 3, 0b111 << 6
XD = np.array([0.1, 0.0, 0.0])
# slopes of the nine readings in y and z: no two lines of one variable are parallel
SLOPES = (
    np.array([[0.1, 0.2], [0.2, -0.1], [0.0, 0.1], [1, 0.2], [0.3, 1], [-1, 1], [0.2, 1], [1, -0.4], [1, 1]]) * 1e-2
)


def aircraft() -> Aircraft:
    return load_aircraft("learjet24")


def readings(at: tuple[float, float]) -> np.ndarray:
    return np.array([195.0] * 3 + [0.001] * 3 + [0.02] * 3) + SLOPES @ (np.array(at) - (0.0, 8.5))


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A map on which every reading is linear in y and z: its contours are straight lines, also between the nodes."""
    folder = tmp_path_factory.mktemp("map")
    y, z = np.array([-2.0, -1.3, -0.5, 0.4, 2.0]), np.linspace(6.5, 10.5, 9)
    r = np.moveaxis(np.array([[readings((a, b)) for a in y] for b in z]), -1, 0)
    a, b, c = (p.position_m for p in aircraft().probe)
    save_map(WakeMap(MapOrigin("made up", "none", probes_m=(a, b, c)), y, z, np.ascontiguousarray(r)), "plain", folder)
    return str(folder / "plain.toml")


def made(method: str, map_name: str, **more: float) -> ContourPosition:
    return ContourPosition(aircraft(), method, ContourParams(map=map_name, **{"window": 1, **more}))  # type: ignore[arg-type]


def near(at: tuple[float, float]) -> np.ndarray:
    return np.array([-35.0, *at])


@pytest.mark.parametrize("method", [m for m in METHODS if m != "filter"])
def test_straight_contours_cross_where_the_readings_were_taken(plain: str, method: str) -> None:
    """Six lines through one point: it is the answer, whatever the nodes; x and its rate are what was given."""
    est, g = made(method, plain, sigma_m=(0.5, 0.7)), np.random.default_rng(1)
    for k in range(100):
        at = float(g.uniform(-1.9, 1.9)), float(g.uniform(6.6, 10.4))
        fix = est.step(k, readings(at), ALL, near(at), XD)
        assert fix.valid and fix.reason == "" and fix.t_us == k
        assert fix.pos_f == pytest.approx((-35.0, *at), abs=1e-9)
        assert (fix.cov_yy, fix.cov_yz, fix.cov_zz) == pytest.approx((0.25, 0.0, 0.49))
        assert fix.vel_f[0] == 0.1 and math.isnan(fix.vel_f[1]) and math.isnan(fix.vel_f[2])
        assert fix.nis_dof == 0  # there is no innovation


def test_a_mean_of_n_readings_lags_by_half_of_n_less_one(plain: str) -> None:
    """On a ramp through linear contours, exactly."""
    n, v = 20, 0.01  # [m] per sample
    est = made("algorithm_11", plain, window=n)
    for k in range(60):
        at = (-1.0 + v * k, 8.5)
        fix = est.step(k, readings(at), ALL, near(at), XD)
        behind = 0.5 * (min(n, k + 1) - 1)
        assert fix.pos_f[1] == pytest.approx(at[0] - v * behind, abs=1e-9)


def test_one_crossing_of_one_variable_is_kept_by_11_and_not_by_15(plain: str) -> None:
    """Table 4.2, last column. Beta of two probes and no alpha: one crossing."""
    at, two = (0.5, 8.0), 0b011 << 3
    for method, kept in (("algorithm_11", True), ("algorithm_15", False)):
        fix = made(method, plain).step(0, readings(at), two, near(at), XD)
        assert fix.valid is kept
        assert fix.pos_f[1:] == (
            pytest.approx(at, abs=1e-9) if kept else pytest.approx((math.nan, math.nan), nan_ok=True)
        )


def test_crossings_of_one_variable_count_where_they_are_close(plain: str) -> None:
    """Beta of three probes, one of them wrong: the three crossings are metres apart, and a place only for a large epsilon."""
    at, y = (0.5, 8.0), readings((0.5, 8.0))
    y[5] += 0.01
    assert not made("algorithm_11", plain).step(0, y, BETA, near(at), XD).valid
    assert made("algorithm_11", plain, epsilon_m=5.0).step(0, y, BETA, near(at), XD).valid


def test_nothing_is_held(plain: str) -> None:
    """A position, then a set of readings that gives none: none is told, with its reason, and the next one is anew."""
    est, at = made("algorithm_11", plain), (0.2, 8.2)
    assert est.step(0, readings(at), ALL, near(at), XD).valid
    none = est.step(1, readings((0.2, 30.0)), ALL, near(at), XD)
    assert (none.valid, none.reason, none.cov_yy) == (False, "contours do not meet", 0.0)
    assert math.isnan(none.pos_f[1]) and math.isnan(none.pos_f[2]) and none.pos_f[0] == -35.0
    assert not est.step(2, np.full(9, np.nan), 0, near(at), XD).valid
    assert est.step(3, readings(at), ALL, near(at), XD).valid
    assert not est.step(4, readings(at), 0, near(at), XD).valid  # no reading may be used


def test_a_reading_that_may_not_be_used_is_not_in_the_mean(plain: str) -> None:
    est, at, wrong = made("algorithm_11", plain, window=10), (0.2, 8.2), readings((0.2, 8.2))
    wrong[4] += 0.02
    for k in range(5):
        est.step(k, wrong, ALL & ~(1 << 4), near(at), XD)
    assert est.mean(ALL & ~(1 << 4)) == pytest.approx([*wrong[:4], math.nan, *wrong[5:]], nan_ok=True)
    fix = est.step(5, readings(at), ALL, near(at), XD)  # back: what was refused before does not come in
    assert fix.pos_f[1:] == pytest.approx(at, abs=1e-9)


@pytest.mark.parametrize(
    ("place", "inside"), [((2.4, 8.5), True), ((2.6, 8.5), False), ((0.0, 11.1), False), ((0.0, 6.1), True)]
)
def test_the_map_is_asked_only_near_its_grid(plain: str, place: tuple[float, float], inside: bool) -> None:
    """At most half a metre outside; contours of readings from far away may cross inside it as well."""
    fix = made("algorithm_11", plain, outside_m=0.5).step(0, readings((1.0, 9.0)), ALL, near(place), XD)
    assert fix.valid is inside and (inside or fix.reason == "outside the map")


@pytest.mark.parametrize(("method", "number"), [("algorithm_11", 11), ("algorithm_15", 15)])
def test_it_is_the_offline_result_to_the_bit(method: str, number: int) -> None:
    """The map that comes with the software, noisy readings, mean over a second."""
    m, g = load_map("contact"), np.random.default_rng(3)
    cut, est = Contours(m), ContourPosition(aircraft(), method, ContourParams(map="contact"))
    clean, last, found = m.readings[:, 12, 8], [], 0
    for k in range(200):
        last.append(clean + g.normal(size=9) * np.repeat([0.447, 7.8e-4, 7.8e-4], 3))
        fix = est.step(k, last[-1], ALL, near((0.0, 8.9)), XD)
        mean = [math.fsum(r[c] for r in last[-20:]) / len(last[-20:]) for c in range(9)]
        want = locate(number, cut, mean)
        assert fix.valid is (want is not None)
        assert want is None or fix.pos_f[1:] == want
        found += fix.valid
    assert found > 20


def test_state_and_copies(plain: str) -> None:
    est, at = made("algorithm_11", plain, window=10), (0.2, 8.2)
    for k in range(7):
        est.step(k, readings((0.02 * k, 8.2)), ALL, near(at), XD)
    other, twin = made("algorithm_11", plain, window=10), copy.deepcopy(est)
    other.set_state(est.get_state())
    want = est.step(7, readings((0.5, 8.0)), ALL, near(at), XD)
    assert (
        other.step(7, readings((0.5, 8.0)), ALL, near(at), XD)
        == want
        == twin.step(7, readings((0.5, 8.0)), ALL, near(at), XD)
    )
    assert twin.cut is est.cut and twin._last is not est._last
    est.reset()
    assert est.step(8, readings(at), ALL, near(at), XD).pos_f[1:] == pytest.approx(at, abs=1e-9)


def test_exercise_leaves_no_kernel_for_the_flight(plain: str) -> None:
    made("algorithm_11", plain).exercise()
    made("algorithm_15", plain).exercise()


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"position": {"method": "algorithm_12"}}, "method = 'algorithm_12': allowed: filter, algorithm_11, algorithm_15"),
        ({"position": {"contours": {"map": "small"}}}, "map = 'small': nothing obeys it without method = 'algorithm_11'"),
        ({"position": {"contours": {"window": 5}}}, "contours.window = 5: nothing obeys it"),
        ({"position": {"method": "algorithm_11", "contours": {"sigma_m": [0.0, 1.0]}}}, "sigma_m = 0.0: allowed 0.001 to 100"),
        ({"position": {"method": "algorithm_11", "contours": {"window": 0}}}, "window = 0: allowed 1 to 1200"),
    ],
)  # fmt: skip
def test_keys_are_refused_by_name(table: dict, words: str) -> None:
    with pytest.raises(ConfigError) as e:
        convert(table, AirDataParams, "test")
    assert words in str(e.value)


def test_maps_that_cannot_be_used_are_refused_by_name(tmp_path: Path) -> None:
    p = WakePositionParams(method="algorithm_11", contours=ContourParams(map="smal"))
    with pytest.raises(ConfigError, match=r"map = 'smal': .* allowed: contact, extended, small.*did you mean 'small'"):
        make_contours(aircraft(), p)
    with pytest.raises(ConfigError, match=r"contours\.map = 'small': probes at .* a map of .*'s"):
        make_contours(aircraft(), replace(p, contours=ContourParams(map="small")))
    with pytest.raises(ConfigError, match=r"nowhere\.toml"):
        make_contours(aircraft(), replace(p, contours=ContourParams(map=str(tmp_path / "nowhere.toml"))))
    assert make_contours(aircraft(), WakePositionParams()) is None


def test_the_map_that_comes_with_the_software_is_made_for_the_flight_file() -> None:
    """`contact`: wake and probes of receiver_airdata.toml, contact inside the grid."""
    from hil_scripts.studies.sevil.wake_map import SPECS, make_map, spec_of_flight

    m = load_map("contact")
    s = m.spec
    base = replace(SPECS["small"], x_m=s.x_m, V_mps=s.V_mps, theta_deg=s.theta_deg)
    assert s == spec_of_flight(base, "receiver_airdata")
    assert np.abs(make_map(s).readings - m.readings).max() < 1e-12
    assert {p.name for p in MAPS.iterdir()} == {
        f"{n}.{k}" for n in ("contact", "extended", "small") for k in ("npz", "toml")
    }


def test_a_position_that_comes_and_goes_is_told_once() -> None:
    told = Told(patience=20)
    said = [t.text for k in range(200) for t in told.changes(0, k % 3 == 0, "contours do not meet")]
    assert said == []
    said = [t.text for _ in range(30) for t in told.changes(0, True, "")]
    assert said == ["wake position valid"]
    assert [t.text for t in told.changes(0, False, "no air data", at_once=True)] == ["wake position lost: no air data"]
