"""The small UAV in the vertical plane."""
