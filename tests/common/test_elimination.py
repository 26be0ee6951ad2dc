"""Plans of elimination: what they name exists and is in its place, and a system is solved by following them."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.graphs import GRAPHS, Graph, solve, system

EACH = pytest.mark.parametrize("graph", GRAPHS.values(), ids=GRAPHS)


@EACH
def test_every_lump_is_eliminated_once_and_after_those_that_come_first(graph: Graph) -> None:
    order = graph.plan()["step_lump"].tolist()
    assert sorted(order) == list(range(graph.lumps))
    for one, other in graph.edges:
        assert order.index(one) < order.index(other)


@EACH
def test_blocks_are_those_between_a_lump_and_what_follows(graph: Graph) -> None:
    """Given ones with rows of what goes first; one more for each two lumps that elimination joins; none is unused."""
    plan = graph.plan()
    order, number = plan["step_lump"].tolist(), dict(graph.edges)
    for step, lump in enumerate(order):
        first, last = plan["step_first"][step : step + 2]
        following = plan["following"][first:last].tolist()
        assert following == sorted(following, key=order.index)
        for y in range(first, last):
            other = int(plan["following"][y])
            assert order.index(other) > step
            assert number[lump, other] == plan["between"][y]
            targets = plan["target"][slice(*plan["target_first"][y : y + 2])].tolist()
            for one, target in zip(following, targets, strict=False):
                assert number.setdefault((one, other), target) == target
            assert len(targets) == y - first
    assert sorted(number.values()) == list(range(graph.lumps, graph.blocks()))


@EACH
def test_columns_are_those_of_the_lump_and_of_lumps_eliminated_before_it(graph: Graph) -> None:
    plan, joined = graph.plan(), set(graph.borders)
    for step, lump in enumerate(plan["step_lump"].tolist()):
        columns = plan["column"][slice(*plan["column_first"][step : step + 2])].tolist()
        assert columns == sorted(u for u, at in joined if at == lump)
        for other in plan["following"][slice(*plan["step_first"][step : step + 2])].tolist():
            joined |= {(u, other) for u in columns}
    assert {(u, lump) for u, lump in plan["filled"].tolist()} == joined - set(graph.borders)


@EACH
@pytest.mark.parametrize("seed", range(3))
def test_a_system_is_solved_by_following_the_plan(graph: Graph, seed: int) -> None:
    matrix, right = system(graph, seed)
    np.testing.assert_allclose(solve(graph, matrix, right), np.linalg.solve(matrix, right), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize(("name", "filled"), [("cardan", 0), ("free tube", 6), ("ring", 3)])
def test_few_blocks_are_filled_in(name: str, filled: int) -> None:
    """Nothing of a tree. Of a tube, two pins and the hub of each joint; of a ring of n lumps n - 3, which is least."""
    graph = GRAPHS[name]
    assert graph.blocks() == graph.lumps + len(graph.edges) + filled
