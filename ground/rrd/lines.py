"""How the signals every run has are drawn: label, colour and width of each, degrees for radians; thinned to 10 Hz."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from ground.rrd.palette import BAND, BOX, NAV, TRUTH, Color
from ground.rrd.series import AXIS, Sink
from ground.run import Run
from ground.signals import GROUPS, SURFACES, Signal

PERIOD_US = 100_000  # [us] the rate of the telemetry; truth and sensors come faster
SHOWN = {"rad": 57.29577951308232, "N": 1e-3, "s": 1e6}  # deg, kN, us


@dataclass(frozen=True)
class Line:
    """label: {name} of the aircraft, {key} and {part} of the signal; color: of its parts, None: the aircraft's, `dim` times as
    bright; whole: all parts are one entity; percent: a share."""

    label: str = "{name} {key}"
    color: Color | tuple[Color, ...] | None = None
    width: float = 1.5
    step: bool = False
    dim: float = 1.0
    whole: bool = False
    percent: bool = False


LINES: dict[str, Line] = {
    "truth/wind": Line("truth", TRUTH, 1.0),
    **{f"truth/{k}": Line() for k in ("V", "altitude", "bank", "pitch", "heading", "alpha", "beta", "mass")},
    **{f"truth/controls/{k}": Line(k, c) for k, c in zip(SURFACES, AXIS, strict=True)},
    "truth/controls/thrust": Line("{name} thrust"),
    "nav/wind": Line("estimate", NAV, 2.4),
    **{f"nav/{k}": Line("{name} {key} estimate", NAV, 1.0) for k in ("V", "alpha", "beta", "bank", "pitch", "heading")},
    "nav/nis": Line("{name} NIS / dof"),
    "guid/V": Line("{name} V command", BOX, 1.0, step=True),
    "guid/altitude": Line("{name} altitude command", BOX, 1.0, step=True),
    **{f"ctrl/{k}": Line("{key} command", c, 1.0) for k, c in zip(SURFACES, AXIS, strict=True)},
    "ctrl/throttle": Line(percent=True),
    "timing/exec_mean": Line("{name} {key} us"),
    "timing/exec_max": Line("{name} {key} us", dim=0.75),
    "timing/late_p50": Line("{name} {key} us", dim=0.75),
    "timing/late_p99": Line("{name} {key} us"),
    "timing/late_max": Line("{name} {key} us", dim=0.75),
    "timing/slips": Line(step=True),
    "sensors/bad_packets": Line(step=True),
    "sensors/rejected": Line(step=True),
    "sensors/imu/acc": Line("acc {part} m/s2", AXIS, 1.0),
    "sensors/imu/gyro": Line("gyro {part} rad/s", AXIS, 1.0),
    "sensors/baro/altitude": Line("{name} baro", width=1.0),
    **{f"sensors/air/{k}": Line(f"probe {k}", width=1.0, whole=True) for k in ("V", "alpha", "beta")},
    "sensors/relnav": Line("{part} measured", AXIS, 1.0),
}
AS_IT_IS = {"sensors/imu/gyro"}  # drawn in its own unit


def lines(
    sink: Sink, run: Run, sysid: int, name: str, look: Color, states: Mapping[str, Color], groups: Collection[str]
) -> None:
    """Lines, and lanes of words, of one aircraft's signals in some of the `GROUPS`; `states`: colours of the words."""
    for top in groups:
        build = GROUPS[top]
        found = {s.path.split("/", 2)[2]: s for s in build(run, sysid, name)}
        for key, s in found.items():
            if s.is_text:
                sink.states(s.path, s.t_us, s.values.tolist(), states)
            elif style := LINES.get(f"{top}/{key}"):
                _line(sink, s.thinned(PERIOD_US), style, f"{top}/{key}" in AS_IT_IS, {"name": name, "key": key}, look)
        if top == "nav" and "wind_sigma" in found:
            _band(sink, found["wind"].thinned(PERIOD_US), found["wind_sigma"].thinned(PERIOD_US))


def _line(sink: Sink, s: Signal, style: Line, as_it_is: bool, words: dict[str, str], look: Color) -> None:
    factor = 100.0 if style.percent else 1.0 if as_it_is else SHOWN.get(s.unit, 1.0)
    dim = tuple(int(v * style.dim) for v in look)
    if not s.parts or style.whole:
        color = style.color or dim
        sink.series(s.path, s.t_us, factor * s.values, style.label.format(**words), color, style.width, style.step)  # type: ignore[arg-type]
        return
    for i, part in enumerate(s.parts):
        color = style.color or dim
        own = color[i] if isinstance(color[0], tuple) else color
        label = style.label.format(**words, part=part)
        sink.series(f"{s.path}/{part}", s.t_us, factor * s.values[:, i], label, own, style.width, style.step)  # type: ignore[arg-type]


def _band(sink: Sink, wind: Signal, sigma: Signal) -> None:
    """Three sigma about the wind."""
    for i, part in enumerate(wind.parts):
        w, s3 = wind.values[:, i], 3.0 * sigma.values[:, i]
        band = np.stack([w - s3, w + s3], axis=1)
        sink.series(f"{wind.path}_3sigma/{part}", wind.t_us, band, "3 sigma", BAND, 1.0)
