"""What is asked of a result file, one folder a question."""
