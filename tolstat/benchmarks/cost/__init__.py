"""Cost of a joint: its CPU time, the parts of that time, worker processes, start-up, ratios to other integrators."""
