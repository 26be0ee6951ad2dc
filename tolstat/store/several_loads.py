"""Several loads of the same joints as one: the largest, or the largest ratio of load to limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tolstat.analysis.sorted_loads import Intervals
from tolstat.common.loads import ALL_LIMITS, Limit
from tolstat.common.loads import load_of as of_name
from tolstat.store.sample_load import SampleLoad, frozen

if TYPE_CHECKING:
    from tolstat.store.view import View


def load_of(view: View, limit: Limit) -> SampleLoad:
    """Load of a limit; of a limit on several the largest or, if levels differ, the largest ratio of load to level.

    Its limit is the level. Raises as `View.load`.
    """
    levels = zip(limit.loads, limit.levels, strict=True)
    loads = [replace(view.load(name), limit=level) for name, level in levels]
    return loads[0] if limit.loads == (limit.name,) else largest_of(limit.name, loads, not limit.has_one_level)


def together(view: View) -> SampleLoad:
    """Largest ratio of load to limit of each joint, over all limits of the study; above 1, a limit is exceeded."""
    return load_of(view, Limit(ALL_LIMITS, tuple(view.limits), tuple(view.limits.values())))


def largest_of(name: str, parts: Sequence[SampleLoad], of_ratios: bool = False) -> SampleLoad:
    """Largest of several loads of the same joints, whose limits are equal, or largest ratio of load to limit.

    Computed load by load, and ratios are not kept, to save memory.
    """
    joints = np.unique(np.concatenate([part.intervals.joints for part in parts]))
    loads = replace(parts[0], parts=tuple(parts), of_ratios=of_ratios).each()
    first = next(loads)
    values, nominal = first.values.copy(), first.nominal
    lower, upper = first.intervals.ends_of(joints, first.values)
    for load in loads:
        own = load.intervals.ends_of(joints, load.values)
        lower, upper = np.maximum(lower, own[0]), np.maximum(upper, own[1])
        np.maximum(values, load.values, out=values)
        nominal = max(nominal, load.nominal)
    intervals = Intervals.of(values[joints], (lower, upper)).among(joints)
    return replace(
        first,
        name=name,
        nominal=nominal,
        values=frozen(values),
        intervals=intervals,
        parts=tuple(parts),
        of_ratios=of_ratios,
    )


def leading(view: View) -> tuple[str, ...]:
    """Leading load of each kind (force, torque, ...).

    Candidates are the loads with limits or, without limits, those of `loads.SHOWN_LOADS` kept. The leading load is the
    one whose limit the largest share of the joints exceeds; ties are decided by the 99 % quantile over the limit
    (without limits by the 99 % quantile).
    """
    found: dict[str, tuple[tuple[float, float], str]] = {}
    for load in view.loads(list(view.limits) or view.bushing_loads):
        if load.valid.size:
            limit = 1.0 if load.limit is None else load.limit
            share = 0.0 if load.limit is None else load.above(limit).estimate
            rank = (share, float(load.valid[int(0.99 * (load.valid.size - 1))]) / limit)
            kind = of_name(load.name).kind.key
            found[kind] = max(found.get(kind, (rank, load.name)), (rank, load.name), key=lambda item: item[0])
    return tuple(name for _, name in found.values())
