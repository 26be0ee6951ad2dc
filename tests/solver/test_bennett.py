"""Bennett's linkage, slow and lightly loaded, against the statics of rigid members on elastic pins, at each angle.

Its pins would slide along their eyes, and it would be a linkage of four cylindrical pairs that carries moments alone,
were it not for its thrust faces: three of its constraints are redundant, as for a planar four-bar.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import linkages
from tests.support.elastic_statics import bushing_loads
from tolstat import joint as joints
from tolstat.common.tables import Options, Status
from tolstat.joint import Joint
from tolstat.joint.operation import OperationOfLinkage
from tolstat.solver.simulation import simulate_rows

pytestmark = pytest.mark.slow  # compiles the kernels for another mechanism
ERRORS: tuple[dict[str, tuple[float, float]], ...] = (
    {},
    {"3": (2e-6, 0.0)},
    {"2": (1e-6, -1.5e-6), "4": (-2e-6, 0.5e-6)},
)
"""Offsets of pins along t and z, m."""


def linear() -> tuple[Joint, OperationOfLinkage]:
    """The linkage of the reference with linear contacts without clearance, pressed faces, hardly any friction."""
    joint, operation = linkages.operation_of("bennett")
    contact = {"law": "uniform", "k1u": 0.0, "k2u": 2e8, "clearance": 0.0, "D_H": 0.076, "D_P": 0.076}
    sections = {"contact": contact, "friction": {"mu": 1e-5}, "thrust": {"end_play": -1e-6}}
    joint = joint.model_copy(
        update={name: getattr(joint, name).model_copy(update=values) for name, values in sections.items()}
    )
    linkage = operation.linkage
    pairs = {name: pair.model_copy(update={"clearance": None}) for name, pair in linkage.pair.items()}
    own = {"linkage": linkage.model_copy(update={"pair": pairs}), "speed": np.pi / 60, "torque": -1.0}
    return joint, operation.model_copy(update=own)


def test_loads_are_those_of_rigid_members_on_elastic_pins() -> None:
    """Half the difference of opposite torques and errors: deflections change the geometry, and loads by 0.4 %."""
    joint, operation = linear()
    mechanism, case = joints.mechanism_of(joint, operation), linkages.cases()["bennett"]
    errors, n = joints.nominal_errors(2 * len(ERRORS), mechanism), len(ERRORS)
    for i, of in enumerate(ERRORS):
        for pair, (t, z) in of.items():
            errors[f"{pair}_pin.offset_t"][[i, n + i]] = t, -t
            errors[f"{pair}_pin.offset_z"][[i, n + i]] = z, -z
    rows = joints.perturb(joint, operation, errors)
    rows["torque"][n:] *= -1.0
    found = simulate_rows(rows, Options(), "full", mechanism=mechanism)
    assert (found.results["status"] == Status.OK).all()
    odd = 0.5 * (found.histories["loads"][:n] - found.histories["loads"][n:])
    for of, loads in zip(ERRORS, odd, strict=True):
        angles = 2.0 * np.pi * np.arange(len(loads)) / len(loads)
        expected = np.array([bushing_loads(case, joint, operation.torque, of, theta) for theta in angles])
        for k in (slice(0, 3), slice(3, 6)):
            largest = np.linalg.norm(expected[..., k], axis=2).max()
            assert np.abs(loads - expected)[..., k].max() < 1e-4 * largest
