"""Which tolerance causes the load."""
