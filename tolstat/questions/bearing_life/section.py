"""Section of the page: lives of the bearings, share of the joints below the required life, how bearings are loaded."""

from __future__ import annotations

from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.bearing_life import query, rendering
from tolstat.questions.bearing_life.lives import bearing_of, lives_of
from tolstat.store.view import View


def sections(view: View, asked: Asked) -> list[Section]:
    """Section on bearing life, for samples of joints with bearings; none before the first joint has a result."""
    if not (view.sampled and view.count(*VALID)) or bearing_of(view) is None:
        return []
    with asked.noting("bearing life is left out"):
        return [_section(view)]
    return []


def _section(view: View) -> Section:
    lives = lives_of(view)
    quantiles, below, contacts = query.quantiles(lives), query.below(lives), query.contacts(view)
    table = rendering.by_place(quantiles)
    first, *others = rendering.verdict(lives, below, quantiles)
    blocks: list[Block] = [Text(text.sentence(first)), *(Text(text.sentence(line), small=True) for line in others)]
    draw = rendering.curve(lives)
    if draw is not None:
        said = f"Share of the joints whose bearings fail before a time, against that time. {text.sentence(first)}"
        blocks.append(Panels([Panel("bearing-life", "Life of the joints", said, draw, (6.4, 3.5))]))
        blocks.append(
            as_block(f"Life {lives.bearing.symbol} that a share of the joints reaches", rendering.LIVES, table)
        )
    if len(below) and draw is not None:
        title = f"Joints that do not reach the required {rendering.hours(lives.required)}"
        blocks.append(as_block(title, rendering.BELOW, below))
    loads = "Dynamic equivalent load P of a bearing, which a share of the joints stays below"
    blocks.append(as_block(loads, rendering.LOADS, rendering.of_pins(table)))
    if len(contacts):
        title = "Joints in which a bearing is loaded so for more than half of a revolution"
        blocks.append(as_block(title, rendering.CONTACTS, contacts))
    blocks += [Text(text.sentence(line), small=True) for line in rendering.notes(lives, contacts)]
    return Section("bearing-life", "Bearing life", blocks)
