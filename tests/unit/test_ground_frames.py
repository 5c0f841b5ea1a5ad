"""pandas is imported where a table is asked for, and not by what makes none."""

from __future__ import annotations

import subprocess
import sys

CODE = """
import sys
from ground.frames import frame, unasked
unasked()
import pyarrow
drawn = pyarrow.array([1, 2], type=pyarrow.uint8())
early = "pandas" in sys.modules
import numpy as np
t = np.array([0.0, 0.5])
made = frame(t, {"x": 2.0 * t}, "pandas")
back = pyarrow.Table.from_pandas(made).to_pandas()
assert back.equals(made) and made["x"].tolist() == [0.0, 1.0] and drawn.to_pylist() == [1, 2]
print(early, "pandas" in sys.modules)
"""


def test_a_picture_needs_no_pandas_and_a_table_after_it_is_one() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True"]
