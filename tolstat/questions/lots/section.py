"""Lots on the page: the picture of their shares, and the table."""

from __future__ import annotations

from functools import partial

from tolstat.analysis.clustered import Clustered
from tolstat.common.errors import StoreError
from tolstat.common.tables import VALID
from tolstat.display import drawing, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.lots import query, rendering
from tolstat.questions.lots.query import Lots
from tolstat.store.view import View


def sections(view: View, asked: Asked) -> list[Section]:
    """Shares of the lots and the next delivery; for campaigns whose joints share lots."""
    if not isinstance(view.design, Clustered) or not view.limits or not view.count(*VALID):
        return []
    try:
        found = query.lots_of(view, accepted=asked.accepted)
    except StoreError as error:
        return [Section("lots", "Lots", [Text(f"No lots: {str(error).splitlines()[0].partition(': ')[2]}.")])]
    blocks: list[Block] = [Panels([panel(found)])]
    blocks.append(as_block("Lots against each limit, and all of them together", rendering.COLUMNS, found.table))
    blocks += [Text(text.sentence(line), small=True) for line in rendering.note(found, asked.accepted).splitlines()]
    return [Section("lots", "Lots, and the next delivery", blocks)]


def panel(found: Lots) -> Panel:
    """Picture of the lots' shares."""
    row = found.table.iloc[-1]
    said = f"Half of the lots have at most {text.percent(row['median'])}, the worst has {text.percent(row['worst'])}"
    labels = [rendering.OBSERVED, rendering.EXPECTED, rendering.ALONE]
    return Panel(
        "lots",
        f"{int(row['lots'])} lots: which share of their joints is bad",
        said,
        partial(rendering.draw, found=found),
        (4.9, 3.2),
        top=drawing.legend_room(labels),
    )
