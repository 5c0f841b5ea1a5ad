"""Studies by name, from the entry points `wakefield.studies` of this and of any other installed package: each a Study, or a tuple
of them where several share code.
"""

from __future__ import annotations

from flightsw.plugins import STUDIES, declared, part
from flightsw.strict import ConfigError, near
from hil_scripts.campaign.study import CampaignError, Study


def _studies(entry: str, value: str) -> tuple[Study, ...]:
    """What an entry point offers. Raises CampaignError naming one that cannot be imported or offers something else."""
    try:
        found = part(STUDIES, entry, object, STUDIES)
    except ConfigError as e:
        raise CampaignError(str(e)) from e
    except Exception as e:
        raise CampaignError(f"{STUDIES} = {entry!r}: {value} cannot be imported: {type(e).__name__}: {e}") from e
    several = found if isinstance(found, tuple) else (found,)
    for one in several:
        if not isinstance(one, Study):
            raise CampaignError(
                f"{STUDIES} = {entry!r}: {value} has a {type(one).__name__}; allowed: a Study, or a tuple of Study"
            )
    return several


def all_studies() -> dict[str, Study]:
    """Every study by name, sorted. Raises CampaignError naming an entry that cannot be imported, or a double name."""
    found: dict[str, Study] = {}
    try:
        points = declared(STUDIES)
    except ConfigError as e:
        raise CampaignError(str(e)) from e
    for entry, point in points.items():
        for study in _studies(entry, point.value):
            if found.setdefault(study.name, study) is not study:
                raise CampaignError(f"study name {study.name!r} is used twice (second time in {point.value})")
    return dict(sorted(found.items()))


def find(name: str) -> Study:
    """The study called `name`. Raises CampaignError listing the known names."""
    known = all_studies()
    if name not in known:
        raise CampaignError(f"study {name!r}: no such study; known: {', '.join(known) or 'none'}{near(name, known)}")
    return known[name]
