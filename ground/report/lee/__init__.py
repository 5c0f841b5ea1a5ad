"""The page on Lee (2011)."""
