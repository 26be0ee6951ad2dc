"""The nominal joint and its errors: joint files, the formulas behind their numbers, and `perturb`.

Names are imported when first used: a worker process needs none of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tolstat.common import late

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

_OF_OPERATION = ("MEANS", "SPLINE", "Operation", "OperationOfLinkage", "OperationOfShaft", "joints_of", "mechanism_of")
_HOMES = {
    "Bearing": "bearing",
    "DriveShaft": "shaft",
    "Linkage": "linkage",
    **dict.fromkeys(("affecting_results", "affects_results", "Joint"), "model"),
    **dict.fromkeys(_OF_OPERATION, "operation"),
    **dict.fromkeys(("nominal_errors", "operating", "perturb"), "perturbation"),
    **dict.fromkeys(("load", "varied"), "reading"),
}

__getattr__ = late.names(__name__, {name: f"{__name__}.{module}" for name, module in _HOMES.items()})
