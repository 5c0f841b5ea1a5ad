"""Metrics have known answers on a run with known errors."""

from __future__ import annotations

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from flightsw.icd.tlog import TlogWriter, read
from ground.columns import LogError
from ground.metrics import compute
from ground.views.refueling.figures import error_stats
from ground.wind import wind_stats

Synth = runpy.run_path(str(Path(__file__).with_name("ground_synth.py")))["Synth"]
ERROR, WIND = (0.1, -0.2, 0.3), (0.2, 0.0, -0.1)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """100 s: the tanker's figures need more than its settling time."""
    return Synth(duration_s=100.0, error=ERROR, wind_error=WIND, sigma=0.05).write(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def found(run: Path) -> dict[str, float]:
    """Its metrics."""
    return compute(run)


def test_constant_error_is_its_own_rms_p95_and_maximum(found: dict[str, float]) -> None:
    for i, axis in enumerate("xyz"):
        for part in ("", "straight.", "turn."):
            for kind in ("rms", "p95", "max"):
                assert found[f"contact.{part}error_{kind}_m.{axis}"] == pytest.approx(abs(ERROR[i]), abs=1e-9)


def test_only_the_measured_time_counts(found: dict[str, float]) -> None:
    assert found["contact.samples"] == 500  # 0.35 to 0.85 of 1001 samples
    assert found["contact.time_s"] == pytest.approx(50.0)
    assert found["contact.straight.time_s"] + found["contact.turn.time_s"] == pytest.approx(50.0)
    assert found["contact.turn.time_s"] == pytest.approx(20.0, abs=0.2)
    assert found["contact.inside_envelope_pct"] == 100.0


def test_wind_components(found: dict[str, float]) -> None:
    for name in ("tanker", "receiver"):
        for i, axis in enumerate("ned"):
            assert found[f"wind.{name}.rms_mps.{axis}"] == pytest.approx(abs(WIND[i]), abs=1e-5)
        inside = [found[f"wind.{name}.inside_3sigma_pct.{a}"] for a in "ned"]
        assert inside == [0.0, 100.0, 100.0]  # 3 sigma = 0.15: 0.2 is out, 0.1 is in
        assert found[f"wind.{name}.inside_3sigma_pct"] == pytest.approx(200.0 / 3.0)


def test_tanker_wind_counts_from_60_s(found: dict[str, float]) -> None:
    assert found["wind.tanker.samples"] == 401
    assert found["wind.receiver.samples"] == 500


def test_magnitude_and_direction_on_paper() -> None:
    truth = np.array([[3.0, 4.0, 0.0], [0.0, 10.0, 0.0]])
    hat = np.array([[3.3, 4.4, 0.0], [10.0, 0.0, 0.0]])
    s = wind_stats(truth, hat, np.full((2, 3), 0.2))
    assert s["magnitude_rms_pct"] == pytest.approx(100.0 * math.sqrt((0.1**2 + 0.0) / 2))
    assert s["direction_rms_deg"] == pytest.approx(90.0 / math.sqrt(2))
    assert s["inside_3sigma_pct"] == pytest.approx(100.0 * 4 / 6)


@pytest.mark.parametrize("factor", [0.25, 1.0, 4.0])
def test_wind_nees_shows_too_much_and_too_little_confidence(factor: float) -> None:
    """Gaussian errors of known sigma, and a filter that says `factor` times that: mean square 1 / factor^2. (Inside 3 sigma it
    is 100 % for a filter that says anything large enough.)"""
    rng = np.random.default_rng(1)
    sigma = np.array([0.3, 0.5, 0.2])
    error = rng.normal(0.0, sigma, (20_000, 3))
    s = wind_stats(np.full_like(error, 5.0), 5.0 + error, np.tile(factor * sigma, (len(error), 1)))
    for key in ("nees_over_3", "nees.n", "nees.e", "nees.d"):
        assert s[key] == pytest.approx(1.0 / factor**2, rel=0.04)  # 4 sigma of the mean of 20 000 squares


def test_a_sigma_of_zero_is_no_confidence_at_all() -> None:
    s = wind_stats(np.ones((3, 3)), np.full((3, 3), 1.1), np.zeros((3, 3)))
    assert s["nees_over_3"] == math.inf


def test_direction_error_wraps() -> None:
    truth, hat = np.array([[-10.0, 0.1, 0.0]]), np.array([[-10.0, -0.1, 0.0]])
    assert wind_stats(truth, hat, np.ones((1, 3)))["direction_rms_deg"] == pytest.approx(1.146, abs=1e-3)


def test_percentile_and_rms_of_a_ramp() -> None:
    ramp = np.linspace(-1.0, 1.0, 2001)
    s = error_stats(np.stack([ramp, 0 * ramp, 2 * ramp], axis=1))
    assert s["error_rms_m.x"] == pytest.approx(1 / math.sqrt(3), rel=1e-3)
    assert s["error_p95_m.x"] == pytest.approx(0.95, abs=1e-3)
    assert s["error_max_m.z"] == 2.0


def test_downwash_is_seen_in_truth_and_estimate(found: dict[str, float]) -> None:
    assert found["wind.receiver.downwash_mean_mps.truth"] == pytest.approx(4.6, abs=1e-5)
    assert found["wind.receiver.downwash_mean_mps.estimate"] == pytest.approx(4.6, abs=1e-5)


def test_loop_link_and_outcome(found: dict[str, float]) -> None:
    assert found["loop.slips"] == 2
    assert found["link.dropped"] == 0
    assert found["run.outcome"] == "completed"
    assert found["run.sim_s"] == pytest.approx(100.0)


def test_samples_without_equal_stamp_are_left_out(run: Path, tmp_path: Path) -> None:
    """A truth log at half the rate halves the samples and changes no figure."""
    other = tmp_path / "half"
    other.mkdir()
    (other / "tlm.tlog").write_bytes((run / "tlm.tlog").read_bytes())
    writer = TlogWriter(other / "truth.tlog")
    for t_us, link, packet in read(run / "truth.tlog"):
        if t_us % 200_000 == 0:
            writer.write(t_us, packet, link)
    writer.close()
    found = compute(other)
    assert found["contact.samples"] == 250
    assert found["contact.error_rms_m.z"] == pytest.approx(0.3, abs=1e-9)
    assert found["contact.time_s"] == pytest.approx(50.0)


def test_a_run_without_contact_gives_none_not_zero(tmp_path: Path) -> None:
    synth = Synth(duration_s=10.0)
    synth.measure[:] = False
    found = compute(synth.write(tmp_path))
    assert found["contact.samples"] == 0
    assert found["contact.error_rms_m.x"] is None
    assert found["wind.receiver.magnitude_rms_pct"] is None
    assert found["wind.tanker.magnitude_rms_pct"] is None
    assert found["wind.receiver.downwash_mean_mps.truth"] is None


def test_missing_log_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"truth\.tlog"):
        compute(tmp_path)


def test_broken_meta_is_named(run: Path, tmp_path: Path) -> None:
    for name in ("truth.tlog", "tlm.tlog"):
        (tmp_path / name).write_bytes((run / name).read_bytes())
    (tmp_path / "meta.json").write_text("{")
    with pytest.raises(ValueError, match=r"meta\.json"):
        compute(tmp_path)
