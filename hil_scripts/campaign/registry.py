"""Studies by name: modules of `hil_scripts.studies` with a STUDY, or with STUDIES (a tuple) where several share code."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from types import ModuleType

from flightsw.strict import near
from hil_scripts.campaign.study import CampaignError, Study

PACKAGE = "hil_scripts.studies"


def _modules() -> list[str]:
    try:
        spec = importlib.util.find_spec(PACKAGE)
    except ModuleNotFoundError:
        spec = None
    if spec is None or spec.submodule_search_locations is None:
        return []
    return sorted(m.name for m in pkgutil.iter_modules(spec.submodule_search_locations) if not m.name.startswith("_"))


def _studies(module: ModuleType) -> list[Study]:
    one, many = getattr(module, "STUDY", None), getattr(module, "STUDIES", ())
    return [s for s in ([one] if one is not None else []) + list(many) if isinstance(s, Study)]


def all_studies() -> dict[str, Study]:
    """Every study by name, sorted. Raises CampaignError naming a module that cannot be imported, or a double name."""
    found: dict[str, Study] = {}
    for name in _modules():
        try:
            module = importlib.import_module(f"{PACKAGE}.{name}")
        except Exception as e:
            raise CampaignError(f"study module {PACKAGE}.{name} cannot be imported: {type(e).__name__}: {e}") from e
        for study in _studies(module):
            if study.name in found and found[study.name] is not study:
                raise CampaignError(f"study name {study.name!r} is used twice (second time in {PACKAGE}.{name})")
            found[study.name] = study
    return dict(sorted(found.items()))


def find(name: str) -> Study:
    """The study called `name`. Raises CampaignError listing the known names."""
    known = all_studies()
    if name not in known:
        raise CampaignError(f"study {name!r}: no such study; known: {', '.join(known) or 'none'}{near(name, known)}")
    return known[name]
