"""Lines of plots: those with the same parent are components of one entity, so that times and row numbers, most of what a row of
one number takes, are stored once for all of them.

The line a/b/c is `c:scalars` of the entity a/b, and its look `c:names`, `c:colors` and so on beside it. A plot is told which
components it shows, from the paths it was made with (`Fit`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray
from rerun.blueprint.api import Container

ROWS = (
    5000  # of a chunk: its compression looks back 64 KiB, to the offsets of the column before that of two numbers a row
)
LOOK = ("names", "colors", "widths", "interpolation_mode", "aggregation_policy")
BELOW = "/**"  # what ends a path that stands for all below it
Times = NDArray[np.int64]


def place(path: str) -> tuple[str, str]:
    """Entity of the line of a path, and its name there."""
    entity, _, name = path.rpartition("/")
    return entity or "/", name


def line_look(path: str, label: str, color: Sequence[int], width: float, step: bool, count: int) -> rr.DynamicArchetype:
    """How the line of a path, or each of `count` under one path, is drawn; width in points of the screen."""
    c, mode = rr.components, rr.components.InterpolationMode
    return rr.DynamicArchetype(
        place(path)[1],
        components={
            "names": c.NameBatch([label] * count),
            "colors": c.ColorBatch([color] * count),
            "widths": c.StrokeWidthBatch([width] * count),
            "interpolation_mode": c.InterpolationModeBatch([mode.StepAfter if step else mode.Linear]),
            "aggregation_policy": c.AggregationPolicyBatch([c.AggregationPolicy.MinMax]),
        },
    )


class Waiting:
    """Looks and rows of lines that are still to be sent."""

    def __init__(self) -> None:
        self._looks: dict[str, list[rr.DescribedComponentBatch]] = {}
        self._rows: dict[str, list[tuple[Times, dict[str, NDArray[np.float64]]]]] = {}

    def dress(self, path: str, shape: rr.DynamicArchetype) -> None:
        """The look of a line."""
        self._looks.setdefault(place(path)[0], []).extend(shape.as_component_batches())

    def add(self, path: str, t_us: Times, values: NDArray[np.float64]) -> None:
        """Values [n] or [n,k] of a line at t_us [n] [us]: beside others of its entity at the very same times."""
        entity, name = place(path)
        groups = self._rows.setdefault(entity, [])
        for times, lines in groups:
            if name not in lines and np.array_equal(times, t_us):
                lines[name] = values
                return
        groups.append((t_us, {name: values}))

    def looks(self) -> list[tuple[str, list[rr.DescribedComponentBatch]]]:
        """All looks by entity; then none are waiting."""
        out, self._looks = list(self._looks.items()), {}
        return out

    def take(self) -> Iterator[tuple[str, Times, rr.ComponentColumnList]]:
        """All rows as entity, times [us] and columns, at most `ROWS` rows at once; then none are waiting."""
        rows, self._rows = self._rows, {}
        for entity, groups in rows.items():
            for times, lines in groups:
                for at in range(0, len(times), ROWS):
                    columns = [c for name, v in lines.items() for c in _column(name, v[at : at + ROWS])]
                    yield entity, times[at : at + ROWS], rr.ComponentColumnList(columns)


def _column(name: str, values: NDArray[np.float64]) -> rr.ComponentColumnList:
    numbers = rr.DynamicArchetype.columns(name, components={"scalars": pa.array(values.ravel().astype(np.float32))})
    return numbers if values.ndim == 1 else numbers.partition([values.shape[1]] * len(values))


def _visualizer(name: str) -> rrb.Visualizer:
    """Draws the line of that name of an entity."""
    mapping, source = rrb.encodings.VisualizerComponentMapping, rrb.encodings.ComponentSourceKind.SourceComponent
    slots = {"Scalars:scalars": "scalars", **{f"SeriesLines:{part}": part for part in LOOK}}
    found = [mapping(slot, source, source_component=f"{name}:{part}") for slot, part in slots.items()]
    return rr.SeriesLines().visualizer(mappings=found)


class Fit:
    """The plots of a blueprint, made to show what there is: the viewer marks a plot of a component that is not there."""

    def __init__(self, blueprint: rrb.Blueprint) -> None:
        self._plots = [(view, tuple(map(str, view.contents))) for view in _plots(blueprint.root_container)]
        self._shown: list[list[str]] = [[] for _ in self._plots]

    def __call__(self, lines: Iterable[str]) -> bool:
        """Tell every plot which of the lines, by their paths, it shows; whether that is more than before."""
        order, anew = sorted(lines), False
        for i, (view, wanted) in enumerate(self._plots):
            below = tuple(w.removesuffix("**") for w in wanted if w.endswith(BELOW))
            shown = [path for path in order if path in wanted or f"{path}/".startswith(below)]
            if shown != self._shown[i]:
                self._shown[i], anew = shown, True
                drawn: dict[str, list[rrb.Visualizer]] = {}
                for entity, name in map(place, shown):
                    drawn.setdefault(entity, []).append(_visualizer(name))
                view.contents = [*drawn, *(w for w in wanted if w not in shown)]
                view.visualizer_overrides = drawn
        return anew


def _plots(container: Container) -> Iterator[rrb.TimeSeriesView]:
    for part in container.contents:
        if isinstance(part, Container):
            yield from _plots(part)
        elif isinstance(part, rrb.TimeSeriesView):
            yield part
