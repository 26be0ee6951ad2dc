"""A coupling rod on three cranks of the study against the statics of a rigid plate on elastic pins, at each angle."""

from __future__ import annotations

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
STUDY = Path(__file__).parents[2] / "studies" / "parallel_cranks.toml"
CENTRES = np.array([(0.0, 0.0), (0.4, 0.0), (0.2, 0.3)])
"""Axes of the cranks, m; eyes of the plate lie alike."""
RADIUS = 0.06
SIDES = ("plate1", "plate2", "plate3")


def pin_forces(joint: joints.Joint, torque: float, errors: dict[str, tuple[float, float]]) -> Array:
    """Largest force of each pin of the plate over a revolution, N.

    Cranks 2 and 3 give way about their axes: along the crank the compliances of both its pins are in series, across it
    crank 2 has the force T/r and crank 3 none. `errors`: of the pins along and across their cranks, m.
    """
    of_pin = 1.0 / joint.k_cross[1] + 1.0 / joint.contact.k2u
    of_eye = np.diag(1.0 / joint.k_fork[[1, 2]])
    largest = np.zeros(3)
    for theta in np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False):
        along, across = np.array([np.cos(theta), np.sin(theta)]), np.array([-np.sin(theta), np.cos(theta)])
        turned = np.column_stack([along, across])
        own = of_pin * np.eye(2) + of_eye
        series = own + of_pin * np.eye(2) + turned @ of_eye @ turned.T
        off = [turned @ errors.get(name, (0.0, 0.0)) for name in SIDES]
        arm = [np.array([[1.0, 0.0, -y], [0.0, 1.0, x]]) for x, y in CENTRES]
        # unknowns: shift and turn of the plate, force of pin 1, forces along cranks 2 and 3
        push = np.array([0.0, -torque / RADIUS, 0.0])
        spread = [np.vstack([np.eye(2), np.zeros((2, 2))]).T, *(np.zeros((2, 4)) for _ in range(2))]
        for i in (1, 2):
            spread[i][:, 1 + i] = along
        force = [np.hstack([np.zeros((2, 3)), spread[i]]) for i in range(3)]
        matrix = [np.hstack([arm[0], np.zeros((2, 4))]) + own @ force[0]]
        right = [off[0]]
        for i in (1, 2):
            matrix.append((along @ (np.hstack([arm[i], np.zeros((2, 4))]) + series @ force[i]))[None])
            right.append([along @ (off[i] - series @ across * push[i])])
        matrix.append(sum(arm[i].T @ force[i] for i in range(3)))
        right.append(-sum(arm[i].T @ across * push[i] for i in range(3)))
        found = np.linalg.solve(np.vstack(matrix), np.concatenate(right))
        forces = [force[i] @ found + across * push[i] for i in range(3)]
        largest = np.maximum(largest, np.linalg.norm(forces, axis=1))
    return largest


def of_study(tmp_path: Path) -> study.Study:
    """The study with hardly any friction, without weight, slow enough for statics, with linear contacts."""
    text = STUDY.read_text(encoding="utf-8")
    contact = '{ law = "uniform", k1u = "0 N/m^2", k2u = "2e8 N/m", H = 4, clearance = "0 mm" }'
    for old, new in (
        ('{ clearance = "0 mm" }', f"{contact}\nfriction = {{ mu = 0.0002 }}"),
        ("down = [0, -1, 0]\n", ""),
        ('speed = "60 rpm"', 'speed = "20 rpm"'),
        ('mass = "12 kg"', 'mass = "0.5 kg"'),
    ):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / STUDY.name
    path.write_text(text, encoding="utf-8")
    return study.load(path)


def test_pins_carry_what_a_plate_on_elastic_pins_does(tmp_path: Path) -> None:
    one = of_study(tmp_path)
    every: list[dict[str, tuple[float, float]]] = [
        {},
        {"plate2": (5e-5, 0.0)},
        {"plate2": (0.0, 5e-5)},
        {"plate1": (2e-5, -3e-5), "plate3": (-4e-5, 1e-5)},
    ]
    errors = joints.nominal_errors(len(every), one.mechanism)
    for i, of in enumerate(every):
        for name, (along, across) in of.items():
            errors[f"{name}_pin.offset_t"][i], errors[f"{name}_pin.offset_z"][i] = along, across
    params = joints.perturb(one.joint, one.operation, errors)
    result = simulate_rows(params, Options(), mechanism=one.mechanism).results
    assert np.isin(result["status"], [Status.OK, Status.STATIONARY]).all()
    pins = [[bushing.name for bushing in one.mechanism.bushings].index(f"{name}_pin") for name in SIDES]
    for row, of in zip(result, every, strict=True):
        expected = pin_forces(one.joint, one.operation.torque, of)
        np.testing.assert_allclose(row["F_max"][pins], expected, rtol=0, atol=1e-3 * expected.max())
