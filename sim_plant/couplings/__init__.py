"""What acts between aircraft: relative motion, wake, traffic, TACAN and radar, boom, radio."""
