"""The nominal joint and its errors: joint files, the formulas behind their numbers, and `perturb`."""

from tolstat.joint.model import Joint, load
from tolstat.joint.perturbation import Operation, nominal_errors, perturb
from tolstat.joint.variant import varied

__all__ = ["Joint", "Operation", "load", "nominal_errors", "perturb", "varied"]
