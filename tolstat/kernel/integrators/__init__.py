"""Time integration methods and control of their steps."""
