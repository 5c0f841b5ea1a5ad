"""Least squares for one coefficient: values, standard errors, what is left."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

CONSTANT = "constant"


@dataclass(frozen=True)
class Equation:
    """One coefficient as fitted: value and standard error of each derivative, root mean square of what is left, share of the
    variance explained [-]; `rest`: what a constant took that the form has no place for."""

    name: str
    values: dict[str, float]
    errors: dict[str, float]
    rms: float
    r2: float
    rest: float = 0.0


def least_squares(name: str, columns: Mapping[str, Sequence[float]], y: Sequence[float]) -> Equation:
    """y by the columns; one called CONSTANT is reported as `rest`. Raises ValueError for columns that cannot be told apart."""
    A, b = np.array(list(columns.values())).T, np.array(y)
    scale = np.sqrt((A * A).sum(axis=0))
    if not np.all(scale > 0.0) or np.linalg.cond(A / scale) > 1e8:
        raise ValueError(f"{name}: its derivatives cannot be told apart by these points")
    x = np.linalg.lstsq(A / scale, b, rcond=None)[0] / scale
    left = b - A @ x
    var = float(left @ left) / max(len(b) - len(x), 1)
    sigma = np.sqrt(var * np.diag(np.linalg.inv((A / scale).T @ (A / scale)))) / scale
    spread = float(((b - b.mean()) ** 2).sum())
    values = dict(zip(columns, (float(v) for v in x), strict=True))
    errors = dict(zip(columns, (float(v) for v in sigma), strict=True))
    rest = values.pop(CONSTANT, 0.0)
    errors.pop(CONSTANT, None)
    r2 = 1.0 - float(left @ left) / spread if spread > 0.0 else 1.0
    return Equation(name, values, errors, math.sqrt(float(left @ left) / len(b)), r2, rest)
