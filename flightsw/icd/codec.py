"""Port types to and from messages: the only place with wire units.

`FlightCodec` serves the onboard side, `PlantCodec` the plant. Both re-exported here; telemetry encoders:
codec_telemetry.
"""

from __future__ import annotations

from flightsw.icd.codec_flight import FlightCodec
from flightsw.icd.codec_plant import PlantCodec, Reply
from flightsw.icd.scaling import ControlScale

__all__ = ["ControlScale", "FlightCodec", "PlantCodec", "Reply"]
