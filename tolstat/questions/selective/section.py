"""Selective assembly on the page: the classes, and the parts without a partner."""

from __future__ import annotations

from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Section, Text
from tolstat.display.table import as_block
from tolstat.questions.selective import query, rendering
from tolstat.store.view import View


def sections(view: View, asked: Asked) -> list[Section]:
    """Classes of a campaign whose pins and holes are sorted."""
    if not view.store.sampling.get("selective") or not view.count(*VALID):
        return []
    with asked.noting("no classes"):
        found = query.classes_of(view)
        assert found is not None
        said = f"{text.percent(found.unmatched)} of the crosses and forks have no partner of their class."
        if view.limits:
            row = query.assembled([view]).table.iloc[0]
            ends = text.span(row["good_lower"], row["good_upper"])
            said += f" {text.percent(row['good'])} of the assembled joints keep all limits (total interval {ends})."
        table = as_block("Classes by measured diameter, deviation from nominal", rendering.CLASSES, query.parts(found))
        notes = [Text(text.sentence(line), small=True) for line in rendering.NOTE.splitlines()]
        return [Section("selective", "Selective assembly", [Text(said), table, *notes])]
    return []
