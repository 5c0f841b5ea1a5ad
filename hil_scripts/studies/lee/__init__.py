"""Studies on Lee (2011)."""
