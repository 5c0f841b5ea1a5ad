"""Studies on Sevil (2013)."""
