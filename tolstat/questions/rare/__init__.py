"""Probabilities of rare loads, by subset simulation."""
