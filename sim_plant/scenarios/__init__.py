"""Scenario files: one TOML = one experiment (schema: sim_plant/scenario.py)."""
