"""Elastic force of a station: slope by differences, inverse by scipy, and which joints have a force at all."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.conftest import with_law
from tolstat.joint.contact import LAWS
from tolstat.kernel.mechanics.spring import elastic, has_needles, penetration
from tolstat.kernel.revolution.outcome import inside_model


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("clearance", [0.0, 1e-6, 1e-4])
def test_slope_and_inverse(params, law, clearance):
    par = with_law(params(), law)[0]
    for j in range(par.n_stations[0]):
        for delta in np.geomspace(1e-10, 1e-3, 15):
            force, slope = elastic(0, j, delta, clearance, has_needles(0, par), par)
            h = 1e-5 * delta
            ends = [elastic(0, j, delta + s * h, clearance, has_needles(0, par), par)[0] for s in (1, -1)]
            assert slope == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-8)
            assert penetration(force, 0, j, clearance, par) == pytest.approx(delta, rel=1e-10)


@pytest.mark.parametrize("clearance", [0.0, 1e-5])
def test_inverse_of_needles_beside_other_springs(params, clearance):
    """No law has both, but the inverse holds for them."""
    par = with_law(params(), "needles")[0]
    par.station_k1[0, 0], par.station_k2[0, 0] = 1e12, 1e8
    for force in (1e-3, 1.0, 1e5):
        found = brentq(
            lambda d, force=force: elastic(0, 0, d, clearance, True, par)[0] - force, 1e-15, 1.0, xtol=1e-18, rtol=1e-13
        )
        assert penetration(force, 0, 0, clearance, par) == pytest.approx(found, rel=1e-9)


def test_no_load_and_no_stiffness_need_no_penetration(params):
    par = with_law(params(), "needles")[0]
    assert penetration(0.0, 0, 0, 1e-5, par) == 0.0
    par.station_k3[0, 0] = 0.0
    assert penetration(100.0, 0, 0, 1e-5, par) == 0.0


@pytest.mark.parametrize(
    ("name", "value", "inside"),
    [
        ("station_k3", 0.0, False),
        ("station_k3", -1.0, False),
        ("station_k3", np.nan, False),
        ("needle_b", -1.0, False),
        ("needle_b", np.nan, False),
        ("needle_b", 0.0, False),
    ],
)
def test_needles_of_a_joint_inside_the_model(params, name, value, inside):
    par = with_law(params(), "needles")[0]
    assert inside_model(par)
    par[name] = value
    assert inside_model(par) == inside
