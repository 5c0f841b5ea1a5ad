"""Logs of flights, ours and other people's, as sheets: `.tlog` (MAVLink 1 and 2), ULog, ArduPilot's DataFlash `.bin`, CSV.

What is damaged is left out and counted, never shown: packets by their CRC where the format has one, by length, by known type and
by time where it has none.
"""
