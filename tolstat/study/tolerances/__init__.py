"""Tolerances of a study: entries, kinds, distributions, correlation."""
