"""Orders of the shafts' loads on the page, where the study asks for loads of the shafts."""

from __future__ import annotations

from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panels, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.orders import query, rendering
from tolstat.store.view import View

INTRODUCTION = (
    "Amplitudes of what the shafts hand on, at multiples of the input speed. Forces and moments across a shaft are "
    "taken in axes that do not turn: the amplitude is the longer half axis of the ellipse on which the vector moves. "
    "In an orbit the dot is the input angle 0, and the arrow points on."
)


def sections(view: View, asked: Asked) -> list[Section]:
    """Amplitudes and orbits of samples of a production; orbits where the page shows histories at all."""
    if not (view.sampled and view.count(*VALID) and query.are_asked(view)):
        return []
    blocks: list[Block] = []
    with asked.noting("no orders of the shafts' loads"):
        found = query.orders_of(view, orbits=asked.replay > 0)
        blocks += [Text(INTRODUCTION), Panels(rendering.panels(found))]
        blocks.append(as_block("Amplitudes over the joints", rendering.COLUMNS, found.table))
        blocks += [Text(text.sentence(line), small=True) for line in rendering.note(found).splitlines()]
    return [Section("orders", "Orders of what the shafts carry", blocks)] if blocks else []
