"""Randomness: one generator per consumer, derived from (seed, consumer name), so that consumers never share draws."""

from __future__ import annotations

import hashlib

import numpy as np

BLOCK = 1000  # rows drawn at a time: few numpy calls, and the series does not depend on it


def generator(seed: int, name: str) -> np.random.Generator:
    """PCG64 generator of consumer `name` for run `seed`. The name is hashed with SHA-256, so it is stable
    everywhere."""
    words = np.frombuffer(hashlib.sha256(name.encode()).digest()[:16], dtype="<u4")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *(int(w) for w in words)])))
