"""A flap on three hinges of the study against a rigid beam on springs with gaps, solved by enumeration."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tolstat import joint as joints
from tolstat import study
from tolstat.common.tables import Options, Status
from tolstat.solver.simulation import simulate_rows

pytestmark = pytest.mark.slow  # compiles the kernels for another mechanism
Array = NDArray[np.float64]
STUDY = Path(__file__).parents[2] / "studies" / "hinge_line.toml"
HEIGHTS = np.array([-0.3, 0.0, 0.3])
"""Places of the hinges along the axis of the flap, m."""


def beam(off: Array, gap: Array, k: Array, moment: float) -> Array:
    """Forces of the hinges, N, on a rigid beam that a moment turns.

    The linear complementarity problem by enumeration: each hinge bears on one side, on the other, or not at all. Of
    each hinge: `off` a line and `gap`, m; stiffness `k`, N/m.
    """
    for sides in product((-1.0, 0.0, 1.0), repeat=3):
        side, bears = np.array(sides), np.array(sides) != 0.0
        across = np.stack([np.ones(3), HEIGHTS])[:, bears]
        if bears.sum() < 2:
            continue
        # force k (side gap - off - a - b height) of each hinge that bears; their sum is zero, their moment is given
        pressed = across * k[bears]
        a, b = np.linalg.solve(pressed @ across.T, pressed @ (side * gap - off)[bears] - [0.0, moment])
        apart = off + a + b * HEIGHTS
        force = np.where(bears, k * (side * gap - apart), 0.0)
        if np.all(np.where(bears, apart * side >= gap, abs(apart) <= gap)):
            return force
    raise AssertionError("one combination is in equilibrium")


FRICTIONLESS = ("mu = 0.12, mu_along = 0.12", "mu = 0.0, mu_along = 0.0")


def of_study(tmp_path: Path, *changes: tuple[str, str]) -> study.Study:
    """The study without friction, slow enough for statics, with hinges that do not resist a tilt."""
    text = STUDY.read_text(encoding="utf-8")
    for old, new in (FRICTIONLESS, ('z = "20 mm"', 'z = "0.5 mm"'), *changes):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "hinge_line.toml"
    path.write_text(text.replace('speed = "15 rpm"', 'speed = "1 rpm"'), encoding="utf-8")
    return study.load(path)


OTHER = """
joint.pin = { d = "16 mm", l = "32 mm" }
joint.contact = { D_P = "16 mm", clearance = "0.05 mm", k1u = "0 N/m^2", k2u = "1.5e8 N/m" }
"""


@pytest.mark.parametrize("middle", ["", OTHER])
def test_hinges_carry_what_a_beam_on_springs_with_gaps_does(tmp_path: Path, middle: str) -> None:
    """The lower hinge carries the weight, too, and each its pin; two hinges alone carry W b/h each.

    All hinges are alike, or the middle one has a thicker, longer pin, more clearance, and a softer contact.
    """
    one = of_study(
        tmp_path, ('faces = "none"\n\n[mechanism.pair.upper]', f'faces = "none"{middle}\n\n[mechanism.pair.upper]')
    )
    flap = one.operation.linkage.member["flap"]
    each = joints.joints_of(one.joint, one.operation)
    off = np.array([-0.2, -0.06, 0.0, 0.02, 0.07, 0.15]) * 1e-3
    errors = joints.nominal_errors(len(off), one.mechanism)
    errors["middle_eye.offset_z"] = off  # along the line from the hinges to the mass centre
    params = joints.perturb(one.joint, one.operation, errors)
    result = simulate_rows(params, Options(), mechanism=one.mechanism).results
    assert np.isin(result["status"], [Status.OK, Status.STATIONARY]).all()
    springs = np.array([(joint.k_cross[1], joint.contact.k2u, joint.k_fork[2]) for joint in each])
    k, gap = 1.0 / (1.0 / springs).sum(axis=1), np.array([joint.contact.clearance for joint in each])
    assert (len(set(k)), len(set(gap))) == ((2, 2) if middle else (1, 1))
    moment, weight = -9.81 * flap.mass * flap.centre[0], 9.81 * (flap.mass + sum(joint.arm.mass for joint in each))
    pins = [i for i, bushing in enumerate(one.mechanism.bushings) if bushing.name.endswith("_pin")]
    for row, at in zip(result, off, strict=True):
        across = beam(np.array([0.0, at, 0.0]), gap, k, moment)
        expected = np.hypot(across, 9.81 * np.array([joint.pin.mass for joint in each]) + [weight, 0.0, 0.0])
        np.testing.assert_allclose(row["F_max"][pins], expected, rtol=0, atol=1e-3 * expected.max())
    alone = np.abs(beam(np.zeros(3), gap, k, moment))
    np.testing.assert_allclose(alone, [-moment / 0.6, 0.0, -moment / 0.6], atol=1e-9)


@pytest.mark.parametrize("turns", [False, True])
def test_a_force_on_the_flap_does_what_statics_say(tmp_path: Path, turns: bool) -> None:
    """90 N across the flap and 120 N down, 250 mm from the axis, without weight.

    Holes are round: the pins of the outer hinges, which take the moment, too, meet them aslant, and the middle one
    bears nothing. The drive takes the moment of the force across: a constant one if it turns with the flap, else with
    the cosine of its angle, and at 90 degrees both forces of the upper hinge add up.
    """
    section = f"""[mechanism.force.wind]
member = "flap"
point = ["250 mm", "0 mm", "0 mm"]
force = ["0 N", "90 N", "-120 N"]
turns = {str(turns).lower()}

[operation]"""
    one = of_study(tmp_path, ("down = [0, 0, -1]\n", ""), ("[operation]", section))
    params = joints.perturb(one.joint, one.operation, joints.nominal_errors(1, one.mechanism))
    (result,) = simulate_rows(params, Options(), mechanism=one.mechanism).results
    assert result["status"] in (Status.OK, Status.STATIONARY)
    places = [bushing.name for bushing in one.mechanism.bushings]
    forces, torques = (dict(zip(places, result[name], strict=True)) for name in ("F_max", "T_max"))
    moment, least = 120 * 0.25 / 0.6, result["T_range"][places.index("flap_drive")]
    aslant = np.hypot(45, moment)
    assert forces["lower_pin"] == pytest.approx(np.hypot(aslant, 120), rel=2e-3)
    assert forces["upper_pin"] == pytest.approx(aslant if turns else 45 + moment, rel=2e-3)
    assert forces["middle_pin"] < 1
    assert torques["flap_drive"] == pytest.approx(90 * 0.25, rel=1e-3)
    assert least == pytest.approx(0.0 if turns else 90 * 0.25, abs=0.1)
