"""Which load is exceeded by which share of the joints: shares above limits, quantiles, curves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.estimates import CURVE
from tolstat.analysis.sample import CONFIDENCE, Sample, total_interval
from tolstat.common.loads import ANY_LIMIT, load_of, shown_loads, unit_text
from tolstat.display import text
from tolstat.display.table import Row, Rows
from tolstat.display.verdict import side_of
from tolstat.questions.shares import unresolved_matter
from tolstat.store import error_budget
from tolstat.store.view import View

SHARES = (0.5, 0.9, 0.95, 0.99)
COVERED = 0.99
"""Share of the joints that the tolerance limit covers."""
ERROR_BUDGET = ("numerical_lower", "numerical_upper", "total_lower", "total_upper")
MAX_LEVELS = 600
"""Maximum number of points of a curve."""
READER_LEVELS = 240
"""Approximate number of levels at which the reader tool of the page has values; the levels are round numbers."""


def limit_rows(view: View) -> Rows:
    """Share of the joints above each of the study's limits.

    Returns
    -------
    sequence of mapping
        One row per limit, in the study's order: ``load``, ``unit``, ``nominal``, then the fields of
        `analysis.estimates.Exceedance` (``level`` is the limit), then ``confidence``, the error budget, see
        `_above_limit`. Loads in SI units.
    """
    return view.kept("limit_rows", lambda: [_above_limit(view, view.load(name)) for name in view.limits])


def most_exceeded(view: View, rows: Rows) -> Row:
    """Row of `limit_rows` with the largest share of joints above its limit; of equal ones that of a leading load."""
    return max(rows, key=lambda row: (np.nan_to_num(row["estimate"], nan=-1.0), row["load"] in view.leading))


def all_limits(view: View) -> dict[str, Any]:
    """Share of the joints above at least one limit: a row as those of `limit_rows`, of the load `ANY_LIMIT`.

    Its level is 1, and its loads are the largest ratios of load to limit.
    """
    return view.kept("all_limits", lambda: _above_limit(view, view.load(ANY_LIMIT)))


def _above_limit(view: View, load: Sample) -> dict[str, Any]:
    """Row of a load; the error budget is bounds of the share with every load shifted by the numerical error.

    ``numerical_error`` is relative to the largest load of the kind in the joint; ``numerical_lower`` and
    ``numerical_upper`` are the estimates with loads shifted down and up; ``total_lower`` and ``total_upper`` the outer
    ends of their intervals: they cover numerical error, sampling and unresolved joints. NaN where it is unknown.
    """
    level = load.limit
    assert level is not None
    loads, budget = error_budget.with_error(view, load), [np.nan] * 4
    if len(loads) > 1:
        estimates = (end.above(level, CONFIDENCE).estimate for end in loads[1:])
        budget = [*estimates, *total_interval(loads, level, CONFIDENCE)]
    row = {"load": load.name, "unit": load.unit, "nominal": load.nominal} | vars(load.above(level, CONFIDENCE))
    row |= {"confidence": CONFIDENCE, "numerical_error": error_budget.relative(view, load.name)}
    return row | dict(zip(ERROR_BUDGET, budget, strict=True))


def point_rows(view: View) -> Rows:
    """Share of the joints above each limit at each of the operating points that it holds at.

    Returns
    -------
    sequence of mapping
        One row per limit that holds at several points, in the study's order: ``load``, ``unit``, ``level``, and under
        the name of each point of the view the share there; NaN where the limit does not hold. No rows for a view of one
        point.
    """
    rows = []
    for name, level in view.limits.items():
        at, plain = view.narrowed(name)
        if len(at.points) > 1:
            loads = {part.points[0]: part.load(plain) for part in at.parts}
            shares = {p: load.above(level).estimate for p, load in loads.items()}
            blank = dict.fromkeys(view.points, np.nan)
            rows.append({"load": name, "unit": load_of(name, view.mechanism).unit, "level": level} | blank | shares)
    return rows


def quantile_rows(view: View) -> Rows:
    """Quantiles of the loads that tables show, see `View.shown_loads`.

    Returns
    -------
    sequence of mapping
        One row per load and share: ``load``, ``unit``, ``nominal``, the fields of `analysis.estimates.Quantile`,
        ``confidence``. Loads in SI units.
    """
    rows: list[Row] = []
    for load in view.loads(view.shown_loads):
        head = {"load": load.name, "unit": load.unit, "nominal": load.nominal}
        rows += [head | load.quantile(share)._asdict() | {"confidence": CONFIDENCE} for share in SHARES]
    return rows


def curve_rows(view: View) -> Rows:
    """Exceedance curves of the loads that tables show, as one table.

    Returns
    -------
    sequence of mapping
        ``load``, ``unit``, then the fields of `analysis.estimates.Exceedance`; SI units, at most
        `MAX_LEVELS` levels per load.
    """
    return [
        {"load": load.name, "unit": load.unit} | dict(zip(CURVE.names or (), point, strict=True))
        for load in view.loads(view.shown_loads)
        for point in curve(load, MAX_LEVELS).tolist()
    ]


def curve(load: Sample, max_levels: int) -> NDArray[np.void]:
    """Exceedance curve of a load, thinned to `max_levels` levels: denser at the largest loads."""
    levels = np.unique(load.valid)
    if levels.size > max_levels:
        top = levels.size - np.geomspace(1, levels.size, max_levels // 2).round().astype(int)
        even = np.linspace(0, levels.size - 1, max_levels // 2).round().astype(int)
        levels = levels[np.union1d(top, even)]
    below = np.nextafter(levels[:1], -np.inf)  # a level that every valid joint exceeds
    return load.curve(np.concatenate([below, levels]))


def readings(view: View) -> dict[str, Any]:
    """Exceedance of every load at round levels, for the reader tool: exact there, not interpolated between them.

    Returns
    -------
    dict
        By load, also those that only limits name: ``unit``; ``n``, ``failed``, ``unsettled``;
        ``start``, index of the level shown first (nearest to the limit or, without one, to the 90 % quantile); lists of
        equal length ``x``, ``count``, ``share`` and, for independent samples, ``lower``, ``upper``, ``outer_lower``,
        ``outer_upper``, otherwise ``bound_lower``, ``bound_upper``.
    """
    curves, is_known = {}, view.design.is_sample
    ends = ("lower", "upper", "outer_lower", "outer_upper") if is_known else ("bound_lower", "bound_upper")
    for load in view.loads(list(dict.fromkeys((*view.shown_loads, *view.limits)))):
        if not load.valid.size:
            continue
        marked = [] if load.limit is None else [load.limit]
        low, high = (float(end([*load.valid[[0, -1]], *marked])) for end in (min, max))
        raw = max(high - low, 1e-3 * abs(high), 1e-12) / READER_LEVELS
        power = 10.0 ** np.floor(np.log10(raw))
        step = power * next(multiple for multiple in (1, 2, 5, 10) if multiple * power >= raw)
        x = np.union1d(step * np.arange(np.floor(low / step), np.ceil(high / step) + 1), marked)
        start = load.quantile(0.9).estimate if load.limit is None else load.limit
        table = load.curve(x)
        curves[load.name] = {
            "unit": unit_text(load.unit),
            "n": int(table["n"][0]),
            "failed": int(table["n_failed"][0]),
            "unsettled": int(table["n_unsettled"][0]),
            "start": int(np.argmin(np.abs(x - start))),
            "x": [float(f"{v:.9g}") for v in x],
            "count": table["count"].tolist(),
            "share": [float(f"{v:.3g}") for v in table["estimate"]],
            **{end: [float(f"{v:.3g}") for v in table[end]] for end in ends},
        }
    return curves


def not_kept(view: View) -> str:
    """Sentence that names the bushing loads that the study does not keep; empty if it keeps all."""
    names = [name for name in shown_loads(view.mechanism) if name not in view.bushing_loads]
    return f"not kept, see [output] results of the study: {', '.join(names)}" if names else ""


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
        ``yes`` (below), ``no`` (above), ``open`` (neither), ``none``: no interval, or joints without a valid load
        decide, so that more joints do not help; empty without an accepted share.
    """
    side = side_of(ends(row), accepted)
    if np.isnan(accepted) or side in ("yes", "no"):
        return side
    undecided = row["bound_lower"] <= accepted < row["bound_upper"]
    return "none" if not (side and row["n"]) or (undecided and unresolved_matter(row)) else "open"


def ends(row: Row) -> tuple[float, float]:
    """Interval that covers sampling, unresolved joints and, if known, the numerical error."""
    wide = (row["total_lower"], row["total_upper"])
    return (row["outer_lower"], row["outer_upper"]) if np.isnan(wide[0]) else wide


def share_of(row: Row) -> str:
    """Share above a limit or, where unresolved joints matter, its interval or bounds."""
    if not unresolved_matter(row):
        return text.percent(row["estimate"])
    low, high = ends(row)
    return text.span(low, high) if not np.isnan(low) else text.span(row["bound_lower"], row["bound_upper"])
