"""Two Cardan joints in series against the single joints, each with the other as its partner (docs/model.md)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.support.mechanisms import joined
from tolstat.common.cardan import SERIES
from tolstat.common.tables import Options, Status
from tolstat.joint import orders
from tolstat.solver.simulation import simulate_rows

pytestmark = pytest.mark.slow  # compiles the kernels for another mechanism
ANGLES, INERTIA, SLOW = (0.26, 0.2), 0.01, 50 * np.pi / 30


def partner(position: str, alpha: float) -> orders.Partner:
    """The other joint, its forks in phase: at equal misalignments the output turns evenly."""
    return orders.Partner.model_construct(position=position, alpha=alpha, inertia=INERTIA, offset=0.0)


@pytest.fixture(scope="module")
def both(params: Any, random_errors: Any) -> Any:
    """Results of the series, and of both joints each with its partner; of three pairs of joints."""
    series, alone = [], {}
    pairs = [
        [params(alpha=alpha, speed=SLOW, **random_errors(2 * seed + k)) for k, alpha in enumerate(ANGLES)]
        for seed in range(3)
    ]
    for first, second in pairs:
        second["Js"] = INERTIA
        series.append(joined(first[0], second[0], 0.5 * np.pi, INERTIA))
    for k, (position, alpha) in enumerate((("after", ANGLES[1]), ("before", ANGLES[0]))):
        rows = np.concatenate([pair[k] for pair in pairs])
        rows["Js"] = INERTIA
        orders.add_partner(partner(position, alpha), rows)
        alone[k] = simulate_rows(rows, Options()).results
    return simulate_rows(np.concatenate(series), Options(), mechanism=SERIES).results, alone


def test_each_joint_has_the_loads_that_it_has_with_a_partner(both: Any) -> None:
    """As far as Psi of each allows, which the closed form of a partner leaves out."""
    series, alone = both
    assert (series["status"] == Status.OK).all()
    for key in ("F", "T", "contact"):
        together = series[f"{key}_max"].reshape(3, 2, -1)
        for k in (0, 1):
            single = alone[k][f"{key}_max"].reshape(3, -1)
            assert (np.abs(together[:, k] - single).max(axis=1) < 1e-3 * single.max(axis=1)).all(), (key, k)


def test_the_output_turns_as_the_input_but_for_the_angles(both: Any) -> None:
    """Psi of the output is that of the whole series, below the sum of both joints' a thousandth each."""
    series, _ = both
    assert (series["psi_max"] < 2e-3).all()
    assert (series["psi_max"] > 0).all()
