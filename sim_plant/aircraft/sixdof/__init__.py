"""Rigid-body aircraft in six degrees of freedom."""
