"""Histories of settled linkages beside Radau's method on the slow twin, which shares no equations with the kernel.

The twin takes some ten seconds for a degree of the crank, of three cranks minutes, so that each linkage is followed for
a short way only.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import linkages, naive
from tolstat.common import tables
from tolstat.common.tables import SIMULATED, Options
from tolstat.solver.simulation import simulate_together

pytestmark = pytest.mark.slow  # compiles the kernels for another mechanism


@pytest.mark.parametrize(
    ("name", "steps", "degrees", "of_torque"),
    [
        ("hinge_middle", 5760, 2.0, 3e-3),
        ("fourbar", 2880, 2.0, 1e-3),
        ("fourbar_tilt", 2880, 2.0, 1e-3),
        ("bennett", 11520, 2.0, 1e-3),
        ("cranks", 5760, 0.25, 1e-3),
    ],
)
def test_loads_are_those_of_another_integrator(name: str, steps: int, degrees: float, of_torque: float) -> None:
    """Elastic loads of all bushings, to 1e-3 of the largest force; torques of the flap ring by 1e-3."""
    mechanism, of = linkages.mechanism_of(name), linkages.reference(name)
    rows, result = linkages.parameters(name, mechanism), np.zeros(1, tables.tables(mechanism).RESULT)
    options, allowed = Options(steps_per_rev=steps, max_refinements=0), np.full(1, 2**30)
    ((_, samples),) = simulate_together(rows, options, allowed, True, result, mechanism=mechanism)
    assert result["status"][0] in SIMULATED
    first = round(100.0 * steps / 360.0)
    ours, second = first + np.linspace(0, degrees * steps / 360.0, 3).astype(int), 2.0 * np.pi / (rows[0].omega * steps)

    def loads(k: int, q: np.ndarray) -> np.ndarray:
        return naive.forces(second * k, q, 0.0 * q, rows[0], mechanism).bushing

    begin = samples[first]
    found = naive.follow(second * first, begin.q, begin.v, second * ours[1:], rows[0], mechanism, rtol=1e-5)
    sizes = np.repeat([of["F_max"].max(), of["T_max"].max()], 3)
    for k, q in zip(ours[1:], found, strict=True):
        off = np.abs((loads(k, q) - loads(k, samples[k].q)) / sizes)
        assert off[:, :3].max() < 1e-3
        assert off[:, 3:].max() < of_torque
    moved = np.abs((loads(ours[-1], samples[ours[-1]].q) - loads(first, begin.q)) / sizes).max()
    assert moved > 3e-3, "the test wants loads that change"
