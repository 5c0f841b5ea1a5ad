"""A receiver's way to its tanker, from the logs."""
