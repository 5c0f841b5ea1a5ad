"""The air data's signals: place in the wake against truth, what is learnt of it, statistics and verdicts of fault detection."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ground.columns import Table
from ground.run import Run
from ground.signals import XYZ, Signal
from ground.views.airdata.read import VARIABLES, alarm_words, channel_words, true_position
from ground.views.refueling.aircraft import RECEIVER

WAKE, FDI = "wake", "fdi"
SURFACES = ("wing", "tail")


def signals(run: Run) -> Iterator[Signal]:
    """{truth, nav}/<receiver>/wake/position [m] in the tanker's air-path axes at the sample's own time, nav's position_sigma
    of y, z; scale, scale_sigma, height, wind, nis, state of the wake; fdi/{ratio (statistic over threshold), alarms,
    excluded}."""
    name = run.names.get(RECEIVER)
    if name is None:
        return
    wake, fdi = (run.tlm.get(RECEIVER, k) for k in ("WAKE_POSITION", "FDI_STATUS"))
    if wake is not None:
        true = true_position(run.truth)
        yield Signal(f"truth/{name}/wake/position", true.t_us, true.pos, "m", XYZ, WAKE)
        yield from of_wake(wake, name)
    if fdi is not None:
        yield from of_fdi(fdi, name)


def of_wake(wake: Table, name: str) -> Iterator[Signal]:
    """Of WAKE_POSITION."""
    nav = f"nav/{name}/wake"
    good = wake.pick(wake["valid"] != 0)
    at = good["time_usec"].astype(np.int64)
    new = np.flatnonzero(np.diff(at, prepend=-1) > 0)
    sample, at = good.pick(new), at[new]
    sigma = np.sqrt(np.maximum(sample["cov"][:, ::2].astype(np.float64), 0.0))
    yield Signal(f"{nav}/position", at, sample["pos"].astype(np.float64), "m", XYZ, WAKE)
    yield Signal(f"{nav}/position_sigma", at, sigma, "m", ("y", "z"), WAKE)
    for key in ("scale", "scale_sigma"):
        yield Signal(f"{nav}/{key}", good.t_us, good[key].astype(np.float64), "", SURFACES, WAKE)
    yield Signal(f"{nav}/height", good.t_us, good["height"].astype(np.float64), "m", source=WAKE)
    yield Signal(f"{nav}/wind", good.t_us, good["wind"].astype(np.float64), "m/s", XYZ, WAKE)
    seen = wake.pick(wake["nis_dof"] > 0)
    yield Signal(f"{nav}/nis", seen.t_us, seen["nis"].astype(np.float64) / seen["nis_dof"], source=WAKE)
    reasons = [b.decode("utf-8", "replace") or "not valid" for b in wake["reason"]]
    words = ["valid" if v else why for v, why in zip(wake["valid"], reasons, strict=True)]
    yield Signal(f"{nav}/state", wake.t_us, np.array(words, dtype=object), source=WAKE)


def of_fdi(fdi: Table, name: str) -> Iterator[Signal]:
    """Of FDI_STATUS."""
    at, good = f"nav/{name}/fdi", fdi.pick(fdi["valid"] != 0)
    ratio = good["gamma"] / np.maximum(good["threshold"].astype(np.float64), 1e-9)[:, None]
    yield Signal(f"{at}/ratio", good.t_us, ratio, "", VARIABLES, FDI)
    keys = ("alarm", "isolated", "negative")
    rows = zip(*(fdi[k].tolist() for k in keys), strict=True)
    alarms = [alarm_words(dict(zip(keys, row, strict=True))) or "none" for row in rows]
    excluded = [channel_words(int(m)) or "none" for m in fdi["excluded"]]
    for key, words in (("alarms", alarms), ("excluded", excluded)):
        yield Signal(f"{at}/{key}", fdi.t_us, np.array(words, dtype=object), source=FDI)
