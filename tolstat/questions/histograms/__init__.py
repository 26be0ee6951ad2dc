"""What was drawn, and which loads came of it: histograms."""
