"""Envelope protection and recovery to level flight of a six-degree-of-freedom aircraft (docs/sources/recovery.md)."""
