"""Every key that may be set changes the bytes of a short flight, or is refused by name.

`python -m tests.keys` tries them all, one by one, and writes down which act (acting.toml). Here: whatever is not written down is
tried now, nothing is written down that is gone, and a spread of the rest is tried again.
"""

from __future__ import annotations

import re

import pytest

from flightsw.strict import ConfigError
from tests.keys import ledger
from tests.keys.contexts import CONTEXTS
from tests.keys.flights import acts, baseline, designs_kept
from tests.keys.keys import Key, all_keys
from tests.keys.situations import Context, short
from tests.keys.values import ELSEWHERE, PENDING

EVERY = 45  # one key in so many is tried again
MOST = 12  # keys not written down that are tried here; more: run `python -m tests.keys`


def keys_of(c: Context) -> list[Key]:
    plan, _ = baseline(c.scenario, c.sets, c.duration_s)
    keys = [k for k in all_keys(plan) if k.name.partition(".")[0] in c.owners]
    return [k for k in keys if k.place not in ELSEWHERE and re.fullmatch(c.only or ".*", short(k))]


@pytest.mark.parametrize("c", CONTEXTS, ids=lambda c: c.scenario)
def test_every_key_acts(c: Context) -> None:
    known = ledger.read().get(c.scenario, {})
    with designs_kept():
        keys = keys_of(c)
        new = [k for k in keys if k.name not in known and k.place not in PENDING]
        assert len(new) <= MOST, f"{len(new)} keys nobody has tried ({new[0].name}, ...): run `python -m tests.keys`"
        again = [k for i, k in enumerate(keys) if i % EVERY == 0 and k.name in known]
        dead = [k.name for k in (*new, *again) if ledger.tried(c, k) in ("", "?")]
    assert not dead, f"nothing comes of {', '.join(dead)}"
    gone = set(known) - {k.name for k in keys}
    assert not gone, f"no longer keys: {', '.join(sorted(gone))}: run `python -m tests.keys`"


def test_what_is_excused_exists() -> None:
    places = {k.place for c in CONTEXTS for k in all_keys(baseline(c.scenario, c.sets, c.duration_s)[0])}
    assert not set(ELSEWHERE) - places and not set(PENDING) - places


def test_a_key_without_effect_and_a_refusal_that_names_another_are_seen() -> None:
    assert acts("windshear", (), 1.0, ("plant.meta.purpose=other",), "purpose") == ""
    assert acts("windshear", (), 1.0, ("plant.noise.scale=1.1",), "scale").startswith("tick")
    assert acts("windshear", (), 1.0, ("plant.refuel.capture_s=2.0",), "capture_s") == "refused"
    with pytest.raises(ConfigError):
        acts("windshear", (), 1.0, ("plant.refuel.capture_s=2.0",), "something_else")
