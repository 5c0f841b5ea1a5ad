"""The gust mission's signals: wind and vane bias as estimated, their 1-sigma and their truth, loads."""

from __future__ import annotations

from collections.abc import Iterator

from ground.run import Run
from ground.signals import Signal
from ground.views.gust.read import flights

G = 9.81
WANTED = (("alpha_w", "rad"), ("v_w", "m/s"), ("bias", "rad"))


def signals(run: Run) -> Iterator[Signal]:
    """{truth, nav}/<aircraft>/gust/{alpha_w, v_w, bias}, nav's <key>_sigma, truth/<aircraft>/n_z and n_z_low (below 2 Hz)."""
    for f in flights(run.folder, run.truth, run.tlm):
        for i, (key, unit) in enumerate(WANTED):
            yield Signal(f"truth/{f.name}/gust/{key}", f.t_us, f.truth[:, i], unit, source="gust")
            for at, values in ((key, f.est), (f"{key}_sigma", f.sigma)):
                yield Signal(f"nav/{f.name}/gust/{at}", f.t_us[f.valid], values[f.valid, i], unit, source="gust")
        yield Signal(f"truth/{f.name}/n_z", f.t_us, 1.0 + f.a_z / G, source="gust")
        yield Signal(f"truth/{f.name}/n_z_low", f.t_us, 1.0 + f.low() / G, source="gust")
