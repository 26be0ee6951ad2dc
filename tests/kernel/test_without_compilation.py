"""The kernel in plain Python: the lane engine with lanes of width 1, the same source as the compiled one."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

SIMULATE = """
import json, sys
from tolstat.common.cardan import CARDAN
from tolstat import joint
from tolstat.common.tables import Options
from tolstat.solver import simulation
operation = joint.Operation.model_construct(alpha=0.3, speed=50.0, torque=100.0)
errors = joint.nominal_errors(1, CARDAN)
errors["pin1.offset_t"] = 2e-5
par = joint.perturb(joint.load("cirelli2021", {}, "test", None), operation, errors)
coarse = Options(steps_per_rev=24, max_revs=2, max_refinements=0, peak_substeps=2)
results = simulation.simulate_rows(par, coarse._replace(**json.loads(sys.argv[1]))).results
print(json.dumps([results["F_max"][0].tolist(), int(results["newton_iterations"][0]), int(results["status"][0])]))
"""


def simulated(settings: dict[str, int], **environment: str) -> tuple[list[float], int, int]:
    """Largest forces (N), Newton iterations and status of a joint in a process of its own."""
    command = [sys.executable, "-c", SIMULATE, json.dumps(settings)]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | environment, check=False)
    assert done.returncode == 0, done.stderr
    force, iterations, status = json.loads(done.stdout)
    return force, iterations, status


@pytest.mark.slow
@pytest.mark.parametrize("settings", [{}, {"method": 1}, {"fidelity": 1}, {"fidelity": 2}])
def test_a_joint_is_the_same_without_compilation(settings: dict[str, int]) -> None:
    """BDF2 with a closer look, TR-BDF2, equilibria, closed forms; fused multiply-adds may round otherwise."""
    plain, compiled = simulated(settings, NUMBA_DISABLE_JIT="1"), simulated(settings)
    assert plain[2] == compiled[2]
    assert plain[1] == pytest.approx(compiled[1], rel=0.03)  # single precision rounds otherwise, too
    np.testing.assert_allclose(plain[0], compiled[0], rtol=1e-7)
