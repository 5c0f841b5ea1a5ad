"""Wind shear on the approach, from the logs."""
