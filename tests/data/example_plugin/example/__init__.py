"""A light aircraft on a course, in wind it measures by the triangle: an example of a package beside Wakefield."""

from __future__ import annotations

from pathlib import Path

HERE = Path(__file__).resolve().parent
DIALECT = HERE / "dialect.xml"
SCENARIOS = HERE / "scenarios"


def __getattr__(name: str) -> object:
    """The single parts, when somebody asks for one: the dialect must not cost a compiler."""
    if name == "MyFilter":
        from example.filters import MyFilter

        return MyFilter
    if name == "MyLaw":
        from example.law import MyLaw

        return MyLaw
    raise AttributeError(name)
