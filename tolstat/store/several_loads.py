"""Several loads of the same joints as one: the largest, or the largest ratio of load to limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tolstat.common.loads import ALL_LIMITS, Limit
from tolstat.common.loads import load_of as of_name
from tolstat.store.sample_load import SampleLoad

if TYPE_CHECKING:
    from tolstat.store.view import View


def load_of(view: View, limit: Limit) -> SampleLoad:
    """Load of a limit; of a limit on several the largest or, if levels differ, the largest ratio of load to level.

    Its limit is the level. Raises as `View.load`.
    """
    levels = zip(limit.loads, limit.levels, strict=True)
    loads = [replace(view.load(name), limit=level) for name, level in levels]
    if not limit.has_one_level:
        loads = [load.of_limit() for load in loads]
    return loads[0] if limit.loads == (limit.name,) else largest_of(limit.name, loads)


def together(view: View) -> SampleLoad:
    """Largest ratio of load to limit of each joint, over all limits of the study; above 1, a limit is exceeded."""
    return load_of(view, Limit(ALL_LIMITS, tuple(view.limits), tuple(view.limits.values())))


def largest_of(name: str, loads: Sequence[SampleLoad]) -> SampleLoad:
    """Largest of several loads of the same joints; their limits are equal. Computed load by load to save memory."""
    first = loads[0]
    values, nominal = np.maximum.reduce([load.values for load in loads]), max(load.nominal for load in loads)
    lower, upper = (
        values
        if all(load.ends[k] is load.values for load in loads)
        else np.maximum.reduce([load.ends[k] for load in loads])
        for k in (0, 1)
    )
    return replace(first, name=name, nominal=nominal, values=values, ends=(lower, upper), parts=tuple(loads))


def leading(view: View) -> tuple[str, ...]:
    """Leading load of each kind (force, torque, ...).

    Candidates are the loads with limits or, without limits, all bushing loads kept. The leading load is the one whose
    limit the largest share of the joints exceeds; ties are decided by the 99 % quantile over the limit (without limits
    by the 99 % quantile).
    """
    found: dict[str, tuple[tuple[float, float], str]] = {}
    for load in view.loads(list(view.limits) or view.bushing_loads):
        if load.valid.size:
            limit = 1.0 if load.limit is None else load.limit
            share = 0.0 if load.limit is None else load.above(limit).estimate
            rank = (share, float(load.valid[int(0.99 * (load.valid.size - 1))]) / limit)
            kind = of_name(load.name).kind
            found[kind] = max(found.get(kind, (rank, load.name)), (rank, load.name), key=lambda item: item[0])
    return tuple(name for _, name in found.values())
