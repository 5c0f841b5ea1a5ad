"""Layout of the air data: the tab with maps, residual portraits, lanes of alarms and exclusions, statistics and errors."""

from __future__ import annotations

import rerun.blueprint as rrb

from ground.columns import Columns
from ground.rrd.layout import Layout, Look, Plots, past
from ground.rrd.palette import BACKGROUND
from ground.run import Run
from ground.views.airdata.draw import FDI, MAP, TANKER_MAP, TRUE_MAP, WAKE
from ground.views.airdata.read import VARIABLES, true_position
from ground.views.refueling.aircraft import RECEIVER

WIDE_S, CLOSE_S, PORTRAIT_S = 120.0, 15.0, 10.0  # [s] history shown behind the cursor
CONTACT_M = (0.0, 8.5)  # [m] the close map is centred here if there is no truth
CLOSE_M = 2.0  # [m] half height of the close map


def _map(name: str, centre: tuple[float, float], half: tuple[float, float], trail_s: float) -> rrb.Spatial2DView:
    (y, z), (dy, dz) = centre, half
    return rrb.Spatial2DView(
        origin="/",
        name=name,
        contents=[f"{TANKER_MAP}/**", f"{TRUE_MAP}/**", f"{MAP}/**", "guid/receiver/wake_map/**"],
        overrides=past(f"{TRUE_MAP}/trail", f"{MAP}/trail", seconds=trail_s),
        visual_bounds=rrb.VisualBounds2D(x_range=[y - dy, y + dy], y_range=[z - dz, z + dz]),
        background=rrb.Background(color=BACKGROUND),
    )


def close_centre(truth: Columns, tlm: Columns) -> tuple[float, float]:
    """Where the close map looks: the mean true (y, z) [m] in contact, else at the end of the run."""
    true = true_position(truth)
    status = tlm.get(RECEIVER, "MISSION_STATUS")
    if not len(true.t_us):
        return CONTACT_M
    contact = status.t_us[status["measure"] != 0] if status is not None else true.t_us[-1:]
    contact = contact if len(contact) else true.t_us[-1:]
    mean = true.at(contact)[1].mean(axis=0)
    return float(mean[1]), float(mean[2])


def layout(run: Run, look: Look) -> Layout:
    """The tab of this module."""
    return Layout(tabs=[airdata_tab(look.plots(), close_centre(run.truth, run.tlm))])


def airdata_tab(p: Plots, centre: tuple[float, float]) -> rrb.Vertical:
    """The tab "Air data": maps, residual portraits, lanes of alarms and exclusions, statistics and errors."""
    portraits = [
        rrb.Spatial2DView(
            origin=f"{FDI}/portrait/{v}",
            name=f"{v} residual / threshold",
            overrides=past(f"{FDI}/portrait/{v}/vector", seconds=PORTRAIT_S),
            visual_bounds=rrb.VisualBounds2D(x_range=[-4.4, 4.4], y_range=[-4.4, 4.4]),
            background=rrb.Background(color=BACKGROUND),
        )
        for v in VARIABLES
    ]
    lanes = rrb.StateTimelineView(
        origin="/",
        contents=[*(f"{FDI}/alarm/{v}" for v in VARIABLES), f"{FDI}/excluded", f"{WAKE}/state"],
        name="Alarms, channels excluded, wake position",
        time_view=p.time,
    )
    maps = rrb.Horizontal(
        _map("From behind: truth white, estimate orange", (18.0, 10.0), (45.0, 22.0), WIDE_S),
        _map("Near contact: 2 sigma, command +-1 m", centre, (CLOSE_M, CLOSE_M), CLOSE_S),
    )
    error = [f"{WAKE}/{k}/{a}" for a in "yz" for k in ("error_2sigma", "error")]
    scale = [f"{WAKE}/{k}/{a}" for a in ("wing", "tail") for k in ("scale_1sigma", "scale")]
    plots = rrb.Grid(
        p.plot("wake position error, 2 sigma [m]", error, (-1.5, 1.5)),
        p.plot("gamma / threshold", [f"{FDI}/limit", *(f"{FDI}/ratio/{v}" for v in VARIABLES)], (0.0, 3.0)),
        p.plot("circulation / onboard model", scale, (0.4, 1.6)),
        p.plot("wake position NIS / dof", [f"{WAKE}/nis"], (0.0, 4.0)),
        grid_columns=2,
    )
    return rrb.Vertical(
        maps, rrb.Horizontal(*portraits), lanes, plots, name="Air data", row_shares=[1.25, 1.05, 1.2, 1.5]
    )
