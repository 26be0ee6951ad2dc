"""Questions to a result file, one folder per question."""
