"""What the missions of flight in a vertical plane share."""
