"""Load cycles, damage and equivalent loads."""
