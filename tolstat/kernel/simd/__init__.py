"""Compilation, and arithmetic of many joints at once."""
