"""Other tolerances from the same joints."""
