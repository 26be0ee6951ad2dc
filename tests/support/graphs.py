"""Linear systems with the structure of a mechanism: graphs of lumps, random matrices, elimination by a plan."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.support.mechanisms import body
from tolstat.common import elimination
from tolstat.common.cardan import CARDAN

Array = NDArray[np.float64]


class Graph(NamedTuple):
    """What `elimination.plan` is called with, and the number of unknowns of the border."""

    lumps: int
    edges: dict[tuple[int, int], int]
    borders: list[tuple[int, int]]
    unknowns: int

    def plan(self) -> dict[str, NDArray[np.int64]]:
        """Plan of the elimination."""
        return elimination.plan(self.lumps, self.edges, self.borders)

    def blocks(self) -> int:
        """Number of blocks of the plan."""
        plan = self.plan()
        return 1 + int(max([self.lumps - 1 + len(self.edges), *plan["between"], *plan["target"]]))


def numbered(lumps: int, pairs: list[tuple[int, int]], borders: list[tuple[int, int]], unknowns: int) -> Graph:
    """Graph with blocks in the order of `pairs`."""
    return Graph(lumps, {pair: lumps + i for i, pair in enumerate(pairs)}, borders, unknowns)


def of_joint(first: int, base: dict[str, int | None]) -> tuple[list[tuple[int, int]], list[int]]:
    """Edges of a Cardan joint whose lumps begin at `first`; arms on the lump that is `base` of their shaft.

    Returns the arms on shafts without a lump, too.
    """
    pairs = [(first + body(pair.hole), first + body(pair.pin)) for pair in CARDAN.pairs]
    free = []
    for bushing in CARDAN.bushings:
        lump, on = first + body(bushing.lump), first + body(bushing.base)
        if bushing.base in base:
            on_shaft = base[bushing.base]
            if on_shaft is None:
                free.append(lump)
            else:
                pairs.append((lump, on_shaft))
        else:
            pairs.append((lump, on))
    return pairs, free


def cardan() -> Graph:
    """A Cardan joint: the border is psi and s of its output shaft."""
    pairs, _ = of_joint(0, {"input": None, "output": None})
    arms = [body("hole3"), body("hole4")]
    return numbered(len(CARDAN.lumps), pairs, [(u, arm) for u in (0, 1) for arm in arms], 2)


def free_tube() -> Graph:
    """Two Cardan joints on a tube that is a lump; the border is psi of the output shaft."""
    n = len(CARDAN.lumps)
    first, _ = of_joint(0, {"input": None, "output": 2 * n})
    second, arms = of_joint(n, {"input": 2 * n, "output": None})
    return numbered(2 * n + 1, first + second, [(0, arm) for arm in arms], 1)


def ring(n: int) -> Graph:
    """Lumps in a ring, which needs n - 3 blocks more; the border joins the first lump only, and the last."""
    return numbered(n, [(i, i + 1) for i in range(n - 1)] + [(0, n - 1)], [(0, 0), (1, n - 1)], 2)


def scattered(seed: int) -> Graph:
    """Lumps joined at random, all of them connected."""
    rng = np.random.default_rng(seed)
    n, unknowns = int(rng.integers(2, 12)), int(rng.integers(0, 4))
    place = rng.permutation(n)
    pairs = {(int(rng.integers(0, i)), i) for i in range(1, n)}
    pairs |= {(int(min(pair)), int(max(pair))) for pair in rng.integers(0, n, (n, 2)) if pair[0] != pair[1]}
    named = [(int(place[one]), int(place[other])) for one, other in sorted(pairs)]
    borders = [(u, lump) for u in range(unknowns) for lump in range(n) if rng.random() < 0.3]
    return numbered(n, named, borders, unknowns)


GRAPHS = {"cardan": cardan(), "free tube": free_tube(), "ring": ring(6)} | {
    f"scattered {seed}": scattered(seed) for seed in range(20)
}


def system(graph: Graph, seed: int) -> tuple[Array, Array]:
    """Symmetric positive definite matrix with the structure of a graph, and a right-hand side."""
    rng, n = np.random.default_rng(seed), 6 * graph.lumps + graph.unknowns
    matrix = np.diag(rng.uniform(1.0, 2.0, n))
    joined = [[*range(6 * i, 6 * i + 6), *range(6 * k, 6 * k + 6)] for i, k in graph.edges]
    joined += [[*range(6 * lump, 6 * lump + 6), 6 * graph.lumps + u] for u, lump in graph.borders]
    for rows in joined:
        half = rng.normal(size=(len(rows), len(rows)))
        matrix[np.ix_(rows, rows)] += half @ half.T
    if graph.unknowns > 1:
        matrix[-1, -2] = matrix[-2, -1] = 0.3
    return matrix, rng.normal(size=n)


def put_system(graph: Graph, matrix: Array, block: Array, edge: Array, corner: Array) -> None:
    """Write a matrix as kernels hold it; NaN where nothing is stored, 0 in blocks that are filled in."""
    six = [slice(6 * lump, 6 * lump + 6) for lump in range(graph.lumps)]
    block[:], edge[:] = 0.0, np.nan
    for lump, rows in enumerate(six):
        block[lump] = matrix[rows, rows]
        block[lump][np.tril_indices(6, -1)] = np.nan
    for (one, other), number in graph.edges.items():
        block[number] = matrix[six[one], six[other]]
    for u, lump in graph.borders:
        edge[u, lump] = matrix[six[lump], 6 * graph.lumps + u]
    corner[:] = matrix[6 * graph.lumps :, 6 * graph.lumps :]
    corner[np.tril_indices(graph.unknowns, -1)] = np.nan


def solve(graph: Graph, matrix: Array, right: Array) -> Array:
    """Solve a system by the plan of its graph, plainly: step by step, nothing but what the plan names."""
    plan, n, u = graph.plan(), graph.lumps, graph.unknowns
    block, edge, corner = np.empty((graph.blocks(), 6, 6)), np.empty((u, n, 6)), np.empty((u, u))
    put_system(graph, matrix, block, edge, corner)
    block[:n] = np.triu(block[:n]) + np.triu(block[:n], 1).swapaxes(1, 2)
    corner = np.triu(corner) + np.triu(corner, 1).T
    for unknown, lump in plan["filled"]:
        edge[unknown, lump] = 0.0
    x, of_border = right[: 6 * n].reshape(n, 6).copy(), right[6 * n :].copy()
    steps = []
    for step, lump in enumerate(plan["step_lump"]):
        first, last = plan["step_first"][step : step + 2]
        columns = plan["column"][slice(*plan["column_first"][step : step + 2])]
        inverse = np.linalg.inv(block[lump])
        steps.append((lump, inverse, range(first, last), columns))
        for y in range(first, last):
            beside, following = block[plan["between"][y]], plan["following"][y]
            block[following] -= beside.T @ inverse @ beside
            for z, target in enumerate(plan["target"][slice(*plan["target_first"][y : y + 2])]):
                block[target] -= block[plan["between"][first + z]].T @ inverse @ beside
            x[following] -= beside.T @ inverse @ x[lump]
            for c in columns:
                edge[c, following] -= beside.T @ inverse @ edge[c, lump]
        for c in columns:
            of_border[c] -= edge[c, lump] @ inverse @ x[lump]
            for other in columns:
                corner[c, other] -= edge[c, lump] @ inverse @ edge[other, lump]
    of_border = np.linalg.solve(corner, of_border) if u else of_border
    for lump, inverse, between, columns in reversed(steps):
        for y in between:
            x[lump] -= block[plan["between"][y]] @ x[plan["following"][y]]
        for c in columns:
            x[lump] -= of_border[c] * edge[c, lump]
        x[lump] = inverse @ x[lump]
    return np.concatenate([x.ravel(), of_border])
