"""The two of a refuelling: usual system ids, colours of the plots."""

from __future__ import annotations

TANKER, RECEIVER = 1, 2
NAMES: dict[int, str] = {TANKER: "tanker", RECEIVER: "receiver"}
