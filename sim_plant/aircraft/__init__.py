"""Kinds of aircraft the plant flies."""
