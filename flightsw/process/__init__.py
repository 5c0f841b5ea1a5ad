"""What makes the onboard software a process: loop, node, clock, executive, recorder, services, telemetry, replay."""
