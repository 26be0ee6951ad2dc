"""How far the numerical error of the loads moves the probability of a rare load."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import accuracy
from tolstat.common.loads import LOADS, Limit
from tolstat.common.tables import VALID
from tolstat.store import ResultFile, verification


def factors(path: Path, limit: Limit, last: NDArray[np.intp]) -> tuple[float, float] | None:
    """Factors on both ends of the interval of a probability.

    Parameters
    ----------
    path : Path
        Result file of a subset simulation.
    limit : Limit
        The limit.
    last : ndarray of int, shape (n,)
        File slots of the states of its last level.

    Returns
    -------
    tuple of float or None
        Share of the last level above the limit with the loads corrected by what verified joints near it lack, over the
        share as simulated: least and largest, 1 included. None with fewer than `accuracy.LEAST_NEAR` such joints.
    """
    with ResultFile.open(path) as store:
        near = verification.read(store, verification.NEAR)
        if near is None:
            return None
        results = store.results()
    checks = {name: check.results for name, check in near.checks.items()}
    lacking, own = accuracy.corrections(near.base, checks), results[last]
    valid = np.isin(results["status"], VALID)
    ends: list[list[NDArray[np.float64]]] = [[], [], []]
    for name, level in zip(limit.loads, limit.levels, strict=True):
        load = LOADS[name]
        distance = np.where(valid, np.abs(load.of(results) - level), np.inf)
        nearest = np.argsort(distance, kind="stable")[: 2 * accuracy.LEAST_NEAR]
        found = lacking[np.isin(near.rows, nearest), accuracy.OBSERVABLES.index(name)]
        found = found[np.isfinite(found)]
        if found.size < accuracy.LEAST_NEAR:
            return None
        values = np.where(np.isin(own["status"], VALID), load.of(own), -np.inf)
        low, high = accuracy.corrected(values, np.nan_to_num(accuracy.size(own, load.kind)), found)
        for end, loads in zip(ends, (values, low, high), strict=True):
            end.append(loads / level)
    plain, *moved = (float((np.maximum.reduce(end) > 1.0).mean()) for end in ends)
    shares = [share / plain for share in moved] if plain else [1.0]
    return min(1.0, *shares), max(1.0, *shares)
