"""Every key of the records that act late in a flight changes what its component does."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import zip_longest
from typing import Any

import pytest

from tests.keys.keys import leaves, others
from tests.keys.rigs import RIGS

# values that show where a factor on the default does not
VALUES: dict[str, tuple[Any, ...]] = {
    "RefuelParams.ready_error_m": (0.1,),
    "SequenceParams.fuel_kg": (0.0,),
    "JoinUpParams.lost_s": (30.0, 0.5),
    "JoinUpParams.seen_s": (20.0,),
    "JoinUpParams.level_rate_degps": (2.0,),
    "JoinUpParams.vy_track_mps": (0.5,),
    "JoinUpParams.handover_m": (1.0,),
    "JoinUpParams.int_max_mps": (1e-3,),
    "JoinUpParams.handover_closure_mps": (0.01,),
    "JoinUpParams.heading_max_deg": (1.0,),
    "WindCalParams.sigma_max_mps": (0.5,),
    "IntegrityParams.on": (False,),
    "IntegrityParams.wake": (False,),
    "IntegrityParams.accel_most": (0.11,),
    "IntegrityParams.k_once": (0.5,),
    "IntegrityParams.alarm_steps": (1, 40),
    "IntegrityParams.llr_ahead": (1e3,),
    "IntegrityParams.gate": (1.0,),
    "IntegrityParams.spikes": (1, 50),
    "IntegrityParams.again_s": (2.0, 12.0),
    "IntegrityParams.again_sigma": (0.1, 9.0),
    "IntegrityParams.over_s": (5.0, 0.0),
    "IntegrityParams.live_s": (5.0,),
    "IntegrityParams.coast_s": (1.0,),
    "IntegrityParams.stand_in_s": (0.45,),
    "RacetrackParams.path": ("tests.keys.own:Path",),
    "RefuelParams.path": ("tests.keys.own:Refuelling",),
    "JoinUpParams.path": ("tests.keys.own:Joining",),
    "JoinUpParams.clear_m": (80.0, 1500.0),
    "JoinUpParams.V_max_mps": (160.0,),
}
# where a field shows soonest if it is not the first of the rigs of its record: that one is flown first
SOONEST: dict[str, int] = {
    **dict.fromkeys(("JoinUpParams.v_slow_mps", "JoinUpParams.a_close_mps2", "JoinUpParams.stay_back_m"), 1),
    **dict.fromkeys(("JoinUpParams.climb_slope", "JoinUpParams.climb_gap_m", "JoinUpParams.k_alt_ps"), 1),
    "JoinUpParams.v_back_mps": 2,
    **dict.fromkeys(("JoinUpParams.corridor_y_m", "JoinUpParams.keep_out_m", "JoinUpParams.clear_m"), 3),
    **dict.fromkeys(
        ("JoinUpParams.handover_m", "JoinUpParams.handover_error_m", "JoinUpParams.handover_closure_mps"), 3
    ),
    "JoinUpParams.turning_degps": 4,
    **dict.fromkeys(("JoinUpParams.follow_m", "JoinUpParams.follow_turn_degps"), 5),
    "IntegrityParams.again_sigma": 1,
    "IntegrityParams.spikes": 2,
    **dict.fromkeys(("IntegrityParams.accel_blind", "IntegrityParams.al_closing_m"), 3),
    **dict.fromkeys(("IntegrityParams.over_s", "IntegrityParams.live_s"), 4),
    **dict.fromkeys(("IntegrityParams.coast_s", "IntegrityParams.stand_in_s"), 4),
    "IntegrityParams.al_observation_m": 5,
    **dict.fromkeys(("IntegrityParams.wake", "IntegrityParams.wake_walk"), 6),
    **dict.fromkeys(("IntegrityParams.wake_fast_m", "IntegrityParams.wake_fast_tau_s"), 6),
}


@pytest.mark.parametrize("cls", list(RIGS), ids=lambda c: c.__name__)
def test_every_field_changes_the_output_of_its_rig(cls: type) -> None:
    base, rigs = RIGS[cls]
    before = [list(rig(base)) for rig in rigs]
    assert before == [list(rig(replace(base))) for rig in rigs]  # a rig itself is repeatable
    dead = []
    for k in leaves("p", base):
        tries = (*VALUES.get(f"{cls.__name__}.{k.field}", ()), *others(k)[:2])
        assert tries, k.name
        soonest = SOONEST.get(f"{cls.__name__}.{k.field}", 0)
        order = sorted(range(len(rigs)), key=lambda i: (i != soonest, i))
        if not any(_differs(rigs[i], base, k.field, v, before[i]) for v in tries for i in order):
            dead.append(k.field)
    assert not dead, f"{cls.__name__}: {', '.join(dead)} do nothing"
    assert len(list(leaves("p", base))) == len(fields(cls))


def _differs(rig: Any, base: Any, field: str, value: Any, before: list[Any]) -> bool:
    try:
        now = rig(replace(base, **{field: value}))
        return any(a != b for a, b in zip_longest(now, before))  # flown no further than the first difference
    except (ValueError, AssertionError):  # refused by the record, or a phase is no longer reached
        return True
