"""Speed of everything."""
