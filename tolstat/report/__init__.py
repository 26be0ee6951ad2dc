"""The report of a result file: the answers that make it, and the page."""
