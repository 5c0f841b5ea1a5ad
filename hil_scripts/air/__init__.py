"""The air of the plant beside its closed forms: laws and pictures."""
