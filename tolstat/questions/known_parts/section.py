"""Tolerances known from measured parts on the page: what joints and parts leave open of each share."""

from __future__ import annotations

from functools import partial

import numpy as np

from tolstat.display import drawing, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.known_parts import query, rendering
from tolstat.store import known_parts
from tolstat.store.view import View

DRAWN = 6
"""Maximum number of shares in the picture."""


def sections(view: View, asked: Asked) -> list[Section]:
    """Three intervals of each share; none where the tolerances are taken as exact."""
    known = known_parts.of(view)
    if known is None or not view.counts.done:
        return []
    table = query.intervals(view)
    blocks: list[Block] = []
    given = table[table["both_upper"].notna()].head(DRAWN)
    if len(given):
        labels = [text.limit(row) for row in given.to_dict("records")]
        left = drawing.rows_left(labels)
        top = drawing.legend_room(rendering.LABELS, left)
        size = (drawing.WIDTH, 0.47 * len(given) + drawing.BOTTOM + top + 0.1)
        said = "; ".join(
            f"{row['load']}: {text.span(row['both_lower'], row['both_upper'])}" for row in given.to_dict("records")
        )
        draw = partial(rendering.forest, table=given)
        panel = Panel(
            "known-parts", "What joints and parts leave open", f"Intervals of both: {said}", draw, size, left, top
        )
        blocks.append(Panels([panel], beside=[Text(line, small=True) for line in _how(view)]))
    blocks.append(as_block("Shares above the limits, with what leaves them open", rendering.INTERVALS, table))
    if len(given) < min(len(table), DRAWN):
        most = text.percent(float(np.max(table["unsupported"])))
        blocks.append(Text(f"The joints do not support {most} of the likely processes. {known.remedy}."))
    return [Section("known-parts", "Tolerances known from measured parts", blocks)]


def _how(view: View) -> list[str]:
    known = known_parts.of(view)
    assert known is not None
    entries = ", ".join(f"{entry.pattern} from {entry.parts}" for entry in known.entries)
    return [
        f"Mean and deviation are estimated from measured parts: {entries}.",
        "Joints: the tolerances are as stated, and the joints are a sample. Parts: the process may be any that the "
        "parts make likely. Both: the verdict's, with joints without a valid load and the numerical error. Grey line: "
        "the share at the tolerances as stated.",
    ]
