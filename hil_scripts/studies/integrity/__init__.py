"""The fault matrix: one fault at a time put into the flying system, and what becomes of it by the truth."""
