"""A twin-jet transport in wind shear on the approach."""
