"""Rendezvous by TACAN, from the logs."""
