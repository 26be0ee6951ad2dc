"""One budget of Newton iterations for a joint, over uniform steps and refinement."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import Params
from tolstat.common.tables import (
    FAILED,
    MAX_ITERATIONS,
    MOST_ITERATIONS,
    Options,
    Status,
    follows_error,
    iterations_allowed,
)
from tolstat.solver import simulation
from tolstat.solver.simulation import simulate_rows

FAST = Options(steps_per_rev=60, max_revs=4, max_refinements=0)


def allow(monkeypatch: pytest.MonkeyPatch, iterations: int) -> None:
    monkeypatch.setattr(simulation.tables, "iterations_allowed", lambda *_: iterations)


def test_a_budget_suffices_for_uniform_steps_twice_and_a_refinement() -> None:
    assert iterations_allowed(180, 20) == MOST_ITERATIONS + 2 * MAX_ITERATIONS * 180 * 20
    assert iterations_allowed(10**6, 10**6) == np.iinfo(np.int32).max


def test_a_joint_ends_where_its_budget_does(params: Params, monkeypatch: pytest.MonkeyPatch) -> None:
    table = np.concatenate([params(alpha=alpha) for alpha in (0.05, 0.2)])
    whole = simulate_rows(table, FAST).results
    few, many = whole["newton_iterations"].astype(int)
    assert few < many
    allow(monkeypatch, many)
    first, second = simulate_rows(table, FAST).results
    assert first.tobytes() == whole[0].tobytes()
    assert second["status"] == Status.NEWTON_FAILED
    assert second["newton_iterations"] == many
    assert 0 < second["failed_step"] <= 60 * FAST.max_revs
    assert np.isnan(second["F_max"]).all()
    allow(monkeypatch, many + 1)
    assert simulate_rows(table, FAST).results.tobytes() == whole.tobytes()


@pytest.mark.parametrize("iterations", [1, 40])
def test_a_budget_may_end_in_the_search_for_equilibrium(
    params: Params, monkeypatch: pytest.MonkeyPatch, iterations: int
) -> None:
    allow(monkeypatch, iterations)
    found = simulate_rows(np.concatenate([params(alpha=0.2), params(pin1__clearance=-1.0)]), FAST).results
    assert found["status"].tolist() == [Status.NEWTON_FAILED, Status.OUTSIDE_MODEL]
    assert found["newton_iterations"].tolist() == [iterations, 0]


@pytest.mark.slow
def test_a_refinement_takes_what_is_left(params: Params, monkeypatch: pytest.MonkeyPatch) -> None:
    """A joint that rattles: a budget that would do for the finer steps does not do after the uniform ones."""
    options = Options(max_revs=4)
    table = params(alpha=np.radians(15), speed=3000 * np.pi / 30, torque=20.0)
    uniform = int(simulate_rows(table, options._replace(max_refinements=0)).results["newton_iterations"][0])
    spent: list[int] = []
    together = simulation.simulate_together

    def counted(joints, settings, left, *others):
        before = int(left[0])
        yield from together(joints, settings, left, *others)
        if follows_error(settings):
            spent.append(before - int(left[0]))

    monkeypatch.setattr(simulation, "simulate_together", counted)
    whole = simulate_rows(table, options).results
    needed = uniform + sum(spent)
    assert needed > 3 * uniform
    allow(monkeypatch, needed - uniform // 2)
    assert simulate_rows(table, options).results[0]["status"] in (Status.NOT_RESOLVED, *FAILED)
    allow(monkeypatch, needed + 1)
    assert simulate_rows(table, options).results.tobytes() == whole.tobytes()
