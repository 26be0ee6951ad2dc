"""The nominal joint and its errors: joint files, the formulas behind their numbers, and `perturb`."""

from tolstat.joint.bearing import Bearing
from tolstat.joint.model import AFFECT_NOTHING, Joint, load
from tolstat.joint.perturbation import HOLE_OF_PIN, Operation, nominal_errors, operating, perturb
from tolstat.joint.variant import varied

__all__ = [
    "AFFECT_NOTHING",
    "HOLE_OF_PIN",
    "Bearing",
    "Joint",
    "Operation",
    "load",
    "nominal_errors",
    "operating",
    "perturb",
    "varied",
]
