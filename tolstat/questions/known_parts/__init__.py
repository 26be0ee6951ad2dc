"""Tolerances known from measured parts: what the joints, the parts, and both leave open of each share."""
