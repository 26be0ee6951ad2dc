"""Which specification limits the process meets."""
