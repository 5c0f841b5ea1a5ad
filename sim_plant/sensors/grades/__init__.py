"""Grades of sensors, one TOML file each."""
