"""Contact modes, and joints without a valid load."""
