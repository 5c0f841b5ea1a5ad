"""sensors/<aircraft>/...: what the onboard software was fed, read from its link log. Thinned to 10 Hz."""

from __future__ import annotations

import numpy as np

from flightsw.icd.tlog import LINK_IN
from ground.columns import Columns, Table
from ground.rrd.palette import CRAFTS, Color
from ground.rrd.series import AXIS, Sink
from ground.run import Run

PERIOD_US = 100_000  # [us]


def sensors(sink: Sink, run: Run) -> None:
    """Send the sensor series of every link log of the run; none there, nothing sent."""
    for i, name in enumerate(run.names.values()):
        _one(sink, run.link(name), name, CRAFTS[i % len(CRAFTS)])


def _inbound(log: Columns, message: str) -> Table | None:
    """Rows of a message that came from the plant, whatever system id it used."""
    for (_, kind), table in log.tables.items():
        if kind == message:
            rows = table.pick(table.link == LINK_IN)
            if len(rows):
                return rows.decimated(PERIOD_US)
    return None


def _one(sink: Sink, log: Columns, name: str, look: Color) -> None:
    imu = _inbound(log, "HIL_SENSOR")
    if imu is not None:
        for kind, unit in (("acc", "m/s2"), ("gyro", "rad/s")):
            for i, axis in enumerate("xyz"):
                sink.series(
                    f"sensors/{name}/imu/{kind}/{axis}",
                    imu.t_us,
                    imu[f"{axis}{kind}"],
                    f"{kind} {axis} {unit}",
                    AXIS[i],
                    1.0,
                )
        sink.series(f"sensors/{name}/baro/altitude", imu.t_us, imu["pressure_alt"], f"{name} baro", look, 1.0)
    air = _inbound(log, "AIR_DATA")
    if air is not None:
        count = max(1, int(air["count"].max()))
        for key, field, factor in (("V", "airspeed", 1.0), ("alpha", "alpha", 57.29578), ("beta", "beta", 57.29578)):
            values = factor * air[field][:, :count].astype(np.float64)
            sink.series(f"sensors/{name}/air/{key}", air.t_us, values, f"probe {key}", look, 1.0)
    rel = _inbound(log, "REL_NAV")
    if rel is not None:
        xi = np.stack([rel[a] for a in "xyz"], axis=1).astype(np.float64)
        for i, axis in enumerate("xyz"):
            sink.series(f"sensors/{name}/relnav/{axis}", rel.t_us, xi[:, i], f"{axis} measured", AXIS[i], 1.0)
