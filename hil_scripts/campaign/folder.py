"""The campaign folder: whose it is (meta.json), and that it is the right one to go on with."""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hil_scripts.campaign import journal, table, task
from hil_scripts.campaign.study import CampaignError, Case, Study

META = "meta.json"
TRACES = "traces"
LIBRARIES = ("wakefield", "numpy", "scipy", "numba", "distributed", "pyarrow")
OWN = (META, journal.FILE, table.PARQUET, table.SUMMARY, TRACES)  # what --fresh removes, and nothing else


def default_folder(study: Study, master_seed: int) -> Path:
    """campaigns/<study>-<seed> below the working directory."""
    return Path("campaigns") / f"{study.name}-{master_seed}"


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")


def _git(*args: str) -> str:
    try:
        r = subprocess.run(
            ["git", "-C", str(task.ROOT), *args], capture_output=True, text=True, timeout=10, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return r.stdout.strip() if r.returncode == 0 else ""


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def read_meta(folder: Path) -> dict[str, Any] | None:
    """meta.json of a campaign folder, None when the folder is new or empty. Raises CampaignError on anything else."""
    path = folder / META
    try:
        text = path.read_text() if path.exists() else None
        strangers = text is None and folder.is_dir() and any(folder.iterdir())
        meta = json.loads(text) if text is not None else None
    except OSError as e:
        raise CampaignError(f"{folder}: cannot be read: {e.strerror}") from None
    except ValueError:
        raise CampaignError(f"{path} is damaged; name another folder with --out") from None
    if strangers:
        raise CampaignError(f"{folder} is not empty and not a campaign folder (no {META}); name another with --out")
    if text is None:
        return None
    if not isinstance(meta, dict) or not {"study", "master_seed", "cases", "identity"} <= meta.keys():
        raise CampaignError(f"{path} is not a campaign's; name another folder with --out")
    return meta


def check_owner(folder: Path, meta: dict[str, Any], study: Study, master_seed: int) -> None:
    """Raises CampaignError when the folder belongs to another study or master seed."""
    for what, has, wants in [("study", meta["study"], study.name), ("seed", meta["master_seed"], master_seed)]:
        if has != wants:
            raise CampaignError(
                f"{folder} holds a campaign of {what} {has}, not {wants}; name another folder with --out"
            )


def check_same(folder: Path, meta: dict[str, Any], cases: Sequence[Case], mixed: bool) -> None:
    """May new runs join the recorded ones? Raises CampaignError when a case has other parameters, or (unless `mixed`)
    when models, algorithms, studies or numerical libraries have changed since.
    """
    for case in cases:
        old = meta["cases"].get(case.name)
        if old is not None and old != json.loads(json.dumps(case.params)):
            raise CampaignError(
                f"{folder}: case {case.name} was run with {json.dumps(old)}, the study now says {json.dumps(case.params)}; "
                "--fresh discards the old runs, --out names another folder"
            )
    now, then = task.identity(), meta["identity"][-1]
    other = [f"{k} {then.get(k)} -> {v}" for k, v in now.items() if then.get(k) != v]
    if other and not mixed:
        raise CampaignError(
            f"{folder}: the recorded runs were made by other code ({', '.join(other)}); --fresh discards them, "
            "--resume adds to them all the same, --out names another folder"
        )


def clear(folder: Path) -> None:
    """Remove a campaign's own files from its folder. Raises OSError."""
    for name in OWN:
        path = folder / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def new_meta(
    old: dict[str, Any] | None, study: Study, master_seed: int, runs: int, cases: Sequence[Case]
) -> dict[str, Any]:
    """meta.json at the start of a session: cases and code identities of earlier sessions are kept."""
    commit, now = _git("rev-parse", "HEAD"), task.identity()
    known: list[dict[str, str]] = list(old["identity"]) if old else []
    return {
        "study": study.name,
        "title": study.title,
        "purpose": study.purpose,
        "master_seed": master_seed,
        "runs": max(runs, int(old.get("runs", 0)) if old else 0),
        "cases": {**(old["cases"] if old else {}), **{c.name: c.params for c in cases}},
        "identity": known if known and known[-1] == now else [*known, now],
        "git_commit": commit or "unknown",
        "git_dirty": bool(_git("status", "--porcelain")) if commit else None,
        "versions": {n: _version(n) for n in LIBRARIES},
        "python": platform.python_version(),
        "platform": platform.platform(),
        "cpu_count": os.cpu_count(),
        "command": sys.argv,
        "started": old.get("started", _now()) if old else _now(),
        "sessions": (int(old.get("sessions", 1)) if old else 0) + 1,
        "wall_s": float(old.get("wall_s", 0.0)) if old else 0.0,
        "complete": False,
    }


def write_meta(folder: Path, meta: dict[str, Any]) -> None:
    """Write meta.json, stamped now. Raises OSError."""
    table.replace_bytes(folder / META, (json.dumps({**meta, "written": _now()}, indent=1) + "\n").encode())


def write_traces(folder: Path, case: str, traces: dict[str, NDArray[Any]]) -> None:
    """traces/<case>.npz, complete or not at all. Raises OSError."""
    (folder / TRACES).mkdir(exist_ok=True)
    path = folder / TRACES / f"{case}.npz"
    tmp = path.with_suffix(".part")
    with open(tmp, "wb") as f:
        np.savez_compressed(f, **traces)  # type: ignore[arg-type]
    tmp.replace(path)
