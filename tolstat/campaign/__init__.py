"""Campaigns: simulate the pending rows of a result file; plan, verify, replay, extend and stop them."""
