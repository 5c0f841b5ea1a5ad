"""Studies on Jing et al."""
