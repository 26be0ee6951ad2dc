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


def held(
    errors: Mapping[str, float] | None = None,
    alpha: float = np.radians(15.0),
    speed: float = 500 * RPM,
    axial_force: float = 0.0,
    series: joints.Series | None = None,
    **sections: Any,
) -> tuple[np.recarray[Any, np.dtype[np.void]], Mechanism]:
    """The joint of Cirelli et al. at 100 N m with sections of a joint file: parameters, (1,), and mechanism."""
    joint = joints.load("cirelli2021", sections, "case.toml")
    model = joints.Operation if series is None else joints.OperationInSeries
    point = {"alpha": alpha, "speed": speed, "torque": 100.0, "axial_force": axial_force}
    operation = model.model_construct(**point, **({"series": series} if series else {}))
    mechanism = joints.mechanism_of(joint, operation)
    table = joints.nominal_errors(1, mechanism)
    for name, value in (errors or {}).items():
        table[name] = value
    return joints.perturb(joint, operation, table).view(np.recarray), mechanism
