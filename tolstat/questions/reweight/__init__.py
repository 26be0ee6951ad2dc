"""Likelihood-ratio reweighting to other tolerances."""
