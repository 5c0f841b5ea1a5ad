"""`sil identify run:`: slopes are differences, the correction of intervals has its closed forms, known coefficients are found,
and what a flight does not tell or does not have is said by name."""

from __future__ import annotations

import dataclasses
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy.spatial.transform import Rotation

from flightsw.aircraft import load_aircraft
from flightsw.icd.port import WIRE
from flightsw.process.config import flight_of
from flightsw.sixdof.excitation import ExcitationParams, Multisine, harmonics
from flightsw.sixdof.trim import trim_free
from flightsw.strict import ConfigError
from hil_scripts.identify.flight import command, identified, logs, readings
from hil_scripts.identify.flight.identified import Identified, identify_flight
from hil_scripts.identify.flight.inputs import engine
from hil_scripts.identify.flight.intervals import autocovariance, correlated, taper, verdict
from hil_scripts.identify.flight.kernel import Y_EULER, Y_FORCE, Y_PROBE, Y_RATE, Y_VEL
from hil_scripts.identify.flight.model import COEFFICIENTS, NC, NS, FlightModel, lasting, quaternions, turn
from hil_scripts.identify.flight.readings import Flight, Gatherer, Samples
from hil_scripts.launch.runfolder import resolve
from hil_scripts.studies.identify.flight import SCENARIO
from hil_scripts.studies.integrity.snapshot import Flying

KC135 = load_aircraft("kc135r")
V, H, DT, SECONDS = 195.0, 7010.0, 0.02, 40.0
MASS = KC135.mass.empty_kg + KC135.mass.default_fuel_kg
SIGMA = {"imu": np.array([1e-3] * 3 + [0.02] * 3), "gnss": np.full(3, 0.05), "att": np.full(3, 1e-3),
         "air": np.array([0.1, 1e-3, 1e-3])}  # fmt: skip
EVERY = {"imu": 1, "gnss": 5, "att": 5, "air": 5}


def commanded() -> tuple[np.ndarray, np.ndarray]:
    """Surfaces [n,3] and throttle [n] about the trim of the file."""
    p = ExcitationParams(on=True, duration_s=SECONDS, band_hz=(0.025, 1.0))
    t = np.arange(round(SECONDS / DT)) * DT
    sines = [Multisine(k, a, SECONDS) for k, a in zip(harmonics(p), p.amplitudes, strict=True)]
    y = np.array([m.share * np.cos(np.outer(t, m.w) + m.phases).sum(axis=1) for m in sines])
    assert y[:, 777] == pytest.approx([m.at(float(t[777])) for m in sines], abs=1e-12)
    u = trim_free(KC135, MASS, H, V, 0.0).u
    return u[:3] + y[:3].T, u[3] / engine(KC135, V, H)[0] + y[3]


def empty(surfaces: np.ndarray, throttle: np.ndarray) -> Flight:
    """A flight whose samples are all zero but for attitude and airspeed."""
    n = len(throttle)
    samples = {}
    for k, width in (("imu", 6), ("gnss", 3), ("att", 4), ("air", 3)):
        at = np.arange(0, n, EVERY[k])
        values = np.zeros((len(at), width))
        values[:, 0] = {"att": 1.0, "air": V}.get(k, 0.0)
        samples[k] = Samples(at, values)
    samples["baro"] = Samples(np.array([0]), np.array([[H]]))
    return Flight("synthetic", DT, surfaces, throttle, samples, 0, n)


def true_aero(seed: int) -> np.ndarray:
    """Coefficients off from the file by up to a tenth."""
    return np.array(astuple(KC135.aero)) * (1.0 + np.random.default_rng(seed).uniform(-0.1, 0.1, NC))


def flown(seed: int) -> tuple[Flight, np.ndarray]:
    """A record of the model itself with other coefficients, sensors with white noise, and those coefficients."""
    rng = np.random.default_rng(seed)
    surfaces, throttle = commanded()
    bare = empty(surfaces, throttle)
    m = FlightModel(bare, KC135, 0, bare.ticks, lasting({}))
    t = trim_free(KC135, MASS, H, V, 0.0)
    x = m.mean.copy()
    x[:NC] = true_aero(seed)
    x[NC : NC + 9] = t.x[:9]
    x[NC + 12] = t.u[3]
    x[NC + NS :] = 0.0
    y = m.outputs(x)
    at = {k: s.at for k, s in bare.samples.items()}
    clean = {
        "imu": np.hstack([y[:, Y_RATE : Y_RATE + 3], y[:, Y_FORCE : Y_FORCE + 3]]),
        "gnss": y[at["gnss"], Y_VEL : Y_VEL + 3], "air": y[at["air"], Y_PROBE : Y_PROBE + 3],
    }  # fmt: skip
    samples = {k: Samples(at[k], v + SIGMA[k] * rng.standard_normal(v.shape)) for k, v in clean.items()}
    q = quaternions(y[at["att"], Y_EULER : Y_EULER + 3])
    half = 0.5 * SIGMA["att"] * rng.standard_normal((len(q), 3))
    w = q[:, 0] - (q[:, 1:] * half).sum(axis=1)
    v = q[:, :1] * half + q[:, 1:] + np.cross(q[:, 1:], half)
    q = np.column_stack([w, v])
    samples["att"] = Samples(at["att"], q / np.linalg.norm(q, axis=1)[:, None])
    samples["baro"] = bare.samples["baro"]
    return dataclasses.replace(bare, samples=samples), x[:NC]


@pytest.fixture(scope="module")
def found() -> tuple[Identified, np.ndarray]:
    f, truth = flown(1)
    return identify_flight(f, KC135, 0, f.ticks, {}), truth


def test_slopes_are_central_differences_and_those_of_the_constants_one() -> None:
    f, _ = flown(2)
    m = FlightModel(f, KC135, 0, 400, lasting({}))
    S = m.slopes(m.mean)
    h = m.steps(m.mean)
    for j in (0, 10, 16, NC + 1, NC + 7, NC + 9, NC + 12, NC + 13):
        ends = []
        for sign in (1.0, -1.0):
            x = m.mean.copy()
            x[j] += sign * h[j]
            ends.append(m.residuals(x))
        for s, up, down in zip(S, *ends, strict=True):
            central = (down - up) / (2.0 * h[j])
            assert np.abs(s[:, j] - central).max() <= 2e-3 * np.abs(central).max() + 1e-9
    for i, s in enumerate(S):
        assert (s[:, NC + NS + i] == 1.0).all()


def test_turns_lead_from_one_attitude_to_the_other() -> None:
    a = quaternions(np.array([[0.3, 0.1, -0.2]]))
    small = np.array([1e-3, -2e-3, 5e-4])
    q = np.array([1.0, *(0.5 * small)])
    b = np.array([[a[0, 0] - a[0, 1:] @ q[1:], *(a[0, 0] * q[1:] + a[0, 1:] + np.cross(a[0, 1:], q[1:]))]])
    assert turn(a, b)[0] == pytest.approx(small, rel=1e-5)
    assert turn(a, -b)[0] == pytest.approx(small, rel=1e-5)


def test_correlated_residuals_have_the_closed_form_of_a_first_order_process() -> None:
    """Mean of AR(1): variance s2 (1 + a) / (1 - a) / m; its autocovariance s2 a^k."""
    a, m = 0.8, 20000
    rng = np.random.default_rng(1)
    r = np.zeros(m)
    e = rng.standard_normal(m)
    for k in range(1, m):
        r[k] = a * r[k - 1] + e[k]
    s2 = 1.0 / (1.0 - a * a)
    c = autocovariance(r, 20)
    assert c == pytest.approx(s2 * a ** np.arange(21), abs=0.12)
    ones = np.ones((m, 1))
    exact = s2 * a ** np.arange(400)
    assert correlated(ones, exact)[0, 0] / m == pytest.approx(s2 * (1 + a) / (1 - a), rel=1e-3)
    lags = 400
    assert correlated(ones, autocovariance(r, lags) * taper(lags))[0, 0] / m == pytest.approx(
        s2 * (1 + a) / (1 - a), rel=0.25
    )


def test_the_toeplitz_product_is_the_matrix_product() -> None:
    rng = np.random.default_rng(2)
    S, c = rng.standard_normal((30, 2)), np.array([2.0, 0.7, -0.3])
    T = sum(v * (np.eye(30, k=k) + np.eye(30, k=-k)) / (2.0 if k == 0 else 1.0) for k, v in enumerate(c))
    assert correlated(S, c) == pytest.approx(S.T @ T @ S)


def test_known_coefficients_are_found(found: tuple[Identified, np.ndarray]) -> None:
    """95 % intervals hold at least 85 % of what is identified; the derivatives of first order are within 3 %."""
    one, truth = found
    told = one.verdict.identified
    assert len(told) >= 20
    assert sum(t.holds(truth) for t in told) >= 0.85 * len(told)
    for k in ("CL_alpha", "Cm_alpha", "Cm_de", "CY_beta", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr"):
        i = COEFFICIENTS.index(k)
        assert one.fit.x[i] == pytest.approx(truth[i], rel=0.03), k
    assert not one.coloured


def test_noise_of_the_sensors_is_found(found: tuple[Identified, np.ndarray]) -> None:
    sigma = dict(zip((c.name for c in found[0].model.channels), found[0].fit.sigma, strict=True))
    assert sigma["gyro_x"] == pytest.approx(1e-3, rel=0.1)
    assert sigma["acc_z"] == pytest.approx(0.02, rel=0.1)
    assert sigma["att_y"] == pytest.approx(1e-3, rel=0.15)
    assert sigma["alpha0"] == pytest.approx(1e-3, rel=0.15)


def test_pitch_rate_and_rate_of_incidence_are_told_together() -> None:
    """A pair of which only the sum is known: one is held at the file's value, the sum is told, and the file keeps it."""
    like = np.array(astuple(KC135.aero))
    i, j = COEFFICIENTS.index("CL_q"), COEFFICIENTS.index("CL_alphadot")
    C = np.diag((0.01 * np.maximum(np.abs(like), 1e-3)) ** 2)
    C[np.ix_([i, j], [i, j])] = [[25.0, -25.0 + 1e-3], [-25.0 + 1e-3, 25.0]]
    x = like.copy()
    x[i], x[j] = 9.0, -3.7
    v = verdict(x, like, C, C)
    assert "CL_alphadot" in v.held
    told = v.told[i]
    assert told.name.startswith("CL_q + ")
    assert told.name.endswith(" CL_alphadot")
    assert told.value == pytest.approx(9.0 - 3.7, abs=0.01)
    assert told.sigma < 0.1
    assert v.written[j] == like[j]
    assert v.written[i] + v.written[j] == pytest.approx(9.0 - 3.7, abs=0.01)


def test_a_sensor_that_is_not_there_is_named() -> None:
    f, _ = flown(3)
    without = dataclasses.replace(f, samples={k: v for k, v in f.samples.items() if k not in ("air", "att")})
    with pytest.raises(ConfigError, match=r"air \(airspeed, alpha, beta\), att \(attitude\)"):
        identify_flight(without, KC135, 0, f.ticks, {})


def test_too_short_a_flight_and_one_without_test_inputs_are_refused() -> None:
    f, _ = flown(3)
    with pytest.raises(ConfigError, match=r"5\.0 s to identify from"):
        identify_flight(f, KC135, 0, 250, {})
    with pytest.raises(ConfigError, match="nobody told of test inputs"):
        readings.window(dataclasses.replace(f, began=-1), None)
    with pytest.raises(ConfigError, match="--from 10 --to 99"):
        readings.window(f, (10.0, 99.0))


def test_a_folder_that_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no run folder"):
        command.identify(
            command.AskedOfFlight(f"run:{tmp_path}", "kc135r", None, tmp_path / "out"), Console(quiet=True)
        )


def test_the_logs_of_other_aircraft_are_refused_by_what_they_lack(tmp_path: Path) -> None:
    """Neither has accelerometers or a throttle; one has no surfaces and no vanes either."""
    data = Path(__file__).parents[2] / "data" / "flight_logs"
    for name, lacks, has in (
        ("ampyx_ap2_20171003_50hz.csv", ("acc_x_mps2", "throttle", "height_m"), ("elevator_rad", "alpha_rad")),
        ("alfa_carbonz_20180718_10hz.csv", ("acc_x_mps2", "elevator_rad", "alpha_rad", "throttle"), ("p_radps",)),
    ):
        with pytest.raises(ValueError, match="not in the log") as e:
            command.identify(
                command.AskedOfFlight(str(data / name), "kc135r", None, tmp_path / "out"), Console(quiet=True)
            )
        words = str(e.value).rpartition(": ")[2].split(", ")
        assert set(lacks) <= set(words)
        assert not set(has) & set(words)


def test_a_table_with_all_columns_is_identified_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The synthetic flight as a CSV of what the model was led by; what is drawn out between readings is correlated, no gust."""
    monkeypatch.setattr(identified, "COLOURED", 2.0)
    f, truth = flown(4)
    s = {k: v.values for k, v in f.samples.items()}
    n, every = f.ticks, np.arange(f.ticks)
    q = np.column_stack([np.interp(every, f.samples["att"].at, s["att"][:, i]) for i in range(4)])
    e = Rotation.from_quat(q, scalar_first=True).as_euler("ZYX")
    slow = {k: np.column_stack([np.interp(every, f.samples[k].at, c) for c in s[k].T]) for k in ("gnss", "air")}
    deflected = FlightModel(f, KC135, 0, n, lasting({})).surf[:, 0]
    parts = [every * DT, s["imu"], slow["air"][:, [0, 2, 1]], e, slow["gnss"], np.full(n, H), deflected, f.throttle]
    table = np.column_stack(parts)
    path = tmp_path / "flight.csv"
    np.savetxt(path, table, delimiter=",", header=",".join(c.name for c in logs.NEEDED), comments="", fmt="%.9g")
    out = command.identify(command.AskedOfFlight(str(path), "kc135r", None, tmp_path / "out"), Console(quiet=True))
    written = load_aircraft(str(out / "flight.toml")).aero
    for k in ("CL_alpha", "Cm_de", "Cl_da", "Cn_beta"):
        assert getattr(written, k) == pytest.approx(truth[COEFFICIENTS.index(k)], rel=0.05), k


def test_a_flight_is_read_on_the_grid_it_was_flown_on() -> None:
    """Deflections by the commands of the link are those of the plant, tick by tick; begin and end of the test inputs are told."""
    sets = ("tanker.excitation.on=true", "tanker.excitation.start_s=1.0", "tanker.excitation.duration_s=20.0",
            "tanker.excitation.band_hz=[0.1, 1.0]")  # fmt: skip
    cfg = flight_of(resolve(SCENARIO, 1, list(sets), None).flights[0].config, "tanker")
    flight, g = Flying(SCENARIO, 1, sets, WIRE), Gatherer(cfg, KC135)
    moved = []
    for _ in range(2300):
        received, (reply,), (telemetry,) = flight.tick_heard()
        g.take(received, reply, b"".join(telemetry))
        moved.append(flight.server.world.members[0].view.s[15:18])
    f = g.flight("seed 1")
    assert (f.began, f.ended) == (150, 2150)  # navigation is valid after half a second
    lo, hi = readings.window(f, None)
    true = np.array(moved)[lo:hi]
    found = FlightModel(f, KC135, lo, hi, lasting(cfg.tables)).surf[:, 0]
    assert np.abs(true).max() > 0.08
    assert np.abs(found - true).max() < 2e-4
