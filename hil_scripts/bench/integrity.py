"""What bounds on the position cost: `python -m hil_scripts.bench.integrity`.

The same flight in memory with and without them, plant and both aircraft's onboard software, in batches by turns so that other
load on the machine falls on both alike; processor time counts.
"""

from __future__ import annotations

import time
from statistics import median

from hil_scripts.studies.integrity.snapshot import Flying

BEGIN_S, BATCH_S, BATCHES = 20.0, 2.0, 30  # [s] of flight, [s], number
WITHOUT = "receiver.integrity.on=false"


def cost(scenario: str, batches: int = BATCHES) -> tuple[float, float]:
    """Processor time with bounds over that without: least batches, median of pairs. Raises ConfigError."""
    flights = [Flying(scenario, 1, ()), Flying(scenario, 1, (WITHOUT,))]
    taken: list[list[float]] = [[], []]
    for f in flights:
        f.fly_to(BEGIN_S)
    for k in range(batches):
        for i in (0, 1) if k % 2 else (1, 0):
            f, t0 = flights[i], time.process_time()
            f.fly_to(f.t_s + BATCH_S)
            taken[i].append(time.process_time() - t0)
    on, off = taken
    return min(on) / min(off), median(a / b for a, b in zip(on, off, strict=True))


def main() -> None:
    """Print it for the refuelling and the air-data mission."""
    for scenario in ("refueling", "airdata"):
        least, pairs = cost(scenario)
        print(
            f"{scenario}: bounds take {least:.2f} times (least), {pairs:.2f} times (pairs) the processor time without"
        )


if __name__ == "__main__":
    main()
