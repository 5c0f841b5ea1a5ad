"""Integrity of the relative position: independent sources tested against each other, and a bound on what is left."""
