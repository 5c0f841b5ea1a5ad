"""Links of the ground: recording, live view, commands, injected failures."""
