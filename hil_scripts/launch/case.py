"""`sil case`: fly a check case of the plant's equations of motion and write its table."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from flightsw.files import write_whole
from flightsw.strict import ConfigError, near
from sim_plant.earth import nesc
from sim_plant.earth.body import fly, load_case

OURS = Path(nesc.__file__).parent / "cases"
UNITS = ("si", "nesc")


def find(file: Path) -> Path:
    """A case file as given, or one of ours by name. Raises ConfigError."""
    if file.exists():
        return file
    names = sorted(p.stem for p in OURS.glob("*.toml"))
    if str(file) not in names:
        raise ConfigError(f"case {str(file)!r}: no such file; ours: {', '.join(names)}{near(str(file), names)}")
    return OURS / f"{file}.toml"


def run(file: Path, out: Path | None, columns: str) -> None:
    """Fly `file` and write its table to `out`, or to the screen. Raises ConfigError, OSError."""
    if columns not in UNITS:
        raise ConfigError(f"--columns {columns!r}: allowed: {', '.join(UNITS)}")
    flown = fly(load_case(find(file)))
    table = nesc.table(flown) if columns == "nesc" else flown
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table)
    writer.writerows(zip(*(c.tolist() for c in table.values()), strict=True))
    if out is None:
        print(text.getvalue(), end="")
    else:
        write_whole(out, text.getvalue())
