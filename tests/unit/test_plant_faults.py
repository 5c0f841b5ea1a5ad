"""Air-data faults of the plant, per probe and channel: what each kind does, when, and that nothing else changes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom, kstest

from flightsw.strict import ConfigError
from sim_plant.rng import generator
from sim_plant.scenario import load_scenario
from sim_plant.sensors.faulty import Delay, Flicker, Garbage
from sim_plant.world import World

NAMES = {"V": 0, "alpha": 1, "beta": 2}
START, SAMPLES = 4, 24  # fault begins at this air sample (20 Hz); samples flown


def fly(*events: dict[str, Any], samples: int = SAMPLES, seed: int = 1, **over: Any) -> tuple[np.ndarray, np.ndarray]:
    """Air readings [samples, 3 probes, (V, alpha, beta)] of the receiver in trimmed flight, and the masks [samples]; a
    sample that did not come is NaN with mask 0."""
    scripted = [{"t_s": START * 0.05, "target": "receiver", "sensor": "air", **e} for e in events]
    w = World(load_scenario("refueling", {"event": scripted, **over}), seed)
    cmds = [w.trim_cmd(0), w.trim_cmd(1)]
    out, mask = np.full((samples, 3, 3), np.nan), np.zeros(samples, dtype=int)
    for k in range(samples * 5):
        f = w.sense()[1]
        if f.updated & 16:
            out[k // 5] = np.array([f.air_V, f.air_alpha, f.air_beta]).T
            mask[k // 5] = f.air_mask
        w.step(cmds)
    return out, mask


@pytest.fixture(scope="module")
def clean() -> np.ndarray:
    out, mask = fly()
    assert (mask == 7).all() and np.isfinite(out).all()
    return out


def only(probe: int, channel: str) -> np.ndarray:
    """Mask [3, 3] of the cells a fault may touch."""
    m = np.zeros((3, 3), dtype=bool)
    m[slice(None) if probe < 0 else probe, slice(None) if not channel else NAMES[channel]] = True
    return m


@pytest.mark.parametrize("probe", [-1, 0, 2])
@pytest.mark.parametrize("channel", ["", "V", "alpha", "beta"])
@pytest.mark.parametrize(
    "event",
    [
        {"kind": "bias", "value": [-0.5]},
        {"kind": "drift", "value": [0.2]},
        {"kind": "garbage", "value": [0.3]},
        {"kind": "scale", "value": [0.9]},
        {"kind": "stuck"},
        {"kind": "delayed", "samples": 3},
        {"kind": "intermittent", "value": [0.6]},
        {"kind": "off"},
    ],
    ids=lambda e: e["kind"],
)
def test_a_fault_touches_its_cells_in_its_time_and_nothing_else(
    event: dict[str, Any], channel: str, probe: int, clean: np.ndarray
) -> None:
    out, mask = fly({"index": probe, "channel": channel, "for_s": 0.5, **event})
    hit = only(probe, channel)
    during = np.zeros(SAMPLES, dtype=bool)
    during[START : START + 10] = True
    assert np.array_equal(out[~during], clean[~during]) and (mask[~during] == 7).all()
    whole_group = probe < 0 and not channel
    if event["kind"] in ("off", "intermittent"):
        lost = (np.isnan(out) | (mask[:, None, None] >> np.arange(3)[None, :, None] & 1 == 0))[during]
        assert not lost[:, ~hit].any() and lost[:, hit].any()
        assert event["kind"] == "intermittent" or lost[:, hit].all()
        assert np.array_equal(out[during][~lost], clean[during][~lost])
        if channel:
            assert (mask == 7).all()  # the probe answers; the channel reads NaN
        elif not whole_group:
            assert np.isfinite(out).all() and set(mask[during]) <= {7, 7 & ~(1 << probe)}
    else:
        assert (mask == 7).all()
        assert np.array_equal(out[during][:, ~hit], clean[during][:, ~hit])
        assert (out[during][:, hit] != clean[during][:, hit]).any(axis=0).all()


def test_sizes(clean: np.ndarray) -> None:
    cell = {"index": 1, "channel": "alpha"}
    n = np.arange(START, SAMPLES)
    biased, _ = fly({"kind": "bias", "value": [-0.0175], **cell})
    assert np.allclose(biased[n, 1, 1] - clean[n, 1, 1], -0.0175, atol=1e-12)
    drift, _ = fly({"kind": "drift", "value": [0.02], **cell})
    assert np.allclose(drift[n, 1, 1] - clean[n, 1, 1], 0.02 * 0.05 * (n - START), atol=1e-12)
    scaled, _ = fly({"kind": "scale", "value": [1.1], **cell})
    assert np.allclose(scaled[n, 1, 1], 1.1 * clean[n, 1, 1], rtol=1e-12)
    stuck, _ = fly({"kind": "stuck", **cell})
    assert (stuck[n, 1, 1] == clean[START - 1, 1, 1]).all()
    late, _ = fly({"kind": "delayed", "samples": 3, **cell})
    assert (late[START : START + 3, 1, 1] == clean[START, 1, 1]).all()
    assert np.array_equal(late[START + 3 :, 1, 1], clean[START:-3, 1, 1])
    per_channel, _ = fly({"kind": "bias", "value": [3.0, 0.01, -0.02], "index": 2})
    assert np.allclose(per_channel[n, 2] - clean[n, 2], [3.0, 0.01, -0.02])
    per_probe, _ = fly({"kind": "bias", "value": [1.0, 2.0, 3.0], "channel": "V"})
    assert np.allclose(per_probe[n, :, 0] - clean[n, :, 0], [1.0, 2.0, 3.0])


def test_faults_of_one_channel_act_together(clean: np.ndarray) -> None:
    """Bias and drift add, the sum is scaled; what is off stays off."""
    cell = {"index": 0, "channel": "V"}
    out, _ = fly(
        {"kind": "scale", "value": [0.5], **cell},
        {"kind": "bias", "value": [2.0], **cell},
        {"kind": "drift", "value": [4.0], **cell},
        {"kind": "off", "index": 0, "channel": "beta"},
        {"kind": "stuck", "index": 0, "channel": "beta"},
    )
    n = np.arange(START, SAMPLES)
    assert np.allclose(out[n, 0, 0], 0.5 * (clean[n, 0, 0] + 2.0 + 0.2 * (n - START)))
    assert np.isnan(out[n, 0, 2]).all() and np.array_equal(out[n, 0, 1], clean[n, 0, 1])


@pytest.mark.parametrize("partial", [{}, {"index": 1}, {"index": 1, "channel": "V"}])
def test_stuck_with_latency_is_one_value(partial: dict[str, Any]) -> None:
    """The value is the last one sampled, also while older samples are still on their way."""
    over = {"sensors.receiver.air.latency_ms": 100.0}
    ref, _ = fly(**over)
    out, _ = fly({"kind": "stuck", **partial}, **over)
    # sample s arrives two samples later
    assert np.array_equal(out[2 : START + 2], ref[2 : START + 2])
    cells = only(partial.get("index", -1), partial.get("channel", ""))
    assert (out[START + 2 :, cells] == ref[START + 1, cells]).all()


def test_random_faults_are_seeded_and_leave_the_noise_alone(clean: np.ndarray) -> None:
    events = (
        {"kind": "garbage", "value": [50.0], "index": 0, "channel": "V"},
        {"kind": "intermittent", "index": 1, "channel": "alpha"},
    )
    a, b = fly(*events), fly(*events)
    assert a[0].tobytes() == b[0].tobytes()
    other_seed = fly(*events, seed=2)[0] - fly(seed=2)[0]
    assert not np.allclose((a[0] - clean)[START:, 0, 0], other_seed[START:, 0, 0])
    two = fly(
        *events, {"kind": "garbage", "value": [1.0], "index": 2}
    )  # one more random fault: the others draw the same
    assert np.array_equal(two[0][:, :2], a[0][:, :2], equal_nan=True)


def test_garbage_is_uniform() -> None:
    g = Garbage([2.0, 0.0], generator(1, "t"))
    x = np.array([g.add([1.0, 5.0], 0) for _ in range(4000)])
    assert (x[:, 1] == 5.0).all()
    assert kstest(x[:, 0], "uniform", args=(-1.0, 4.0)).pvalue > 1e-3


@pytest.mark.parametrize(("share", "mean"), [(0.5, 2.0), (0.3, 10.0), (0.8, 5.0)])
def test_flicker_loses_its_share_in_outages_of_its_length(share: float, mean: float) -> None:
    f = Flicker(share, mean, generator(3, "t"))
    lost = np.array([f.lost() for _ in range(60000)])
    # variance of the mean of a two-state chain with correlation r = 1 - enter - leave: p q / n (1 + r) / (1 - r)
    r = 1.0 - 1.0 / mean - share / (1.0 - share) / mean
    sd = math.sqrt(share * (1 - share) / len(lost) * (1 + r) / (1 - r))
    assert lost.mean() == pytest.approx(share, abs=4 * sd)
    outages = np.diff(np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]]).astype(int))))[::2]
    assert outages.mean() == pytest.approx(mean, rel=4 * math.sqrt((mean - 1) / mean / len(outages)) + 1e-3)


def test_flicker_without_memory_is_binomial() -> None:
    f = Flicker(0.25, 1 / 0.75, generator(4, "t"))
    n = sum(f.lost() for _ in range(10000))
    assert binom.cdf(n, 10000, 0.25) == pytest.approx(0.5, abs=0.499)


@given(st.lists(st.integers(), min_size=1, max_size=40), st.integers(1, 12))
@settings(max_examples=60)
def test_delay_is_a_shift(x: list[int], n: int) -> None:
    d = Delay(n)
    assert [d.push(v) for v in x] == ([x[0]] * n + x)[: len(x)]


@pytest.mark.parametrize("sensor", ["gnss", "imu", "att", "rel", "baro", "boom"])
@pytest.mark.parametrize(
    "event",
    [
        {"kind": "drift", "value": [0.1]},
        {"kind": "garbage", "value": [0.1]},
        {"kind": "delayed", "samples": 2},
        {"kind": "intermittent"},
        {"kind": "off"},
    ],
    ids=lambda e: e["kind"],
)
def test_other_sensors_take_the_group_kinds(sensor: str, event: dict[str, Any]) -> None:
    """The air data of the run stay what they were."""
    out, _ = fly({"sensor": sensor, **event})
    assert np.array_equal(out, fly()[0])


@pytest.mark.parametrize(
    ("event", "text"),
    [
        (
            {"kind": "bias", "index": 3, "value": [1.0]},
            r"event\[0\]\.index = 3: sensors\.receiver\.air has probes 0 to 2",
        ),
        ({"kind": "bias", "index": -2, "value": [1.0]}, r"event\.0\.index = -2|event\[0\]\.index = -2"),
        ({"kind": "bias", "channel": "gamma", "value": [1.0]}, r"channel = 'gamma': allowed: , V, alpha, beta"),
        ({"kind": "bias", "channel": "V", "index": 1, "value": [1.0, 2.0]}, r"takes 1 or 1 values, got 2.*channel V"),
        ({"kind": "bias", "index": 1, "value": [1.0, 2.0]}, r"takes 1 or 3 values, got 2 \(index 1\)"),
        ({"kind": "drift"}, r"event\[0\]: a drift event needs value"),
        ({"kind": "garbage", "value": [-1.0]}, r"event\[0\]\.value = \[-1\.0\]: a garbage event"),
        ({"kind": "delayed"}, r"event\[0\]\.samples = 0: a delayed event needs 1 or more"),
        ({"kind": "intermittent", "value": [1.0]}, r"event\[0\]\.value = \[1\.0\].*between 0 and 1"),
        ({"kind": "intermittent", "value": [0.5, 0.0]}, r"mean outage in s"),
        ({"kind": "stuck", "sensor": "gnss", "index": 1}, r"event\[0\]\.index = 1: only sensor = 'air'.*'gnss'"),
        ({"kind": "off", "sensor": "imu", "channel": "V"}, r"event\[0\]\.channel = 'V': only sensor = 'air'"),
        ({"kind": "scale", "sensor": "att", "value": [2.0]}, r"kind = 'scale': allowed with sensor = air"),
        ({"kind": "link_loss", "sensor": "", "index": 1}, r"event\[0\]\.index = 1: a link_loss event has none"),
        ({"kind": "wobble"}, r"kind = 'wobble': allowed: command, dropout, off, bias, drift"),
    ],
)
def test_mistakes_are_named(event: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        fly(event, samples=1)
