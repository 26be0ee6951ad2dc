"""Yield before and after parts are scrapped and joints are rejected, and the cost of a good joint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tolstat.analysis.sample import CONFIDENCE, Sample, total_interval
from tolstat.analysis.weighted import Weighted
from tolstat.common.errors import Fault, NotApplicable, StoreError
from tolstat.common.loads import ANY_LIMIT, FloatArray
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Table
from tolstat.display.asked import Asked
from tolstat.display.blocks import Panel, Panels, Text
from tolstat.display.options import Costs
from tolstat.display.table import Column, Row, Rows
from tolstat.store import error_budget
from tolstat.store.recorded import mentions
from tolstat.store.view import View
from tolstat.study import Study, scaling
from tolstat.study import costs as cost_tables
from tolstat.study import sorting as gauges
from tolstat.study.costs import Cost
from tolstat.study.sorting import PARTS, Gauge

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MADE, SCRAPPED, INSPECTED = "all joints", "parts scrapped", "joints rejected"
"""Stages: parts as they are made; without those that are scrapped; without joints that are rejected, too."""
ON_PAGE = (
    "Each joint counts by the probability that the gauges accept its parts, and the inspection the joint. The verdict, "
    "and all else on this page, is on all joints.",
    "Costs: the tolerance of each error costs 1; tolstat sorting FILE --costs TABLE applies a cost table. A part that "
    "is scrapped, and a joint that is rejected, cost what they cost to make. The worst pin scraps a cross. The command "
    "prints every limit.",
)


def _cost(row: Row, name: str) -> str:
    return f"{row[name]:.4g}" if math.isfinite(row[name]) else "-"


OF_PARTS = (
    Column("part", lambda row: str(row["part"])),
    Column("scrapped", lambda row: text.percent(row["scrapped"])),
    Column("cost of one made", lambda row: _cost(row, "cost")),
    Column("of one used", lambda row: _cost(row, "cost_used")),
)
STAGES = (
    Column("load > limit", text.limit),
    Column("stage", lambda row: str(row["stage"]), words=True),
    Column("above", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
    Column("rejected", lambda row: text.percent(row["rejected"]) if row["rejected"] else "-", rank=1),
    Column("cost of a joint", lambda row: _cost(row, "cost"), rank=2),
    Column("of a good one", lambda row: _cost(row, "cost_good")),
)


class _Stage(NamedTuple):
    """Stage: probability of each joint to get there, (n,); share that is rejected; cost of a joint delivered."""

    name: str
    kept: FloatArray
    rejected: float
    cost: float


def sorting(view: View, costs: Costs = None) -> Answer:
    """Compute yield and cost before and after parts are sorted.

    Parts are scrapped by the gauge of their entry in [tolerances], joints rejected by [reject]. No joint is simulated:
    each counts by the probability that it is kept.

    Gives the share of parts scrapped and the cost of a part, then for each limit, and for all together, the share
    above it with its 95 % interval and the cost of a good joint, at each stage.

    Example: tolstat sorting sorting.h5

    Parameters
    ----------
    view : View
        A campaign of a study with limits, whose entries have a ``gauge``, or with ``[reject]``.
    costs : Path, optional
        Cost of each tolerance, TOML or CSV (see tolstat docs allocate); default: 1 for each error.

    Returns
    -------
    Answer
        Table ``parts``, one row per part: ``part``, ``scrapped``, share of the parts made; ``cost`` of one made,
        ``cost_used`` of one that is used. Table ``stages``, one row per stage and limit, that of all limits first:
        ``stage``, ``load``, ``unit``, ``level``; ``estimate``, ``lower``, ``upper``, share above the limit with its
        total interval; ``rejected``, share of the assembled joints that is rejected; ``cost`` of a joint that is
        delivered, ``cost_good`` of one below the limit.

    Raises
    ------
    InputError
        With every fault of the cost table.
    NotApplicable
        When the study sorts nothing or has no limits.
    StoreError
        When its joints are not independent.
    """
    scrap = gauges.of_parts(view.study.entries)
    if not (scrap or view.study.rejects) or not view.limits:
        remedy = "give an entry of [tolerances] a gauge, or add [reject]; and [limits]"
        raise NotApplicable(str(Fault(str(view.path), "is of a study that sorts nothing, or has no limits", remedy)))
    if not view.design.has_interval("reweighting"):
        remedy = 'write sampling.method = "random"'
        raise StoreError(str(Fault(str(view.path), "holds joints that are not independent", remedy)))
    of_part = {part: _accepted(view, [own for own in scrap if own.part == part]) for part in PARTS}
    base = view.design.counts_as(view.n)
    used = {part: float(np.average(kept, weights=base)) for part, kept in of_part.items()}
    price = _prices(view.study, cost_tables.of(scaling.tolerances(view.study), costs))
    parts = [
        {"part": part, "scrapped": 1.0 - used[part], "cost": price[part], "cost_used": price[part] / used[part]}
        for part in PARTS
    ]
    stages = [_Stage(MADE, np.ones(view.n), 0.0, sum(price.values()))]
    kept = np.prod(list(of_part.values()), axis=0)
    assembled = sum(price[part] / used[part] for part in PARTS)
    if scrap:
        stages.append(_Stage(SCRAPPED, kept, 0.0, assembled))
    if view.study.rejects:
        passed = _accepted(view, view.study.rejects)
        share = float(np.average(passed, weights=base * kept))
        stages.append(_Stage(INSPECTED, kept * passed, 1.0 - share, assembled / share))
    names = [*([ANY_LIMIT] if len(view.limits) > 1 else []), *view.limits]
    rows = [_row(view, load, stage) for load in view.loads(names) for stage in stages]
    pictures = Panels([_panel(rows[: len(stages)])])
    title = "Shares above the limits, and what a joint costs"
    tables = Table("parts", "Parts", OF_PARTS, parts), Table("stages", title, STAGES, rows)
    return Answer("sorting", "Parts scrapped, joints rejected", [pictures, *tables])


def sorting_on_page(view: View, asked: Asked) -> Answer:
    """Yield and cost of each stage, of all limits together and the leading loads."""
    written = mentions(view.store, ["gauge"], "tolerances") or mentions(view.store, ["below", "above"], "reject")
    if not (written and view.sampled and view.limits and view.counts.done):
        raise NotApplicable
    answer = sorting(view)
    pictures, parts, stages = answer.parts
    assert isinstance(pictures, Panels)
    assert isinstance(stages, Table)
    shown = {stages.rows[0]["load"], *view.leading}
    seen = [row for row in stages.rows if row["load"] in shown]
    beside = replace(pictures, beside=[Text(line, small=True) for line in ON_PAGE])
    return replace(answer, parts=[beside, parts, replace(stages, seen=seen)])


def _accepted(view: View, sizes: Sequence[Gauge]) -> FloatArray:
    """Probability that each joint is accepted by all of some gauges, (n,)."""
    if not sizes:
        return np.ones(view.n)
    columns = list(dict.fromkeys(column for gauge in sizes for column in gauge.columns))
    blocks = view.error_blocks(columns)
    parts = [np.prod([gauge.accepted(errors, view.study.joint) for gauge in sizes], axis=0) for errors in blocks]
    return np.concatenate(parts)


def _prices(study: Study, prices: Sequence[Cost]) -> dict[str, float]:
    """Cost of the tolerances of each part, as they are."""
    found = dict.fromkeys(PARTS, 0.0)
    for tolerance, cost in zip(scaling.tolerances(study), prices, strict=True):
        for name, entry in zip(tolerance.names, cost.entries, strict=True):
            found[gauges.part_of(name)] += Cost(cost.width, (entry,)).at(1.0)
    return found


def _row(view: View, load: Sample, stage: _Stage) -> Row:
    assert load.limit is not None
    loads = error_budget.with_error(view, load)
    if stage.name != MADE:  # each joint counts by its probability to be kept
        base = load.design if isinstance(load.design, Weighted) else Weighted(np.ones(view.n), 1.0)
        design = base.times(stage.kept)
        loads = tuple(replace(own, design=design) for own in loads)
    share = loads[0].above(load.limit).estimate
    lower, upper = total_interval(loads, load.limit, CONFIDENCE)
    row = {"stage": stage.name, "load": load.name, "unit": load.unit, "level": load.limit, "estimate": share}
    row |= {"lower": lower, "upper": upper, "rejected": stage.rejected, "cost": stage.cost}
    return row | {"cost_good": stage.cost / (1.0 - share) if share < 1.0 else np.inf}


def _panel(rows: Rows) -> Panel:
    """Picture of the share above the limits at each stage."""
    left = drawing.rows_left([str(row["stage"]) for row in rows])
    size = (drawing.WIDTH, 0.55 * len(rows) + drawing.BOTTOM + 0.1)
    description = "; ".join(f"{row['stage']}: {text.percent(row['estimate'])}" for row in rows)
    title = "Joints above a limit, before and after"
    return Panel("stages", title, description, partial(_draw, rows=rows), size, left)


def _draw(ax: Axes, rows: Rows) -> None:
    """Draw the share above the limits at each stage, with its interval, and beside it what a good joint costs."""
    drawing.rows(ax, [str(row["stage"]) for row in rows])
    high = 1.25 * max(float(row["upper"]) for row in rows)
    ax.set_xlim(0.0, 100.0 * high)
    for i, row in enumerate(rows):
        ax.plot([100.0 * row["lower"], 100.0 * row["upper"]], [i, i], color=style.COLOURS[0], lw=3.0)
        ax.plot(100.0 * row["estimate"], i, "o", color=style.COLOURS[0], ms=6.0)
        label = f"a good joint costs {_cost(row, 'cost_good')}"
        at, side = (row["lower"], "left") if row["lower"] < 0.5 * high else (row["upper"], "right")
        ax.text(100.0 * at, i - 0.14, label, ha=side, va="bottom", size=8.0, color=style.INK)
    ax.set_xlabel("share of the joints above a limit, per cent")
