"""The stock generator's own module of house.xml: the independent proof of the layout that is read from the same file."""

from __future__ import annotations

from types import ModuleType
from typing import Any

from flightsw.icd.dialect import XML
from ground.dialect import generate


def module(name: str, text: str) -> Any:
    """A module of its own from its text."""
    m = ModuleType(name)
    exec(compile(text, f"{name}.py", "exec"), m.__dict__)  # noqa: S102
    return m


mav = module("mav", generate(XML.read_text(), "Python3"))
