"""From parameters to results around the kernel: rows, refinement, fidelity, references."""
