"""The nominal joint and its errors: joint files, the formulas behind their numbers, and `perturb`.

Names are imported when first used: a worker process needs none of them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolstat.joint.bearing import Bearing as Bearing
    from tolstat.joint.linkage import Linkage as Linkage
    from tolstat.joint.model import Joint as Joint
    from tolstat.joint.model import affecting_results as affecting_results
    from tolstat.joint.model import affects_results as affects_results
    from tolstat.joint.operation import MEANS as MEANS
    from tolstat.joint.operation import SPLINE as SPLINE
    from tolstat.joint.operation import Operation as Operation
    from tolstat.joint.operation import OperationOfLinkage as OperationOfLinkage
    from tolstat.joint.operation import OperationOfShaft as OperationOfShaft
    from tolstat.joint.operation import joints_of as joints_of
    from tolstat.joint.operation import mechanism_of as mechanism_of
    from tolstat.joint.perturbation import nominal_errors as nominal_errors
    from tolstat.joint.perturbation import operating as operating
    from tolstat.joint.perturbation import perturb as perturb
    from tolstat.joint.reading import load as load
    from tolstat.joint.reading import varied as varied
    from tolstat.joint.shaft import DriveShaft as DriveShaft

_HOMES = {
    "bearing": ("Bearing",),
    "linkage": ("Linkage",),
    "model": ("affecting_results", "affects_results", "Joint"),
    "operation": (
        *("MEANS", "SPLINE", "Operation", "OperationOfLinkage", "OperationOfShaft"),
        *("joints_of", "mechanism_of"),
    ),
    "perturbation": ("nominal_errors", "operating", "perturb"),
    "reading": ("load", "varied"),
    "shaft": ("DriveShaft",),
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"tolstat.joint.{home}"), name)
    raise AttributeError(f"module 'tolstat.joint' has no attribute {name!r}")
