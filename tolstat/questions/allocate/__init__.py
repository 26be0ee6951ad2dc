"""Cheapest tolerances with which limits are kept."""
