"""A tanker that meets a receiver by range and bearing."""
