"""Numerical error of the loads."""
