"""Which share of the joints of a lot, and of the next delivery, is above a limit."""
