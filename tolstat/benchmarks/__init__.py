"""The instruments: what a joint costs, where the time goes, and ratios to other ways, all measured in one run."""
