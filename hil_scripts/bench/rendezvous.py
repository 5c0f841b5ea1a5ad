"""The range-only rendezvous: a hundred thousand of them against plain numpy, and what each onboard estimator costs."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.guidance import OwnState, RendezvousGuidance, RendezvousGuidanceParams
from flightsw.missions.rendezvous.params import KN, NM, RendezvousNavParams
from hil_scripts.bench.row import Row

RENDEZVOUS = 100_000
UPDATES = 17  # ranges of a rendezvous, 10 s apart
ESTIMATORS = (("ekf3", 3), ("ekf7", 3), ("ekf8", 3), ("ukf8", 3), ("bank", 15), ("bank", 57))
RADAR_Y_M, FAR_Y_M = NM, 6.149 * NM


@dataclass(frozen=True)
class Cost:
    """Of one estimator: median and largest time of one range (predict 10 s and update) [us], of one `predict` between ranges
    [us], bytes of its arrays."""

    range_us: float
    worst_us: float
    predict_us: float
    memory_bytes: int


def thousands(n: int = RENDEZVOUS) -> dict[str, float]:
    """See rivard_numpy.bench: seconds of n rendezvous with the source's filter, compiled and in plain numpy, in this process."""
    from hil_scripts.studies.rivard.plain_numpy import bench

    return bench(n)


def _ranges(far: bool) -> list[tuple[float, float]]:
    """Slant range and own x [m] every 10 s of an undisturbed approach."""
    v, y = 396.0 * KN, 9.6 * NM
    x0 = math.sqrt((100.0 if far else 30.0) ** 2 - 9.6**2) * NM
    return [(math.sqrt((x0 - 20.0 * v * k) ** 2 + y * y + 304.8**2), 10.0 * v * k) for k in range(UPDATES)]


def estimator_cost(name: str, components: int, flights: int = 40) -> Cost:
    """Time and memory of one estimator along `flights` approaches; the bank of more than 30 starts at 100 NM, others at 30."""
    e = RangeEstimator(RendezvousNavParams(estimator=name, components=components))
    far = components > 30
    path = _ranges(far)
    y = -9.6 * NM
    ranges, predicts = [], []
    for flight in range(flights + 2):
        e.start(path[0][0], 0.0, y, 0.0, FAR_Y_M if far else RADAR_Y_M)
        for z, x in path[1:]:
            for _ in range(4):
                t0 = time.perf_counter()
                e.predict(2.5)
                t1 = time.perf_counter()
                if flight > 1:
                    predicts.append(t1 - t0)
            t0 = time.perf_counter()
            e.update(z, x, y)
            t1 = time.perf_counter()
            if flight > 1:
                ranges.append(t1 - t0)
    per = np.array(ranges).reshape(flights, -1)
    worst = float(
        np.median(per, axis=0).max()
    )  # the dearest range of an approach, without what the machine adds now and then
    size = sum(v.nbytes for v in vars(e).values() if isinstance(v, np.ndarray))
    return Cost(float(np.median(per)) * 1e6, worst * 1e6, float(np.median(predicts)) * 1e6, size)


def guidance_us(steps: int = 4000) -> float:
    """Median time of one step of the two-arc guidance in the turn [us]."""
    g = RendezvousGuidance(RendezvousGuidanceParams())
    own = OwnState(x=8.0 * NM, y=-8.0 * NM, psi=0.8, bank=0.4, speed=396.0 * KN)
    mean = (16.0 * NM, -396.0 * KN, 0.2 * NM, 0.0)
    took = []
    for k in range(steps):
        t0 = time.perf_counter()
        g.step(own, mean, 15.0 * NM, 0.0)
        t1 = time.perf_counter()
        if k > steps // 10:
            took.append(t1 - t0)
    return float(np.median(took)) * 1e6


def rows() -> list[Row]:
    """A hundred thousand rendezvous against plain numpy, and the onboard estimators."""
    b, n = thousands(), "1e5 rendezvous, source's filter"
    out = [
        Row("rendezvous.seed_1e5_s", f"{n}, compiled, 2 threads", b["compiled.two_threads_s"], "s", "< 10"),
        Row("rendezvous.seed_1e5_one_thread_s", f"{n}, compiled, 1 thread", b["compiled.one_thread_s"], "s"),
        Row("rendezvous.numpy_1e5_s", f"{n}, plain numpy, the same flights", b["numpy_s"], "s"),
        Row("rendezvous.ratio_to_numpy", "compiled on 2 threads faster than numpy", b["ratio.two_threads"], "x"),
        Row("rendezvous.cpu_ratio_to_numpy", "compiled faster than numpy, processor time", b["ratio.cpu"], "x"),
    ]
    for name, components in ESTIMATORS:
        c = estimator_cost(name, components)
        key, text = (f"{name}{components}", f"{name} of {components}") if name == "bank" else (name, name)
        out.append(Row(f"rendezvous.{key}.range_us", f"{text}, one range", c.range_us, "us"))
        out.append(Row(f"rendezvous.{key}.range_worst_us", f"{text}, dearest range of an approach", c.worst_us, "us"))
        out.append(Row(f"rendezvous.{key}.predict_us", f"{text}, one step between ranges", c.predict_us, "us"))
        out.append(Row(f"rendezvous.{key}.memory_bytes", f"{text}, its arrays", float(c.memory_bytes), "B"))
    out.append(Row("rendezvous.guidance_us", "two-arc guidance, one step", guidance_us(), "us"))
    return out
