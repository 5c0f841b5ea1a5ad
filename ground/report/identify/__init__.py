"""Identification from flights."""
