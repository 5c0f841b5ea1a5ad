"""What a flight is judged by, kept small: many flights are made side by side."""

from __future__ import annotations

from array import array

import numpy as np
from numpy.typing import NDArray


class Rows:
    """Rows of `width` numbers, eight bytes each: half an hour has a million of them. numpy reads it as [N, width]."""

    def __init__(self, width: int) -> None:
        self._numbers, self._width = array("d"), width

    def __len__(self) -> int:
        return len(self._numbers) // self._width

    def append(self, row: tuple[float, ...]) -> None:
        """Add a row. Raises ValueError for another width."""
        if len(row) != self._width:
            raise ValueError(f"row: {len(row)} numbers where {self._width} are kept")
        self._numbers.extend(row)

    def __array__(self, dtype: type | None = None, copy: bool | None = None) -> NDArray[np.float64]:
        """A copy [N, width]."""
        return np.array(self._numbers).reshape(-1, self._width)
