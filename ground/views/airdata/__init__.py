"""Position in the wake and fault detection, from the logs."""
