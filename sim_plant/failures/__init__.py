"""What goes wrong: script, schedule, judge, command desk."""
