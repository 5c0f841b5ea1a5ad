"""What acts between aircraft: boom, radio, traffic."""
