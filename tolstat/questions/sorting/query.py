"""Yield before and after parts are scrapped and joints are rejected, and the cost of a good joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from tolstat.analysis.sample import Sample, total_interval
from tolstat.analysis.weighted import Weighted
from tolstat.common.errors import Fault, StoreError
from tolstat.common.loads import ANY_LIMIT, FloatArray
from tolstat.common.shown import shown
from tolstat.store import error_budget
from tolstat.store.view import View
from tolstat.study import Study, costs, scaling, sorting
from tolstat.study.costs import Cost
from tolstat.study.sorting import PARTS, Gauge

MADE, SCRAPPED, INSPECTED = "all joints", "parts scrapped", "joints rejected"
"""Stages: parts as they are made; without those that are scrapped; without joints that are rejected, too."""


@shown
class Sorted(NamedTuple):
    """What sorting of parts and inspection of joints do.

    Attributes
    ----------
    stages : DataFrame
        One row per stage and limit, that of all limits first: ``stage``, ``load``, ``unit``, ``level``; ``estimate``,
        ``lower``, ``upper``, share above the limit with its total interval; ``rejected``, share of the assembled joints
        that is rejected; ``cost`` of a joint that is delivered, ``cost_good`` of one below the limit.
    parts : DataFrame
        One row per part: ``part``, ``scrapped``, share of the parts made; ``cost`` of one made, ``cost_used`` of one
        that is used.
    """

    stages: pd.DataFrame
    parts: pd.DataFrame


class _Stage(NamedTuple):
    """Stage: probability of each joint to get there, (n,); share that is rejected; cost of a joint delivered."""

    name: str
    kept: FloatArray
    rejected: float
    cost: float


def sorts(view: View) -> bool:
    """Whether the study of a file scraps parts or rejects joints."""
    return bool(view.study.rejects or sorting.of_parts(view.study.entries))


def sorted_joints(view: View, cost_file: Path | None = None, confidence: float = 0.95) -> Sorted:
    """Tell yield and cost before and after sorting; no joint is simulated.

    Parameters
    ----------
    view : View
        A campaign of a study with limits, whose entries have a ``gauge``, or with ``[reject]``.
    cost_file : Path, optional
        Cost table, see `study.costs.of`; without it the tolerance of each error costs 1.
    confidence : float
        Confidence level of the intervals.

    Raises
    ------
    InputError
        With every fault of the cost table.
    StoreError
        When the study sorts nothing or has no limits, or its joints are not independent.

    Examples
    --------
    >>> with tolstat.open("sorting.h5") as store:  # doctest: +SKIP
    ...     print(tolstat.sorted_joints(store.view()).stages)
    """
    study = view.study
    scrap = sorting.of_parts(study.entries)
    if not (scrap or study.rejects) or not view.limits:
        remedy = "give an entry of [tolerances] a gauge, or add [reject]; and [limits]"
        raise StoreError(str(Fault(str(view.path), "is of a study that sorts nothing, or has no limits", remedy)))
    if not view.design.has_interval("reweighting"):
        remedy = 'write sampling.method = "random"'
        raise StoreError(str(Fault(str(view.path), "holds joints that are not independent", remedy)))
    of_part = {part: _accepted(view, [own for own in scrap if own.part == part]) for part in PARTS}
    base = view.design.counts_as(view.n)
    used = {part: float(np.average(kept, weights=base)) for part, kept in of_part.items()}
    price = _prices(study, costs.of(scaling.tolerances(study), cost_file))
    parts = pd.DataFrame(
        [
            {"part": part, "scrapped": 1.0 - used[part], "cost": price[part], "cost_used": price[part] / used[part]}
            for part in PARTS
        ]
    )
    stages = [_Stage(MADE, np.ones(view.n), 0.0, sum(price.values()))]
    kept = np.prod(list(of_part.values()), axis=0)
    assembled = float(parts["cost_used"].sum())
    if scrap:
        stages.append(_Stage(SCRAPPED, kept, 0.0, assembled))
    if study.rejects:
        passed = _accepted(view, study.rejects)
        share = float(np.average(passed, weights=base * kept))
        stages.append(_Stage(INSPECTED, kept * passed, 1.0 - share, assembled / share))
    names = [*([ANY_LIMIT] if len(view.limits) > 1 else []), *view.limits]
    rows = [_row(view, load, stage, confidence) for load in view.loads(names) for stage in stages]
    return Sorted(pd.DataFrame(rows), parts)


def _accepted(view: View, gauges: Sequence[Gauge]) -> FloatArray:
    """Probability that each joint is accepted by all of some gauges, (n,)."""
    if not gauges:
        return np.ones(view.n)
    columns = list(dict.fromkeys(column for gauge in gauges for column in gauge.columns))
    blocks = view.error_blocks(columns)
    parts = [np.prod([gauge.accepted(errors, view.study.joint) for gauge in gauges], axis=0) for errors in blocks]
    return np.concatenate(parts)


def _prices(study: Study, prices: Sequence[Cost]) -> dict[str, float]:
    """Cost of the tolerances of each part, as they are."""
    found = dict.fromkeys(PARTS, 0.0)
    for tolerance, cost in zip(scaling.tolerances(study), prices, strict=True):
        for name, entry in zip(tolerance.names, cost.entries, strict=True):
            found[sorting.part_of(name)] += Cost(cost.width, (entry,)).at(1.0)
    return found


def _row(view: View, load: Sample, stage: _Stage, confidence: float) -> dict[str, object]:
    assert load.limit is not None
    loads = error_budget.with_error(view, load)
    if stage.name != MADE:  # each joint counts by its probability to be kept
        base = load.design if isinstance(load.design, Weighted) else Weighted(np.ones(view.n), 1.0)
        design = base.times(stage.kept)
        loads = tuple(replace(own, design=design) for own in loads)
    share = loads[0].above(load.limit, confidence).estimate
    lower, upper = total_interval(loads, load.limit, confidence)
    row = {"stage": stage.name, "load": load.name, "unit": load.unit, "level": load.limit, "estimate": share}
    row |= {"lower": lower, "upper": upper, "rejected": stage.rejected, "cost": stage.cost}
    return row | {"cost_good": stage.cost / (1.0 - share) if share < 1.0 else np.inf}
