"""The table of refuelling actions by phase in docs/commands.md against the guidance itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightsw.missions.receiver.refuel import ACTIONS, NAMES, RefuelGuidance, RefuelParams

PAGE = Path(__file__).parents[2] / "docs" / "commands.md"


def table() -> dict[tuple[str, str], bool]:
    """(phase, action) -> accepted, as the page says."""
    lines = PAGE.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("| phase | hold |"))
    head = [c.strip() for c in lines[start].strip("|").split("|")][1:]
    out = {}
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        phase, *cells = [c.strip() for c in line[1:-1].split("|")]
        out |= {(phase, action): cell == "y" for action, cell in zip(head, cells, strict=True)}
    return out


def test_every_phase_and_action_stands_there() -> None:
    assert set(table()) == {(phase, action) for phase in NAMES for action in ACTIONS.values()}


@pytest.mark.parametrize("phase", NAMES)
@pytest.mark.parametrize("action", ACTIONS.values())
def test_guidance_answers_as_the_page_says(phase: str, action: str) -> None:
    g = RefuelGuidance(RefuelParams())
    g.phase, g.blind, g.error_m = NAMES.index(phase), "", 0.0
    number = next(n for n, name in ACTIONS.items() if name == action)
    ok, why = g.command(number)
    assert ok == table()[phase, action], why
