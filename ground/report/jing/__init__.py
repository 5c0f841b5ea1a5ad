"""The page on Jing et al."""
