"""Routes a ground station may download, against where the aircraft then fly; parameters changed in the flying missions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.missions.tanker.racetrack import RacetrackGuidance, RacetrackParams
from flightsw.types import NavState, SensorFrame, Vec3


@pytest.mark.parametrize("rate", [1.7, -1.7])
def test_the_racetrack_leads_where_the_aircraft_comes_by(rate: float) -> None:
    """Flown with a point mass that turns as commanded, in wind: every place of the route, asked for in the first leg and again in
    the second turn, is passed within what the ramps of the turn rate cost."""
    p = RacetrackParams(turn_rate_degps=rate, first_leg_s=60.0, leg_s=80.0, turn_accel_degps2=1.0, heading_gain=0.5)
    guid, wind = RacetrackGuidance(p), (12.0, -7.0)
    assert guid.route() == ()
    pos, psi, dt = [500.0, -300.0, -7010.0], 0.4, 0.05
    path: list[tuple[float, float]] = []
    routes: list[tuple[Vec3, ...]] = []
    for k in range(round(620.0 / dt)):
        nav = NavState(
            valid=True, V=p.V_mps, euler=(psi, 0.0, 0.0), pos_n=(pos[0], pos[1], pos[2]), wind_n=(*wind, 0.0)
        )
        g = guid.step(SensorFrame(t_us=round(k * dt * 1e6)), nav, dt)
        if k == round(5.0 / dt) or (guid.phase == 11 and guid.leg == 1 and len(routes) == 1):
            routes.append(guid.route())
        psi += g.psi_dot * dt
        pos[0] += (p.V_mps * math.cos(psi) + wind[0]) * dt
        pos[1] += (p.V_mps * math.sin(psi) + wind[1]) * dt
        path.append((pos[0], pos[1]))
    flown = np.array(path)
    assert len(routes) == 2
    for route in routes:
        assert len(route) == 5
        for n, e, d in route:
            assert d == -p.alt_m and np.hypot(flown[:, 0] - n, flown[:, 1] - e).min() < 500.0, (n, e)
    across = math.dist(routes[0][1][:2], routes[0][2][:2])
    assert across == pytest.approx(2.0 * p.V_mps / math.radians(1.7), rel=0.15)
