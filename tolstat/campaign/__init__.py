"""Pending rows through executors into the result file."""
