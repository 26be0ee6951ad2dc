"""Numerical error on the page."""

from __future__ import annotations

from tolstat.display import text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.accuracy import query, rendering
from tolstat.store.view import View


def sections(view: View, asked: Asked) -> list[Section]:
    """Numerical error of the loads, measured or estimated on some joints; needs a verification."""
    if view.verification is None:
        return []
    blocks: list[Block] = [Text(text.sentence(rendering.note(view.verification, view.limits)))]
    title = "Relative to the largest load of its kind in the joint"
    blocks.append(as_block(title, rendering.ERRORS, query.distribution(view.verification)))
    return [Section("accuracy", "Numerical error", blocks)]
