"""Tolerances known from measured parts: what the parts leave open of a process, as values that are assumed.

Spread and mean of an entry have the values at both ends of their intervals, of a lognormal law those of the logarithm.
Their keys stand beside those of the joint: ``pin*.tilt_[tz].spread`` and ``.mean``, the pattern of the entry before the
dot; for values see `analysis.measured`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from tolstat.analysis.measured import means, spreads
from tolstat.study.study import Study
from tolstat.study.tolerances.distributions import Distribution, LogNormal, Normal
from tolstat.study.tolerances.entry import Toleranced
from tolstat.study.tolerances.zone_laws import Accepted


def left_open(entry: Toleranced) -> dict[str, tuple[float, float]]:
    """Values at both ends of the intervals of an entry that is known from measured parts, by their key."""
    ends = {"spread": spreads(entry.parts), "mean": means(entry.parts)}
    return {f"{entry.pattern}.{field}": values for field, values in ends.items()}


def of_entries(study: Study, keys: Mapping[str, Any]) -> dict[str, Distribution]:
    """Distributions of a study with other values of what measured parts leave open.

    Parameters
    ----------
    study : Study
        The study.
    keys : mapping
        Keys of `left_open` to values; other keys are left out.

    Returns
    -------
    dict
        Distribution of each quantity that the entries of these keys draw.
    """
    changed: dict[str, Distribution] = {}
    for entry in study.known:
        values = {key.rpartition(".")[2]: keys[key] for key in left_open(entry) if key in keys}
        if values:
            changed |= {name: _of(study.tolerances[name], **values) for name in entry.names}
    return changed


def _of(law: Distribution, spread: float = 1.0, mean: float = 0.0) -> Distribution:
    """Distribution of parts with another spread and mean."""
    if isinstance(law, Accepted):
        return replace(law, every=_of(law.every, spread, mean))
    normal = law.log if isinstance(law, LogNormal) else law
    assert isinstance(normal, Normal)  # no other law has `measured_parts`
    changed = Normal(normal.mean + mean * normal.sigma, spread * normal.sigma)
    return replace(law, log=changed) if isinstance(law, LogNormal) else changed
