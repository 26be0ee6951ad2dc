"""Shares above the limits by what is done with parts, and by what is known of them: sorted parts, and measured ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tolstat.analysis.sample import CONFIDENCE, Sample, total_interval
from tolstat.analysis.weighted import Weighted
from tolstat.common.errors import NotApplicable
from tolstat.common.loads import ANY_LIMIT, FloatArray
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Costs
from tolstat.questions import shares
from tolstat.store import error_budget
from tolstat.store.recorded import mentions
from tolstat.store.view import View
from tolstat.study import costs as cost_tables
from tolstat.study import scaling
from tolstat.study import selective as gauges
from tolstat.study.selective import PARTS, Gauge

MADE, SCRAPPED, INSPECTED = "all joints", "parts scrapped", "joints rejected"
"""Stages: parts as they are made; without those that are scrapped; without joints that are rejected, too."""
TITLE = "Parts scrapped, joints rejected"
ON_PAGE = (
    "Each joint counts by the probability that the gauges accept its parts, and the inspection the joint. The verdict, "
    "and all else on this page, is on all joints.",
    "Costs: the tolerance of each error costs 1; tolstat sorting FILE --costs TABLE applies a cost table. A part that "
    "is scrapped, and a joint that is rejected, cost what they cost to make. The worst pin scraps a cross. The command "
    "prints every limit.",
)


def _cost(key: str) -> shares.Cell:
    return lambda row: f"{row[key]:.4g}" if math.isfinite(row[key]) else "-"


OF_PARTS = (
    Column("part", shares.word("part")),
    Column("scrapped", shares.share("scrapped")),
    Column("cost of one made", _cost("cost")),
    Column("of one used", _cost("cost_used")),
)
STAGES = (
    Column("load > limit", text.limit),
    Column("stage", shares.word("stage"), words=True),
    Column("above", shares.share("estimate")),
    Column("95 % interval", shares.shares("lower", "upper")),
    Column("rejected", lambda row: text.percent(row["rejected"]) if row["rejected"] else "-", rank=1),
    Column("cost of a joint", _cost("cost"), rank=2),
    Column("of a good one", _cost("cost_good")),
)


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
    panel, *tables = _parts(view, costs)
    return Answer("sorting", TITLE, [Panels([panel]), *tables])


def sorting_on_page(view: View, asked: Asked) -> Answer:
    """Yield and cost of each stage, of all limits together and the leading loads."""
    written = mentions(view.store, ["gauge"], "tolerances") or mentions(view.store, ["below", "above"], "reject")
    if not (written and view.sampled and view.limits and view.counts.done):
        raise NotApplicable
    panel, parts, stages = _parts(view, None)
    shown = {stages.rows[0]["load"], *view.leading}
    seen = [row for row in stages.rows if row["load"] in shown]
    pictures = Panels([panel], beside=list(map(Sentence, ON_PAGE)))
    return Answer("sorting", TITLE, [pictures, parts, replace(stages, seen=seen)])


def _parts(view: View, costs: Costs) -> tuple[Panel, Table, Table]:
    """Picture and tables ``parts`` and ``stages``; raises as `sorting`."""
    study, scrap = view.study, gauges.of_parts(view.study.entries)
    if not (scrap or study.rejects) or not view.limits:
        remedy = "give an entry of [tolerances] a gauge, or add [reject]; and [limits]"
        raise shares.inapplicable(view, "is of a study that sorts nothing, or has no limits", remedy)
    if not view.design.has_interval("reweighting"):
        raise shares.unusable(view, "holds joints that are not independent", 'write sampling.method = "random"')
    probability, base = np.ones(view.n), view.design.counts_as(view.n)
    parts: list[dict[str, Any]] = []
    for part, price in _prices(scaling.tolerances(study), costs).items():
        used = _accepted(view, [gauge for gauge in scrap if gauge.part == part])
        share, probability = float(np.average(used, weights=base)), probability * used
        parts.append({"part": part, "scrapped": 1.0 - share, "cost": price, "cost_used": price / share})
    cost_made, cost = (sum(row[key] for row in parts) for key in ("cost", "cost_used"))
    stages: list[tuple[str, FloatArray | None, float, float]] = [(MADE, None, 0.0, cost_made)]
    if scrap:
        stages.append((SCRAPPED, probability, 0.0, cost))
    if study.rejects:
        passed = _accepted(view, study.rejects)
        share = float(np.average(passed, weights=base * probability))
        stages.append((INSPECTED, probability * passed, 1.0 - share, cost / share))
    loads = view.loads([*([ANY_LIMIT] if len(view.limits) > 1 else []), *view.limits])
    rows = [_row(view, load, *stage) for load in loads for stage in stages]
    title = "Shares above the limits, and what a joint costs"
    tables = Table("parts", "Parts", OF_PARTS, parts), Table("stages", title, STAGES, rows)
    return _panel(rows[: len(stages)]), *tables


def _prices(tolerances: Sequence[scaling.Tolerance], costs: Costs) -> dict[str, float]:
    """Cost of the tolerances of each part, as they are."""
    prices = dict.fromkeys(PARTS, 0.0)
    for cost in cost_tables.of(tolerances, costs):
        for feature in cost.entries:
            if (part := gauges.part_of(feature)) in prices:
                prices[part] += cost.of(feature, 1.0)
    return prices


def _accepted(view: View, sizes: Sequence[Gauge]) -> FloatArray:
    """Probability that each joint is accepted by all of some gauges, (n,)."""
    if not sizes:
        return np.ones(view.n)
    blocks = view.error_blocks(list(dict.fromkeys(column for gauge in sizes for column in gauge.columns)))
    parts = [np.prod([gauge.accepted(errors, view.study.joint) for gauge in sizes], axis=0) for errors in blocks]
    return np.concatenate(parts)


def _row(view: View, load: Sample, stage: str, kept: FloatArray | None, rejected: float, cost: float) -> Row:
    """Share above a limit at a stage, which each joint reaches with the probability `kept`, (n,)."""
    assert load.limit is not None
    loads = error_budget.with_error(view, load)
    if kept is not None:
        base = load.design if isinstance(load.design, Weighted) else Weighted(np.ones(view.n), 1.0)
        loads = tuple(replace(end, design=base.times(kept)) for end in loads)
    share = loads[0].above(load.limit).estimate
    lower, upper = total_interval(loads, load.limit, CONFIDENCE)
    row = {"stage": stage, "load": load.name, "unit": load.unit, "level": load.limit, "estimate": share}
    row |= {"lower": lower, "upper": upper, "rejected": rejected, "cost": cost}
    return row | {"cost_good": cost / (1.0 - share) if share < 1.0 else np.inf}


def _panel(rows: Rows) -> Panel:
    """Picture of the share above the limits at each stage."""

    def draw(ax: Axes) -> None:
        """Draw the share above the limits at each stage, with its interval, and beside it what a good joint costs."""
        high = 1.25 * max(float(row["upper"]) for row in rows)
        ax.set(xlim=(0.0, 100.0 * high), xlabel="share of the joints above a limit, per cent")
        for i, row in enumerate(rows):
            ax.plot([100.0 * row["lower"], 100.0 * row["upper"]], [i, i], color=style.COLOURS[0], lw=3.0)
            ax.plot(100.0 * row["estimate"], i, "o", color=style.COLOURS[0], ms=6.0)
            at, side = (row["lower"], "left") if row["lower"] < 0.5 * high else (row["upper"], "right")
            label = f"a good joint costs {_cost('cost_good')(row)}"
            ax.text(100.0 * at, i - 0.14, label, ha=side, va="bottom", size=8.0, color=style.INK)

    size = (drawing.WIDTH, 0.55 * len(rows) + drawing.BOTTOM + 0.1)
    description = "; ".join(f"{row['stage']}: {text.percent(row['estimate'])}" for row in rows)
    labels = [row["stage"] for row in rows]
    return Panel("stages", "Joints above a limit, before and after", description, draw, size, rows=labels)


DRAWN = 6
"""Maximum number of shares in the picture."""
LEAST = 1e-5
"""Smallest share that the picture shows."""
INTERVALS = {
    "joints": ("lower", "upper", style.COLOURS[0]),
    "parts": ("parts_lower", "parts_upper", style.COLOURS[1]),
    "both": ("both_lower", "both_upper", style.INK),
}
"""Keys of the ends of each interval and its colour, from the top of a row of the picture."""
OF_BOTH = ("expected", "parts_lower", "parts_upper", "both_lower", "both_upper", "unsupported")
"""Keys of a row for the fields of `known_share.KnownShare`."""
COLUMNS = (
    Column("load > limit", text.limit),
    Column("share as stated", shares.share("estimate")),
    Column("joints", shares.shares("lower", "upper")),
    Column("parts", shares.shares("parts_lower", "parts_upper")),
    Column("both", shares.shares("both_lower", "both_upper")),
    Column("next joint", shares.share("expected"), rank=1),
    Column("not supported", shares.share("unsupported"), rank=2),
)
EXPLANATION = (
    "Joints: the tolerances are as stated, and the joints are a sample. Parts: the process may be any that the "
    "parts make likely. Both: the verdict's, with joints without a valid load and the numerical error. Grey line: "
    "the share at the tolerances as stated."
)


def known_parts(view: View) -> Answer:
    """Estimate what measured parts leave open of each share.

    Parameters
    ----------
    view : View
        A campaign of a study with limits, some of whose tolerances are known from measured parts.

    Returns
    -------
    Answer
        Table ``intervals``, one row for `ANY_LIMIT`, if there are several limits, and for each limit, those exceeded
        most first: ``load``, ``unit``, ``level``; ``estimate``, ``lower``, ``upper``, share at the tolerances as stated
        with the interval of the joints; the fields of `known_share.KnownShare`, the last two ends with ``both_`` before
        them.

    Raises
    ------
    NotApplicable
        When the study takes its tolerances as exact or has no limits, or no joint is simulated.
    """
    process = error_budget.known_parts(view)
    if process is None or not view.counts.done:
        remedy = "give an entry of [tolerances] known_from, and the study [limits]"
        raise shares.inapplicable(view, "has no share that measured parts leave open", remedy)
    rows = [_known(view, process, name) for name in (*view.limits, *([ANY_LIMIT] if len(view.limits) > 1 else []))]
    rows.sort(key=lambda row: (row["load"] != ANY_LIMIT, -row["estimate"]))
    drawn = [row for row in rows if not math.isnan(row["both_upper"])][:DRAWN]
    entries = ", ".join(f"{entry.pattern} from {entry.parts}" for entry in process.entries)
    words = (f"Mean and deviation are estimated from measured parts: {entries}.", EXPLANATION)
    parts: list[Part] = [Panels([_intervals(drawn)], beside=list(map(Sentence, words)))] if drawn else []
    parts.append(Table("intervals", "Shares above the limits, with what leaves them open", COLUMNS, rows))
    if len(drawn) < min(len(rows), DRAWN):
        most = text.percent(max(row["unsupported"] for row in rows))
        parts.append(Sentence(f"The joints do not support {most} of the likely processes. {process.remedy}.", "lead"))
    return Answer("known_parts", "Tolerances known from measured parts", parts)


def _known(view: View, process: error_budget.KnownParts, name: str) -> Row:
    load = view.load(name)
    assert load.limit is not None
    above = load.above(load.limit)
    row = {"load": name, "unit": load.unit, "level": load.limit}
    row |= {key: getattr(above, key) for key in ("estimate", "lower", "upper")}
    return row | dict(zip(OF_BOTH, process.share(name, CONFIDENCE), strict=True))


def _intervals(rows: Rows) -> Panel:
    """Picture of the three intervals of some shares."""

    def draw(ax: Axes) -> None:
        """Draw the three intervals of each share, below each other; shares on a logarithmic axis."""
        ends = [row[end] for row in rows for low, high, _ in INTERVALS.values() for end in (low, high)]
        low = max(0.7 * min(end for end in ends if end > LEAST), LEAST)
        style.share_axis(ax, low, "x", min(1.3 * max(ends), 1.0))
        for i, row in enumerate(rows):
            for k, (label, (lower, upper, colour)) in enumerate(INTERVALS.items()):
                look: Any = {"color": colour, "lw": 3.0, "solid_capstyle": "butt", "label": label}
                ax.plot([max(row[lower], 0.1 * low), row[upper]], [i + 0.24 * (k - 1)] * 2, **look)
            if row["estimate"] > low:
                ax.plot([row["estimate"]] * 2, [i - 0.36, i + 0.36], color=style.FAINT, lw=1.2)
        ax.set_xlabel("share of the joints above the limit, 95 % intervals")

    labels, size = [text.limit(row) for row in rows], (drawing.WIDTH, 0.47 * len(rows) + drawing.BOTTOM + 0.38)
    spans = "; ".join(f"{row['load']}: {text.span(row['both_lower'], row['both_upper'])}" for row in rows)
    words = f"Intervals of both: {spans}"
    return Panel("intervals", "What joints and parts leave open", words, draw, size, rows=labels)
