"""Identification of the tanker from its own flights, against what it was flown with."""
