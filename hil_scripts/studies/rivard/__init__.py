"""Studies on Rivard (1982)."""
