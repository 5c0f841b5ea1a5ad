"""Arrays of several aircraft as rows of one, which a compiled call takes at the cost of one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Arr = NDArray[np.float64]


class Block:
    """`rows` [aircraft, width]. An array laid into a row is a view on its part from then on.

    A copy (deepcopy) has views of its own in their places, for whoever held one; whoever owns both copies the block first, as a
    view that has been copied before is an array by itself.
    """

    def __init__(self) -> None:
        self.rows: Arr = np.zeros((0, 0))
        self._views: list[tuple[Arr, int, int]] = []  # view, row, where it begins

    def size(self, rows: int, width: int) -> None:
        """Begin anew with so many rows of this width, all zero."""
        self.rows, self._views = np.zeros((rows, width)), []

    def lay(self, i: int, at: int, x: Arr) -> Arr:
        """The part of row i from `at` on with the values and the shape of x, as a view."""
        view = self._view(i, at, x.shape)
        view[...] = x
        self._views.append((view, i, at))
        return view

    def _view(self, i: int, at: int, shape: tuple[int, ...]) -> Arr:
        return self.rows[i, at : at + int(np.prod(shape))].reshape(shape)

    def __deepcopy__(self, memo: dict[int, Any]) -> Block:
        twin = Block()
        memo[id(self)] = twin
        memo[id(self.rows)] = twin.rows = self.rows.copy()
        for view, i, at in self._views:
            memo[id(view)] = new = twin._view(i, at, view.shape)
            twin._views.append((new, i, at))
        return twin
