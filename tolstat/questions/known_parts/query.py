"""Shares above the limits where tolerances are known from measured parts: three intervals."""

from __future__ import annotations

from typing import Any

import pandas as pd

from tolstat.common.loads import ANY_LIMIT
from tolstat.store import known_parts
from tolstat.store.view import View


def intervals(view: View, confidence: float = 0.95) -> pd.DataFrame:
    """Share above at least one limit, and above each, with what leaves it open.

    Parameters
    ----------
    view : View
        A campaign of a study with limits, some of whose tolerances are known from measured parts.
    confidence : float
        Confidence level of each interval.

    Returns
    -------
    DataFrame
        One row for `ANY_LIMIT`, if there are several, and for each limit, those exceeded most first: ``load``,
        ``unit``, ``level``; ``estimate``, ``lower``, ``upper``, share at the tolerances as stated with the interval of
        the joints; the fields of `known_share.KnownShare`, the last two ends with ``both_`` before them. Empty if the
        tolerances are taken as exact.
    """
    rows: list[dict[str, Any]] = []
    for load in view.loads([*view.limits, *([ANY_LIMIT] if len(view.limits) > 1 else [])]):
        known = known_parts.of(view)
        if known is None or load.limit is None:
            continue
        found, own = known.share(load.name, confidence), load.above(load.limit, confidence)
        row = {"load": load.name, "unit": load.unit, "level": load.limit}
        row |= {"estimate": own.estimate, "lower": own.lower, "upper": own.upper, "expected": found.expected}
        row |= {"parts_lower": found.parts_lower, "parts_upper": found.parts_upper}
        rows.append(row | {"both_lower": found.lower, "both_upper": found.upper, "unsupported": found.unsupported})
    rows.sort(key=lambda row: (row["load"] != ANY_LIMIT, -row["estimate"]))
    return pd.DataFrame(rows)
