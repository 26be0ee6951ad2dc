"""Energy balance of settled linkages: what drive and loads give over a period, friction and dampers take."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import dissipation, linkages
from tolstat.common import tables
from tolstat.common.tables import Options, Status
from tolstat.solver.simulation import simulate_together

pytestmark = pytest.mark.slow  # compiles the kernels for another mechanism
STEPS = 720


@pytest.mark.parametrize(("name", "every"), [("fourbar", 4), ("fourbar_tilt", 1), ("cranks", 2)])
def test_what_drive_and_loads_give_is_lost(name: str, every: int) -> None:
    """To 1e-4 of the loss by friction and 1e-6 of the larger power; where a pin is tilted peaks want every angle."""
    mechanism = linkages.mechanism_of(name)
    rows, result = linkages.parameters(name, mechanism), np.zeros(1, tables.tables(mechanism).RESULT)
    options, allowed = Options(steps_per_rev=STEPS, max_refinements=0, settle_tol=1e-5), np.full(1, 2**30)
    ((_, samples),) = simulate_together(rows, options, allowed, True, result, mechanism=mechanism)
    assert result["status"][0] == Status.OK
    period = 2.0 * np.pi / abs(rows[0].omega)
    found = [
        dissipation.powers(period * k / STEPS, samples[k].q, samples[k].v, rows[0], mechanism)
        for k in range(0, STEPS, every)
    ]
    mean = dissipation.Powers(*np.mean(found, axis=0))
    assert mean.friction == pytest.approx(result["loss_max"].ravel()[-1], rel=1e-4)
    left = mean.drive + mean.applied - mean.friction - mean.damping
    assert abs(left) < 1e-4 * mean.friction + 1e-6 * max(abs(mean.drive), abs(mean.applied))
