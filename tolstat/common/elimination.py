"""Order in which the unknowns of a mechanism are eliminated, and what each elimination changes.

Lumps have six unknowns each and are joined by contacts and bushings; the few unknowns of shafts, the border, are joined
to many lumps and come last. The lump with the fewest neighbours is eliminated next (minimum degree; Tinney, Walker
1967, Proc. IEEE 55): of a tree nothing is filled in.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]


def plan(lumps: int, edges: Mapping[tuple[int, int], int], borders: Iterable[tuple[int, int]]) -> dict[str, Integers]:
    """Plan of the elimination.

    Parameters
    ----------
    lumps : int
        Number of lumps.
    edges : mapping
        Lumps that are joined, the one to be eliminated first before the other, and the number of their block. Of
        several lumps with as few neighbours, the one of the first edge comes first.
    borders : iterable
        Unknowns of the border and the lumps that are joined to them.

    Returns
    -------
    dict of str to ndarray of int
        ``step_lump``: (n,) lump of each step. ``step_first``: (n + 1,) first entry of each step in the next two.
        ``between``: (m,) block with rows of the lump and columns of ``following``, (m,), a lump of a later step.
        ``target_first``: (m + 1,) first entry of each of these in ``target``, the blocks that join ``following`` to
        those before it in its step. ``column_first``: (n + 1,) first entry of each step in ``column``, the unknowns of
        the border that the lump is joined to by then. ``filled``: (f, 2) unknown and lump joined by elimination only.
    """
    number = dict(edges) | {pair[::-1]: block for pair, block in edges.items()}
    columns: list[set[int]] = [{u for u, at in borders if at == lump} for lump in range(lumps)]
    joined = [set(one) for one in columns]
    order, followers = _eliminate(lumps, edges, number, columns)
    place = {lump: step for step, lump in enumerate(order)}
    first, between, following, target_first, target, column_first, column = [0], [], [], [0], [], [0], []
    for lump in order:
        later = sorted(followers[lump], key=place.__getitem__)
        for i, other in enumerate(later):
            between.append(number[lump, other])
            following.append(other)
            target += [number[one, other] for one in later[:i]]
            target_first.append(len(target))
        first.append(len(between))
        column += sorted(columns[lump])
        column_first.append(len(column))
    filled = [(u, lump) for lump in range(lumps) for u in sorted(columns[lump] - joined[lump])]
    found = {
        "step_lump": order,
        "step_first": first,
        "between": between,
        "following": following,
        "target_first": target_first,
        "target": target,
        "column_first": column_first,
        "column": column,
    }
    return {name: np.array(values, np.int64) for name, values in found.items()} | {
        "filled": np.array(filled, np.int64).reshape(-1, 2)
    }


def _eliminate(
    lumps: int, edges: Iterable[tuple[int, int]], number: dict[tuple[int, int], int], columns: list[set[int]]
) -> tuple[list[int], list[set[int]]]:
    """Order of the lumps, and the lumps that follow each; blocks and columns that are filled in are added."""
    rank = {lump: i for i, lump in reversed([*enumerate(lump for edge in edges for lump in edge)])}
    near: list[set[int]] = [set() for _ in range(lumps)]
    before: list[set[int]] = [set() for _ in range(lumps)]
    for one, other in edges:
        near[one].add(other)
        near[other].add(one)
        before[other].add(one)
    order: list[int] = []
    followers: list[set[int]] = [set() for _ in range(lumps)]
    left = set(range(lumps))
    while left:
        ready = [lump for lump in left if not before[lump] & left]
        lump = min(ready, key=lambda one: (len(near[one]), rank.get(one, len(number)), one))
        left.remove(lump)
        order.append(lump)
        followers[lump] = near[lump]
        for other in near[lump]:
            near[other].discard(lump)
            columns[other] |= columns[lump]
        for pair in combinations(sorted(near[lump]), 2):
            if pair[1] not in near[pair[0]]:
                near[pair[0]].add(pair[1])
                near[pair[1]].add(pair[0])
                number[pair] = number[pair[::-1]] = 1 + max(number.values())
    return order, followers
