"""Search and check of tolerances on laws with known answers."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from tests.support.lines import DRAWN, FACTORS, Lines
from tolstat.analysis import allocation
from tolstat.analysis.allocation import EXACT, Search
from tolstat.analysis.binomial import clopper_pearson

TARGET = 0.05
SEEDS = 80
TWO = Lines([1.0, 0.9, 0.01], 0.12)
"""Two lines that matter, and one that does not."""


def best(lines: Lines, target: float) -> float:
    """Cost of the cheapest design whose share is below the target, of all designs."""
    designs = product(range(len(FACTORS)), repeat=len(lines.drawn))
    return min(sum(1.0 / FACTORS[i] for i in design) for design in designs if lines.share(design) < target)


def test_a_proposal_that_is_said_to_hold_holds_over_seeds_and_that_of_its_own_joints_does_not() -> None:
    wrong, by_own = 0, 0
    near = Lines([1.0, 0.97, 0.95, 0.93, 0.9], 0.08)
    for seed in range(SEEDS):
        found = near.allocate(np.random.default_rng(seed), TARGET, most=2048)
        wrong += found.state == "holds" and near.share(found.search.design) >= TARGET
        problem = near.problem(np.random.default_rng(seed), TARGET, most=2048)
        greedy = Search(problem._replace(aims=np.array([0.0495])))  # the same joints search and judge
        share = greedy.above.mean()
        by_own += share < TARGET and near.share(greedy.design) >= TARGET
    assert wrong <= 0.05 * SEEDS
    assert by_own > 0.1 * SEEDS


def test_the_interval_of_the_check_covers_over_seeds() -> None:
    misses = 0
    for seed in range(SEEDS):
        found = TWO.allocate(np.random.default_rng(seed), TARGET, most=2048)
        designs = [found.search.path[look.after - 1].design for look in found.looks]
        shares = [TWO.share(design) for design in designs]
        misses += any(not (look.lower[0] <= p <= look.upper[0]) for look, p in zip(found.looks, shares, strict=True))
    assert misses <= 0.05 * SEEDS


def test_the_cost_is_near_that_of_the_best_design() -> None:
    costs = [TWO.allocate(np.random.default_rng(seed), TARGET) for seed in range(20)]
    assert all(found.state == "holds" for found in costs)
    excess = [found.search.path[-1].cost / best(TWO, TARGET) - 1.0 for found in costs]
    assert np.median(excess) < 0.05
    assert max(excess) < 0.2


def test_a_line_that_changes_nothing_is_never_narrowed_and_is_widened() -> None:
    search = Search(TWO.problem(np.random.default_rng(1), TARGET))
    assert 2 not in search.active
    assert search.design[2] == len(FACTORS) - 1
    assert [step.what for step in search.path[:2]] == ["as drawn", "all exact"]
    narrower = [step for step in search.path if step.what == "narrower"]
    assert {step.line for step in narrower} <= {0, 1}
    assert (np.diff([step.cost for step in narrower]) > 0.0).all()
    wider = [step for step in search.path if step.what == "wider"]
    assert (np.diff([step.cost for step in wider]) < 0.0).all()


def test_a_target_that_is_met_as_drawn_needs_no_exact_joints() -> None:
    search = Search(TWO.problem(np.random.default_rng(2), 0.3))
    assert search.path[0].what == "as drawn"
    assert all(step.what == "wider" for step in search.path[1:])
    assert TWO.share(search.design) < 0.3


def test_a_target_that_exact_lines_miss_is_impossible_after_one_simulation() -> None:
    problem, asked = TWO.problem(np.random.default_rng(3), TARGET), []
    always = np.random.default_rng(4).random((1024, 1)) < 0.2

    def above(designs):
        asked.extend(designs)
        return [problem.above([design])[0] | always for design in designs]

    found = allocation.allocate(problem._replace(above=above), lambda *_: None, [1024])
    assert (found.state, found.looks) == ("impossible", [])
    assert asked == [TWO.drawn, (EXACT,) * 3]


def test_where_all_lines_have_their_finest_step_it_says_so() -> None:
    problem = TWO.problem(np.random.default_rng(5), 1e-3)
    search = Search(problem._replace(costs=[costs[:] for costs in problem.costs], aims=np.array([0.0])))
    assert search.state == "exhausted" or TWO.share(search.design) < 1e-3


def test_joints_that_are_missing_leave_it_open_at_the_same_step() -> None:
    whole = Search(TWO.problem(np.random.default_rng(6), TARGET))
    for number in range(1, 5):
        problem, calls = TWO.problem(np.random.default_rng(6), TARGET), []

        def above(designs, problem=problem, calls=calls, number=number):
            calls.append(designs)
            return problem.above(designs) if len(calls) <= number else None

        search = Search(problem._replace(above=above))
        assert search.state == "open"
        assert [step.design for step in search.path] == [step.design for step in whole.path[: len(search.path)]]


def test_the_search_aims_below_the_target_so_that_a_check_confirms_it() -> None:
    n = 8192
    aim = allocation.aim(TARGET, n)
    counts = np.random.default_rng(7).binomial(n, aim, 20_000)
    upper = clopper_pearson(counts, n, allocation.LOOK_CONFIDENCE)[1]
    assert np.mean(upper < TARGET) == pytest.approx(0.9, abs=0.03)
    assert allocation.aim(1e-4, 1000) < 1e-3


def test_more_joints_for_a_smaller_target() -> None:
    assert allocation.sizes(np.array([0.05, 0.2]), 1 << 16) == [1024, 2048, 4096, 8192]
    assert allocation.sizes(np.array([0.001]), 1 << 16) == [65536]
    assert allocation.sizes(np.array([0.05]), 1500) == [1024, 1500]


def test_two_limits_are_kept_both() -> None:
    rng, level = np.random.default_rng(8), TWO.level
    scores = rng.standard_normal((2048, 3))

    def above(designs):
        return [np.column_stack([TWO.above(scores, d), TWO.above(1.2 * scores, d)]) for d in designs]

    problem = TWO.problem(rng, TARGET)._replace(
        above=above, targets=np.array([0.05, 0.05]), aims=np.array([0.04, 0.04])
    )
    search = Search(problem)
    assert (search.above.mean(axis=0) <= 0.04).all()
    assert search.design < (DRAWN,) * 3
    assert level > 0.0
