"""The page on Sevil (2013)."""
