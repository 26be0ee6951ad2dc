"""Linkages from a study, simulated, against the reference: all loads within a thousandth, the loss as well."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import linkages
from tolstat.common.tables import Options, Status
from tolstat.solver.simulation import simulate_rows

pytestmark = pytest.mark.slow  # compiles the kernels for another mechanism


@pytest.mark.parametrize("name", ["hinge", "hinge_middle", "fourbar", "fourbar_tilt"])
def test_largest_loads_and_loss_are_those_of_the_reference(name: str) -> None:
    mechanism, of = linkages.mechanism_of(name), linkages.reference(name)
    result = simulate_rows(linkages.parameters(name, mechanism), Options(), mechanism=mechanism).results[0]
    assert result["status"] == Status.OK
    bushings = [i for i, bushing in enumerate(mechanism.bushings) if bushing.group != "drive"]
    order = [list(of["names"]).index(linkages.name_in_reference(mechanism.bushings[i].name)) for i in bushings]
    for kind in ("F", "T"):
        expected = of[f"{kind}_max"][order]
        np.testing.assert_allclose(result[f"{kind}_max"][bushings], expected, rtol=0, atol=1e-3 * expected.max())
    # peaks of thrust faces lie between the reference's angles
    np.testing.assert_allclose(result["thrust_max"], of["thrust_max"].ravel(), rtol=0, atol=1e-2 * of["F_max"].max())
    if mechanism.friction:
        assert result["loss_max"][-1] == pytest.approx(of["loss"], rel=1e-3)
