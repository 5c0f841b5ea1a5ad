"""Offline estimation on recorded flights: `sil estimate FILE`."""
