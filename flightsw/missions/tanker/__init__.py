"""A tanker on its track."""
