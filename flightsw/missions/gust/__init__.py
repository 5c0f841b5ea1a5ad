"""Gust load alleviation on a small UAV."""
