"""Points of a work-precision diagram: errors against the truth, medians over joints, and what a given error costs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from studies.precision.runs import TRUTH, Run
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import Fault, InputError
from tolstat.common.load_kinds import kinds, measure_of, spans
from tolstat.solver.reference import Largest

SPAN = spans(CARDAN)
KINDS = ("loads", *SPAN)
"""Columns with errors: the worst load that decides, and of each kind by its key."""


def errors(found: Largest, true: Largest) -> dict[str, float]:
    """Errors of largest loads, each relative to the largest of its measure in the joint.

    Returns
    -------
    dict
        The worst of each kind, by its key; ``loads``: the worst of those that decide.
    """
    single = {}
    for kind in kinds(CARDAN).values():
        span = SPAN[kind.key]
        size = max(float(np.max(true[SPAN[measure_of(kind).key]])), 1e-300)
        single[kind.key] = float(np.max(np.abs(found[span] - true[span]))) / size
    return {"loads": max(single[kind.key] for kind in kinds(CARDAN).values() if kind.decides), **single}


def build(runs: Sequence[Run]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Put runs into tables.

    Parameters
    ----------
    runs : sequence of Run
        Measured runs, with the reference solutions of each joint among them.

    Returns
    -------
    points : DataFrame
        One row a contender and setting: ``contender``, ``ours``, ``setting``, ``joints``, ``failed``, ``over_time``,
        ``ms`` (median), then the median error of each of `KINDS`, ``loads_worst``, mean ``halvings`` and ``rates``.
        A run without a result has an infinite error; joints without a truth do not count.
    truth : DataFrame
        One row a joint: difference of the two reference solutions, by kind.

    Raises
    ------
    InputError
        When no joint has a truth.
    """
    references = {(r.joint, int(r.setting)): r for r in runs if r.contender == TRUTH}
    known = {joint for joint, k in references if k == 0 and references[joint, 0].largest is not None}
    if not known:
        raise InputError([Fault("truth", "no joint has largest loads that repeat", "choose other joints by seed")])
    truth = pd.DataFrame([_own_error(references, joint) for joint in sorted(known)])
    rows = []
    for r in runs:
        if r.contender != TRUTH and r.joint in known:
            true = references[r.joint, 0].largest
            assert true is not None
            found = errors(r.largest, true) if r.largest is not None else dict.fromkeys(KINDS, np.inf)
            rows.append(r._asdict() | found)
    frame = pd.DataFrame(rows).drop(columns="largest")
    points = [_point(group) for _, group in frame.groupby(["contender", "setting"], sort=False)]
    return pd.DataFrame(points), truth


def _own_error(references: dict[tuple[int, int], Run], joint: int) -> dict[str, float]:
    tight, loose = references[joint, 0], references[joint, 1]
    assert tight.largest is not None
    own = errors(loose.largest, tight.largest) if loose.largest is not None else dict.fromkeys(KINDS, np.inf)
    return {"joint": joint, **own}


def _point(group: pd.DataFrame) -> dict[str, object]:
    first = group.iloc[0]
    counts = {outcome: int((group["outcome"] == outcome).sum()) for outcome in ("failed", "over_time")}
    medians = {kind: float(group[kind].median()) for kind in KINDS}
    return {
        "contender": first["contender"],
        "ours": bool(first["ours"]),
        "setting": float(first["setting"]),
        "joints": len(group),
        **counts,
        "ms": 1e3 * float(group["seconds"].median()),
        **medians,
        "loads_worst": float(group["loads"].max()),
        "halvings": float(group["halvings"].mean()),
        "rates": float(group["rates"].mean()),
    }


def cheapest(points: pd.DataFrame, error: str, level: float) -> pd.DataFrame:
    """Rows of `points` of the cheapest setting of each contender whose `error` is at most `level`, by contender."""
    good = points[points[error] <= level]
    return good.loc[good.groupby("contender", sort=False)["ms"].idxmin()].set_index("contender")


def cost(points: pd.DataFrame, error: str, levels: Sequence[float]) -> pd.DataFrame:
    """Cost of an error: time of the cheapest setting measured whose error is not larger.

    Parameters
    ----------
    points : DataFrame
        As `build` makes it.
    error : str
        Column of `points`: ``loads`` (the median joint) or ``loads_worst``.
    levels : sequence of float
        The errors.

    Returns
    -------
    DataFrame
        One row a contender: ``contender``, ``ours``, then a column a level with milliseconds a joint, NaN where no
        setting reaches the error.
    """
    costs = points[["contender", "ours"]].drop_duplicates().set_index("contender")
    for level in levels:
        costs[level] = cheapest(points, error, level)["ms"]
    return costs.reset_index()


def leaders(costs: pd.DataFrame) -> pd.DataFrame:
    """Find the fastest of tolstat's settings and of the others at each error.

    Parameters
    ----------
    costs : DataFrame
        As `cost` makes it.

    Returns
    -------
    DataFrame
        One row a level: ``error``, the cheapest of tolstat's settings as ``tolstat`` and ``tolstat_ms``, the cheapest
        of the others as ``other`` and ``other_ms``, and ``ratio`` of their times, above 1 where tolstat is faster.
        Empty text and NaN where none reaches the error.
    """
    rows = []
    for level in map(float, costs.columns[2:]):
        ours, other = (_best(costs[costs["ours"] == side], level) for side in (True, False))
        rows.append([level, *ours, *other, other[1] / ours[1]])
    return pd.DataFrame(rows, columns=["error", "tolstat", "tolstat_ms", "other", "other_ms", "ratio"])


def _best(costs: pd.DataFrame, level: float) -> tuple[str, float]:
    reached = [(float(row[level]), str(row["contender"])) for row in costs[costs[level].notna()].to_dict("records")]
    if not reached:
        return "", np.nan
    time, contender = min(reached)
    return contender, time
