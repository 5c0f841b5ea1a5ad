"""Report on the fault matrix."""
