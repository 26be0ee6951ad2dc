"""Which tolerances to change, for what they cost."""
