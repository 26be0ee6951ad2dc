"""What only a Cardan joint has: ideal motion, rigid guess, ideal loads and travel of its pins in closed form."""
