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
}


@pytest.mark.parametrize("cls", list(RIGS), ids=lambda c: c.__name__)
def test_every_field_changes_the_output_of_its_rig(cls: type) -> None:
    base, rig = RIGS[cls]
    before = list(rig(base))
    assert before == list(rig(replace(base)))  # the rig itself is repeatable
    dead = []
    for k in leaves("p", base):
        tries = (*VALUES.get(f"{cls.__name__}.{k.field}", ()), *others(k)[:2])
        assert tries, k.name
        if not any(_differs(rig, base, k.field, v, before) for v in tries):
            dead.append(k.field)
    assert not dead, f"{cls.__name__}: {', '.join(dead)} do nothing"
    assert len(list(leaves("p", base))) == len(fields(cls))


def _differs(rig: Any, base: Any, field: str, value: Any, before: list[Any]) -> bool:
    try:
        now = rig(replace(base, **{field: value}))
        return any(a != b for a, b in zip_longest(now, before))  # flown no further than the first difference
    except (ValueError, AssertionError):  # refused by the record, or a phase is no longer reached
        return True
