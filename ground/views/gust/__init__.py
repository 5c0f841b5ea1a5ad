"""Gust load alleviation, from the logs."""
