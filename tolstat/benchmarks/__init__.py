"""Benchmarks: cost of a joint, its split by part, and ratios to other methods, all measured in one run."""
