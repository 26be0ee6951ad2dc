"""Joints with thrust faces, friction of pins or bearings of shafts, made as a study makes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tolstat import joint as joints
from tolstat.common.mechanism import Mechanism

FREE = {"axial": "free"}
FACES = {"end_play": "0.05 mm", "k": "1e8 N/m"}
FRICTION = {"mu": 0.1, "radius": "19 mm"}
RPM = np.pi / 30
TUBE = {"mass": "5 kg", "inertia": "0.005 kg*m^2", "inertia_across": "0.15 kg*m^2", "centre": "0.3 m"}


def drive_shaft(alpha: float, arrangement: str | float = "Z", **keys: Any) -> joints.DriveShaft:
    """Drive shaft of 1.2 m with a spline in the middle whose joint 2 is bent by `alpha` (rad); `keys` as in a file."""
    spline = {"at": "0.6 m", "mu": 0.1, "diameter": "40 mm"}
    values = {"arrangement": arrangement, "length": "1.2 m", "tube": TUBE, "spline": spline, **keys}
    return joints.DriveShaft.model_validate({"alpha": f"{alpha} rad", **values})


def held(
    errors: Mapping[str, float] | None = None,
    alpha: float = np.radians(15.0),
    speed: float = 500 * RPM,
    axial_force: float = 0.0,
    drive_shaft: joints.DriveShaft | None = None,
    **sections: Any,
) -> tuple[np.recarray[Any, np.dtype[np.void]], Mechanism]:
    """The joint of Cirelli et al. at 100 N m, or a shaft of two, with sections of a joint file."""
    joint = joints.load("cirelli2021", sections, "case.toml")
    point = {"alpha": alpha, "speed": speed, "torque": 100.0, "axial_force": axial_force}
    operation = joints.Operation.model_construct(**point)
    if drive_shaft is not None:
        operation = joints.OperationOfShaft.model_construct(**point, shaft=drive_shaft)
    mechanism = joints.mechanism_of(joint, operation)
    table = joints.nominal_errors(1, mechanism)
    for name, value in (errors or {}).items():
        table[name] = value
    return joints.perturb(joint, operation, table).view(np.recarray), mechanism
