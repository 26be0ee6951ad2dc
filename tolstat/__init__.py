"""tolstat: Monte Carlo tolerance analysis of Cardan joints."""

__version__ = "0.1.0"
