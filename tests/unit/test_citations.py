"""Citations lead somewhere: `lee.md 3.5` to a heading, erratum or trap of docs/sources/lee.md, links of the docs to a page and
heading that exist."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "docs" / "sources"
TOP = ("flightsw", "sim_plant", "ground", "hil_scripts", "tests", "docs", "data")
KINDS = (".py", ".md", ".toml", ".xml")

PLACE = r"(?:(?:sections?|errata|erratum|traps?)\s+)?(?:E?\d+(?:\.\d+)*)\b(?!\s*(?:%|deg|m\b|m/s))"
CITED = re.compile(
    rf"(?<![\w/.-])(?P<work>[a-z][a-z-]*)\.md(?:,?\s+(?P<places>{PLACE}(?:(?:,|\s+and|\s+to|-|,\s+and)\s*{PLACE})*))?"
)
ONE = re.compile(r"(?P<kind>sections?|errata|erratum|traps?)?\s*(?P<no>E?\d+(?:\.\d+)*)")
LINK = re.compile(r"\]\((?P<to>[^)\s]+)\)")
DOC = re.compile(r"(?<![\w/])docs/[\w/-]+\.md(?:#[\w.-]+)?")
NUMBERED = re.compile(r"^#+ (\d+(?:\.\d+)*)\b|\*\*(trap \d+)\*\*|^\| (E\d+) \|", re.MULTILINE)
HEADING = re.compile(r"^#+ +(.+)$", re.MULTILINE)
NAMELESS = re.compile(r"\b[Ss]pec \d+(?:\.\d+)*")  # a section of a page it does not name


def files() -> list[Path]:
    """Text of the project that may cite: sources, docs, configuration; not this file, whose examples dangle on purpose."""
    found = [p for top in TOP for p in (ROOT / top).rglob("*") if p.suffix in KINDS and "site-packages" not in p.parts]
    return sorted(set(found) - {Path(__file__)} | {ROOT / "README.md", ROOT / "pyproject.toml"})


@cache
def places(page: Path) -> frozenset[str]:
    """Numbers of a page of sources: headings "3.5", errata "E13", traps "trap 6"."""
    return frozenset(x for m in NUMBERED.findall(page.read_text()) for x in m if x)


@cache
def pages() -> frozenset[str]:
    """File names of all pages of the docs: prose may name one."""
    return frozenset(p.name for p in (ROOT / "docs").rglob("*.md"))


@cache
def slugs(page: Path) -> frozenset[str]:
    """Anchors a renderer gives the headings of a page."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    plain = (re.sub(r"[^\w\s-]", "", h).strip().lower() for h in HEADING.findall(text))
    return frozenset(re.sub(r"[-\s]+", "-", h) for h in plain)


def joined(text: str) -> str:
    """Text with its lines joined: a citation may go over the end of a line of a docstring or comment."""
    return re.sub(r"\s*\n[ \t]*(?:#:?[ \t])?", " ", text)


def wanted(text: str) -> Iterator[tuple[str, str]]:
    """(work, place) of every citation: place "3.5", "E13", "trap 6", or "" for the page alone."""
    for m in CITED.finditer(joined(text)):
        if not m["places"]:
            yield m["work"], ""
            continue
        kind = ""
        for one in ONE.finditer(m["places"]):
            kind = one["kind"] or kind
            yield m["work"], f"trap {one['no']}" if kind.startswith("trap") and one["no"][0] != "E" else one["no"]


def dangling(text: str) -> list[str]:
    """Citations in a text that lead nowhere."""
    out = [f"{m.group()}: of what page" for m in NAMELESS.finditer(text)]
    for work, place in wanted(text):
        page = SOURCES / f"{work}.md"
        if not page.exists():
            if place or f"{work}.md" not in pages():
                out.append(f"{work}.md: no such page in docs/sources")
        elif place and place not in places(page):
            out.append(f"{work}.md {place}: no such section, erratum or trap")
    return out


def broken(text: str, at: Path) -> list[str]:
    """Links of a page to files or headings that do not exist, and `docs/...` named in any text."""
    out = []
    links = [(at.parent, m["to"]) for m in LINK.finditer(text)] if at.suffix == ".md" else []
    for base, to in [*links, *((ROOT, m.group()) for m in DOC.finditer(text))]:
        if re.match(r"[a-z]+:", to):
            continue
        path, _, anchor = to.partition("#")
        target = (base / path).resolve() if path else at
        if not target.exists():
            out.append(f"{to}: no such file")
        elif anchor and target.suffix == ".md" and anchor not in slugs(target):
            out.append(f"{to}: no such heading")
    return out


@pytest.mark.parametrize("look", [lambda text, at: dangling(text), broken], ids=["citations", "links"])
def test_nothing_dangles(look) -> None:  # type: ignore[no-untyped-def]
    found = {str(p.relative_to(ROOT)): bad for p in files() if (bad := look(p.read_text(errors="replace"), p))}
    assert not found, "\n".join(f"{p}: {x}" for p, bad in found.items() for x in bad)


def test_citations_are_many() -> None:
    """What the pattern no longer finds could not dangle."""
    cited = [w for p in files() for w in wanted(p.read_text(errors="replace")) if w[1]]
    assert len(cited) > 150
    assert {w for w, _ in cited} == {p.stem for p in SOURCES.glob("*.md")} - {"README"}


def test_every_page_is_in_the_site() -> None:
    """mkdocs.yml names each page once, and no other."""
    listed = re.findall(r": ([\w/-]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)
    assert sorted(listed) == sorted(str(p.relative_to(ROOT / "docs")) for p in (ROOT / "docs").rglob("*.md"))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("as in lee.md 3.5", []),
        ("lee.md section 3.5, E13, E99", ["lee.md E99"]),
        ("(lee.md 3.6, 3.7, 8.9).", ["lee.md 8.9"]),
        ("lee.md errata E16-E18, traps 13, 14, 15", ["lee.md trap 15"]),
        ("lee.md traps 13 and erratum E31", ["lee.md E31"]),
        ("of lee.md\n    section 77", ["lee.md 77"]),
        ("# of lee.md\n# section 77", ["lee.md 77"]),
        ("sevil.md sections 3.2 and 8.2 to 8.6", ["sevil.md 8.6"]),
        ("nobody.md section 3", ["nobody.md: no such page"]),
        ("nobody.md", ["nobody.md: no such page"]),
        ("environment.md: 3 things", ["environment.md: no such page"]),
        ("(spec 9.3)", ["spec 9.3: of what page"]),
        ("jing.md (37)", []),
        ("hoffmann.md: 0.52 deg of alpha_W", []),
    ],
)
def test_made_up_citations(text: str, found: list[str]) -> None:
    got = dangling(text)
    assert len(got) == len(found) and all(g.startswith(f) for g, f in zip(got, found, strict=True)), got


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("[a](lee.md)", []),
        ("[a](nowhere.md)", ["nowhere.md: no such file"]),
        ("[a](sources/lee.md#35-wind)", []),
        ("[a](sources/lee.md#35-storm)", ["sources/lee.md#35-storm: no such heading"]),
        ("see docs/nowhere.md", ["docs/nowhere.md: no such file"]),
        ("[a](https://example.org/x.md)", []),
    ],
)
def test_made_up_links(text: str, found: list[str]) -> None:
    assert broken(text, ROOT / "docs" / "made-up.md") == found


def test_tests_a_page_names_exist() -> None:
    """The safety case rests on them."""
    written = {
        n for p in (ROOT / "tests").rglob("test_*.py") for n in re.findall(r"^def (test_\w+)\(", p.read_text(), re.M)
    }
    named = {n for p in (ROOT / "docs").rglob("*.md") for n in re.findall(r"`(test_\w+)`", p.read_text())}
    modules = {p.stem for p in (ROOT / "tests").rglob("test_*.py")}
    assert len(named) > 20 and not named - written - modules
