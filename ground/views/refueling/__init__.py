"""Refuelling: a receiver keeps its station behind its tanker, from the logs."""
