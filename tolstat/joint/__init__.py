"""The nominal joint and its errors: joint files, the formulas behind their numbers, and `perturb`."""

from tolstat.joint.model import Joint, load
from tolstat.joint.perturbation import HOLE_OF_PIN, Operation, nominal_errors, operating, perturb
from tolstat.joint.variant import varied

__all__ = ["HOLE_OF_PIN", "Joint", "Operation", "load", "nominal_errors", "operating", "perturb", "varied"]
