"""A receiver: approach, contact, breakaway behind a tanker, and the way there."""
