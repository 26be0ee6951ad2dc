"""Loads that one joint in a million exceeds."""
