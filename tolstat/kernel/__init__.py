"""Jitted mechanics on plain arrays: no units, no files, no Python objects, failures as a status."""
