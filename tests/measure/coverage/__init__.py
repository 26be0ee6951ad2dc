"""Coverage of every interval that a user can read, on problems with known answers."""
