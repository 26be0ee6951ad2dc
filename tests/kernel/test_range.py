"""Range of the model: an axis that is tilted or shifted too far, or a clearance too large, ends a joint at once."""

import numpy as np
import pytest

from tests.support.of_cardan import CARDAN, HOLES, PINS
from tolstat import joint as joints
from tolstat.common.tables import MAX_SHIFT, MAX_TILT
from tolstat.joint import Operation
from tolstat.kernel.revolution.outcome import inside_model

OPERATION = Operation.model_construct(alpha=0.2, speed=50.0, torque=100.0)


def is_inside(joint, **errors):
    table = joints.nominal_errors(1, CARDAN)
    for name, value in errors.items():
        table[name.replace("__", ".")] = value
    return inside_model(joints.perturb(joint, OPERATION, table).view(np.recarray)[0])


@pytest.mark.parametrize("feature", PINS + HOLES)
def test_tilts_and_offsets(cirelli, feature):
    limit = MAX_SHIFT * cirelli.cross.R
    for axis in "etz":
        for sign in (1, -1):
            assert is_inside(cirelli, **{f"{feature}__offset_{axis}": sign * 0.999 * limit})
            assert not is_inside(cirelli, **{f"{feature}__offset_{axis}": sign * 1.001 * limit})
    for axis in "tz":
        for sign in (1, -1):
            assert is_inside(cirelli, **{f"{feature}__tilt_{axis}": sign * 0.999 * MAX_TILT})
            assert not is_inside(cirelli, **{f"{feature}__tilt_{axis}": sign * 1.001 * MAX_TILT})


@pytest.mark.parametrize("angle", [172.0, np.radians(172), 2 * np.pi, 4 * np.pi - 0.01, 1e300])
def test_a_tilt_near_whole_turns_is_not_small(cirelli, angle):
    assert not is_inside(cirelli, pin1__tilt_t=angle)
    assert not is_inside(cirelli, hole4__tilt_z=-angle, hole4__tilt_t=0.01)


def test_clearances(cirelli):
    limit = MAX_SHIFT * cirelli.cross.R - cirelli.contact.clearance
    assert is_inside(cirelli, pin2__clearance=0.999 * limit)
    assert not is_inside(cirelli, pin2__clearance=1.001 * limit)
    assert not is_inside(cirelli, hole1__diameter=0.03)


def test_a_number_that_is_none(cirelli):
    for name in ("pin1__offset_e", "hole3__tilt_t", "pin4__clearance"):
        assert not is_inside(cirelli, **{name: np.nan})
