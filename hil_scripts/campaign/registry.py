"""Studies by name, from the entry points `wakefield.studies` of this and of any other installed package: each a Study, or a tuple
of them where several share code.

What there is stands in studies.txt and cases.txt beside this file, so that naming studies and cases imports none; those of
other packages are imported. `python -m hil_scripts.campaign.registry` writes both anew.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from flightsw.plugins import STUDIES, declared, part
from flightsw.strict import ConfigError, near
from hil_scripts.campaign.error import CampaignError

if TYPE_CHECKING:
    from hil_scripts.campaign.study import Study

LIST, CASES = (Path(__file__).with_name(n) for n in ("studies.txt", "cases.txt"))


class Listed(NamedTuple):
    """A study by the entry point that offers it, and what a list says of it."""

    entry: str
    value: str
    name: str
    cases: int
    runs: int
    title: str
    purpose: str


def _studies(entry: str, value: str) -> tuple[Study, ...]:
    """What an entry point offers. Raises CampaignError naming one that cannot be imported or offers something else."""
    from hil_scripts.campaign.study import Study

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


def _points() -> dict[str, str]:
    """Entry points and what they name. Raises CampaignError for one that two packages declare."""
    try:
        return {entry: point.value for entry, point in declared(STUDIES).items()}
    except ConfigError as e:
        raise CampaignError(str(e)) from e


def all_studies() -> dict[str, Study]:
    """Every study by name, sorted. Raises CampaignError naming an entry that cannot be imported, or a double name."""
    found: dict[str, Study] = {}
    for entry, value in _points().items():
        for study in _studies(entry, value):
            if found.setdefault(study.name, study) is not study:
                raise CampaignError(f"study name {study.name!r} is used twice (second time in {value})")
    return dict(sorted(found.items()))


def _rows(entry: str, value: str) -> list[Listed]:
    return [
        Listed(entry, value, s.name, len(s.cases), s.default_runs, s.title, s.purpose) for s in _studies(entry, value)
    ]


def listed() -> dict[str, Listed]:
    """What a list says of every study, by name, sorted. Raises CampaignError as all_studies, of what is not in studies.txt."""
    known: dict[tuple[str, str], list[Listed]] = {}
    for line in LIST.read_text(encoding="utf-8").splitlines():
        entry, value, name, cases, runs, title, purpose = line.split("\t")
        known.setdefault((entry, value), []).append(Listed(entry, value, name, int(cases), int(runs), title, purpose))
    found: dict[str, Listed] = {}
    for entry, value in _points().items():
        for row in known.get((entry, value)) or _rows(entry, value):
            if found.setdefault(row.name, row) is not row:
                raise CampaignError(f"study name {row.name!r} is used twice (second time in {value})")
    return dict(sorted(found.items()))


def find(name: str) -> Study:
    """The study called `name`, no other imported. Raises CampaignError listing the known names."""
    known = listed()
    if name not in known:
        raise CampaignError(f"study {name!r}: no such study; known: {', '.join(known) or 'none'}{near(name, known)}")
    return next(s for s in _studies(known[name].entry, known[name].value) if s.name == name)


def cases(name: str) -> list[str]:
    """Names of the cases of the study called `name`, in order. Raises CampaignError as find."""
    if name in listed():
        lines = (line.split("\t") for line in CASES.read_text(encoding="utf-8").splitlines())
        known = [case for study, case in lines if study == name]
        if known:
            return known
    return [case.name for case in find(name).cases]


def written() -> dict[Path, str]:
    """studies.txt and cases.txt as they ought to be: a line for each study of this project, and for each of its cases."""
    ours = {entry: value for entry, value in sorted(_points().items()) if value.startswith("hil_scripts.")}
    rows = [row for entry, value in ours.items() for row in _rows(entry, value)]
    every = [f"{s.name}\t{c.name}\n" for entry, value in ours.items() for s in _studies(entry, value) for c in s.cases]
    return {LIST: "".join("\t".join(map(str, row)) + "\n" for row in rows), CASES: "".join(every)}


if __name__ == "__main__":
    for path, text in written().items():
        path.write_text(text, encoding="utf-8")
        print(path)
