"""Statistics from many joints of a low and few joints of a high fidelity."""
