"""The twin-jet transport in the vertical plane."""
