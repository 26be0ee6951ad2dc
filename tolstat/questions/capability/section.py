"""Capability on the page: yield, ppm and Cpk against the limits; rare loads."""

from __future__ import annotations

from functools import partial

import pandas as pd

from tolstat.common.aside import mapped
from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.capability import query, rendering
from tolstat.store import known_parts
from tolstat.store.view import View

ONE_IN = (1e3, 1e4, 1e5)


def sections(view: View, asked: Asked) -> list[Section]:
    """Capability against each limit and all together, and rare loads; for samples of joints of equal weight."""
    if not (view.sampled and view.count(*VALID)) or view.design.refuses("index"):
        return []
    blocks: list[Block] = []
    if view.limits:
        table = query.limits(view)
        blocks.append(as_block("Against each limit, and all of them together", rendering.LIMITS, table))
        blocks += [Text(text.sentence(line), small=True) for line in rendering.note(table).splitlines()]
    if known_parts.of(view) is not None:
        blocks.append(Text("For the tolerances as stated: what measured parts leave open is not in these.", small=True))
    blocks += _rare(view, min(asked.processes, 2))
    title = "Capability and rare loads" if view.limits else "Rare loads"
    return [Section("capability", title, blocks)] if blocks else []


def _rare(view: View, processes: int) -> list[Block]:
    tables, said = [], dict[str, list[str]]()
    found = mapped([partial(_returns, view, name) for name in view.leading], processes)
    for name, table in zip(view.leading, found, strict=True):
        if isinstance(table, pd.DataFrame):
            tables.append(table)
        else:
            said.setdefault(table, []).append(name)
    title = "Rare loads, from a generalised Pareto tail"
    blocks: list[Block] = [as_block(title, rendering.RETURNS, pd.concat(tables))] if tables else []
    if said:
        words = [f"{', '.join(names)}: {reason}" for reason, names in said.items()]
        blocks.append(Text(f"Rare loads. {'; '.join(words)}.", small=True))
    return blocks


def _returns(view: View, name: str) -> pd.DataFrame | str:
    """Return loads of one load, or why it has none."""
    try:
        table = query.returns(view, [name], ONE_IN)
    except ValueError as error:
        return str(error)
    return rendering.no_tail(table).removeprefix(f"{name}: ") or table
