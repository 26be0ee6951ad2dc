"""Sampling methods in words, and those that draw joints from the tolerances."""

METHODS = {
    "random": "random sampling",
    "sobol": "Sobol' points",
    "lhs": "Latin hypercube",
    "sweep": "sweep",
    "importance": "importance sampling",
    "pick_freeze": "pick-freeze design",
}
DRAWN = ("random", "sobol", "lhs")
"""Sampling methods that draw every joint from the tolerances, all with the same weight."""
