"""Position in the tanker's wake from the air-data probes alone."""
