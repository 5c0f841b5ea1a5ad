"""Sheets as a folder of Parquet or CSV files, one each, and `signals.csv`, which says what is in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv, parquet

from ground.export.sheets import Sheet, Text


def _table(sheet: Sheet) -> pa.Table:
    fields, arrays = [pa.field("t", pa.float64(), metadata={"unit": "s"})], [pa.array(sheet.t_us / 1e6)]
    for name, values in sheet.columns.items():
        array = pa.array(values.tolist(), pa.string()) if values.dtype.kind == "O" else pa.array(values)
        fields.append(pa.field(name, array.type, metadata={"unit": sheet.units.get(name, "")}))
        arrays.append(array)
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def _said(texts: Sequence[Text]) -> Sheet:
    who, words = (np.array([getattr(t, k) for t in texts], dtype=object) for k in ("who", "text"))
    severity = np.array([t.severity for t in texts], dtype=np.int8)
    t_us = np.array([t.t_us for t in texts], dtype=np.int64)
    return Sheet("texts", t_us, {"who": who, "severity": severity, "text": words})


def write(folder: Path, sheets: Sequence[Sheet], texts: Sequence[Text], kind: str) -> None:
    """Write `folder`/<name, "/" as ".">.<kind>, kind parquet or csv. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    index: dict[str, list[object]] = {k: [] for k in ("file", "column", "unit", "samples")}
    for sheet in [*sheets, *([_said(texts)] if texts else [])]:
        table, path = _table(sheet), folder / f"{sheet.name.replace('/', '.')}.{kind}"
        if kind == "parquet":
            parquet.write_table(table, path, compression="zstd")
        else:
            csv.write_csv(table, path)
        for name in sheet.columns:
            row = (path.name, name, sheet.units.get(name, ""), len(sheet))
            for key, value in zip(index, row, strict=True):
                index[key].append(value)
    csv.write_csv(pa.table(index), folder / "signals.csv")
