"""A light aircraft on a course, in wind it measures by the triangle: an example of a package beside Wakefield."""

from __future__ import annotations

from pathlib import Path

HERE = Path(__file__).resolve().parent
DIALECT = HERE / "dialect.xml"
SCENARIOS = HERE / "scenarios"


def __getattr__(name: str) -> object:
    """The filter, when somebody asks for it: the dialect must not cost a compiler."""
    if name == "MyFilter":
        from example.filters import MyFilter

        return MyFilter
    raise AttributeError(name)
