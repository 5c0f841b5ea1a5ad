"""A study small enough for tests: noise whose statistics are known, and failures on order."""

from __future__ import annotations

import os
import time

import numpy as np

from hil_scripts.campaign.study import Case, RunResult, Study


def run(case: Case, seed: int) -> RunResult:
    """Mean and RMS of 50 normal draws; `slow_s` waits, `fail_odd` raises for odd seeds, `die` ends the process."""
    p = case.params
    if "slow_s" in p:
        time.sleep(p["slow_s"])
    if p.get("die"):
        os._exit(7)
    if p.get("fail_odd") and seed % 2:
        raise ValueError(f"seed {seed} is odd")
    e = np.random.default_rng(seed).normal(p.get("bias", 0.0), p["sigma"], 50)
    values = {
        "default.mean": float(e.mean()),
        "default.rms": float(np.sqrt(np.mean(e**2))),
        "est.lost": float(e[0] > 0),
    }
    if p.get("sometimes") and seed % 2:
        values["default.never_s"] = float("inf")
    return RunResult(values, {"t": np.arange(50.0), "default.wind": np.stack([e, e, e], axis=1)})


STUDY = Study(
    name="demo",
    title="Noise with known statistics",
    purpose="Shows that the engine adds nothing to the results",
    cases=(
        Case("calm", {"sigma": 0.5}),
        Case("G_0.3", {"sigma": 1.0, "bias": 0.1, "sometimes": True}),
        Case("unreliable", {"sigma": 1.0, "fail_odd": True}),
    ),
    run=run,
    default_runs=5,
)
