"""How long the needle bearings of the pins last."""
