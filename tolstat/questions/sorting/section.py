"""Sorting on the page: yield and cost before and after parts are scrapped and joints are rejected."""

from __future__ import annotations

from functools import partial

from tolstat.display import drawing, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.sorting import query, rendering
from tolstat.store.recorded import mentions
from tolstat.store.view import View


def sections(view: View, asked: Asked) -> list[Section]:
    """Yield and cost of each stage; none for a study that sorts nothing."""
    written = mentions(view.store, ["gauge"], "tolerances") or mentions(view.store, ["below", "above"], "reject")
    if not (written and view.sampled and view.limits and view.counts.done):
        return []
    with asked.noting("sorting is left out"):
        if not query.sorts(view):
            return []
        found = query.sorted_joints(view)
        first = found.stages[found.stages["load"] == found.stages["load"].iloc[0]]
        shown = found.stages[found.stages["load"].isin([first["load"].iloc[0], *view.leading])]
        left = drawing.rows_left([str(stage) for stage in first["stage"]])
        size = (drawing.WIDTH, 0.55 * len(first) + drawing.BOTTOM + 0.1)
        said = "; ".join(f"{row['stage']}: {text.percent(row['estimate'])}" for row in first.to_dict("records"))
        draw = partial(rendering.yields, table=first)
        panel = Panel("sorting", "Joints above a limit, before and after", said, draw, size, left)
        how = [Text(line, small=True) for line in HOW]
        blocks: list[Block] = [
            Panels([panel], beside=how),
            as_block("Parts", rendering.PARTS, found.parts),
            as_block("Shares above the limits, and what a joint costs", rendering.STAGES, shown),
        ]
        return [Section("sorting", "Parts scrapped, joints rejected", blocks)]
    return []


HOW = (
    "Each joint counts by the probability that the gauges accept its parts, and the inspection the joint. The verdict, "
    "and all else on this page, is on all joints.",
    "Costs: the tolerance of each error costs 1; tolstat sorting FILE --costs TABLE applies a cost table. A part that "
    "is scrapped, and a joint that is rejected, cost what they cost to make. The worst pin scraps a cross. The command "
    "prints every limit.",
)
