"""Fault detection and isolation of the air-data channels."""
