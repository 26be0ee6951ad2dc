"""What if on the page: the share above the worst limit with each line changed."""

from __future__ import annotations

from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panels, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.what_if import query, rendering
from tolstat.store.view import View

SHOWN = 5
"""Largest rank of the columns of text that the page shows."""
TITLE = "Which line of the drawing to change"


def sections(view: View, asked: Asked) -> list[Section]:
    """Section ``what-if`` of the limit exceeded most; none without limits or tolerances, or without a valid joint.

    Where the file holds no joints with other widths, it says which command simulates them.
    """
    applies = view.sampled and view.limits and view.store.whole and view.count(*VALID)
    if not applies or view.design.refuses("difference"):
        return []
    with asked.noting("nothing on the lines of the drawing"):
        found = query.what_if(view, view.decisive)
        blocks = _missing(asked) if found is None else _blocks(found, asked)
        return [Section("what-if", TITLE, blocks)]
    return []


def _missing(asked: Asked) -> list[Block]:
    said = (
        "Not in the file yet. To simulate the same joints with each tolerance half as wide, exact, finer and coarser: "
    )
    again = f"then this page again: tolstat report {asked.path.name} --out PAGE.html"
    return [Text(f"{said}tolstat causes {asked.path.name} --run; {again}")]


def _blocks(found: query.WhatIf, asked: Asked) -> list[Block]:
    best = rendering.sentence(found, asked.accepted)
    words = rendering.event(found)
    said = text.sentence(f"{words} in {text.percent(found.share)} of {found.n} joints as drawn")
    said += f" {best}." if best else " No line that is made half as wide surely lowers it."
    steps = [column for column in rendering.columns(found) if column.rank <= SHOWN]
    how = (
        "Each line is an entry of [tolerances]: made half as wide about the middle of its band, exact (in the middle "
        "of its band), one class finer or coarser where it has a class, else × 0.63 and × 1.6. The joints have the "
        f"same seeds, {found.n} as drawn ({rendering.joints(found)}); whiskers and bands are the 95 % intervals of "
        "the table, without the numerical error (upper whisker: half as wide; lower: coarser; band: first line). An "
        "arrow at the edge of a picture: a share or the end of an interval is smaller than what its axis shows. "
        f"{_rest(found)}"
    )
    blocks: list[Block] = [
        Text(said),
        Panels([rendering.tornado_panel(found, asked.accepted), rendering.curve_panel(found, asked.accepted)]),
        as_block(f"Share of the joints with {words}, with one line changed", steps, rendering.rows(found)),
    ]
    if not found.indices.empty:
        title = "Part of each line in the scatter of the load, and in whether it is above its limit"
        blocks.append(as_block(title, rendering.index_columns(found), found.indices))
    return [*blocks, Text(how.strip(), small=True)]


def _rest(found: query.WhatIf) -> str:
    said = "" if found.settled else "The order of neighbouring lines is not settled. "
    said += "".join(f"{text.sentence(one)} " for one in rendering.absent(found))
    if not found.indices.empty:
        said += (
            "Alone and in all: closed and total Sobol' index, from "
            f"{int(found.indices['pairs'].max())} pairs of joints."
        )
    return said
