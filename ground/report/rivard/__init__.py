"""The page on Rivard (1982)."""
