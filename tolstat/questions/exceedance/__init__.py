"""What load is exceeded by which share of the joints."""
