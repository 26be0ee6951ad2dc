"""Verdict on a limit: whether the total interval of the share above it lies below an accepted share."""

from __future__ import annotations

import numpy as np

from tolstat.analysis import binomial
from tolstat.display import text
from tolstat.display.table import Row

WORDS = {
    "yes": "kept",
    "searched": "consistent with what was searched",
    "no": "not kept",
    "open": "open",
    "none": "no verdict",
}
"""Answers of `verdict` in words."""


def verdict(row: Row, accepted: float) -> str:
    """Verdict on a limit, or on all together: whether the interval `ends` lies below or above the accepted share.

    Parameters
    ----------
    row : mapping
        A row of `rows.limit_rows`, or `rows.all_limits`.
    accepted : float
        Accepted share: share of the joints that may be above the limit; NaN if none is given.

    Returns
    -------
    str
        ``yes`` (below), ``no`` (above), ``searched`` (below if the proposals of importance sampling reach every way to
        the limit; whatever they miss, it may be above), ``open`` (neither), ``none``: no interval, or joints without a
        valid load decide, so that more joints do not help; empty without an accepted share.
    """
    if np.isnan(accepted):
        return ""
    low, high = ends(row)
    if np.isnan(low):
        return "none"
    if high <= accepted or low > accepted:
        missed = row["unsearched_upper"] > accepted  # False for joints of equal weight
        return "no" if low > accepted else "searched" if missed else "yes"
    undecided = row["bound_lower"] <= accepted < row["bound_upper"]
    return "none" if not row["n"] or (undecided and unresolved_matter(row)) else "open"


def ends(row: Row) -> tuple[float, float]:
    """Interval that covers sampling, unresolved joints and, if known, the numerical error.

    Where tolerances are known from measured parts it covers what these leave open, too.
    """
    if "both_lower" in row:
        return row["both_lower"], row["both_upper"]
    wide = (row["total_lower"], row["total_upper"])
    return (row["outer_lower"], row["outer_upper"]) if np.isnan(wide[0]) else wide


def share_of(row: Row) -> str:
    """Share above a limit or, where unresolved joints matter, its interval or bounds."""
    if not unresolved_matter(row):
        return text.percent(row["estimate"])
    low, high = ends(row)
    return text.span(low, high) if not np.isnan(low) else text.span(row["bound_lower"], row["bound_upper"])


def unresolved_matter(row: Row) -> bool:
    """Whether joints without a valid load make the share above a limit as uncertain as sampling does."""
    return binomial.unresolved_matter(row["count"], row["n"], row["n_failed"] + row["n_unsettled"])
