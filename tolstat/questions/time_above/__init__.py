"""Share of a revolution above a level."""
