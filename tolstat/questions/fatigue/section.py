"""Section of the page: load spectra, damage-equivalent loads and damage sums of the channels loaded most."""

from __future__ import annotations

from functools import partial

import pandas as pd
from matplotlib.axes import Axes

from tolstat.common.tables import Status
from tolstat.display import drawing, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.fatigue import query, rendering
from tolstat.questions.fatigue.query import Loading
from tolstat.store.view import View

JOINTS = 5000
"""Maximum number of samples, the first ones, whose cycles are evaluated: more add little and take memory."""


def sections(view: View, asked: Asked) -> list[Section]:
    """Section on fatigue; none for a sweep, a file without histories, or one without a settled joint."""
    if view.store.history_specs and view.method != "sweep" and view.count(Status.OK):
        with asked.noting("load cycles are left out"):
            return [_section(query.load_cycles([view], samples=JOINTS))]
    return []


def _section(loading: Loading) -> Section:
    loads, damages = query.equivalent_loads(loading), query.damages(loading)
    leading = query.leading(loads)
    shown = rendering.by_channel(loads[loads["channel"].isin(leading)].sort_values(["channel", "m", "share"]))
    blocks: list[Block] = [Panels([_panel(loading, channel) for channel in leading])] if leading else []
    blocks.append(as_block("Damage-equivalent loads", rendering.LOADS, shown))
    if len(damages):
        blocks.append(as_block("Damage sum of the service life", rendering.DAMAGES, damages))
    lines = rendering.notes(loading, loads).splitlines()
    blocks += [Text(text.sentence(line), small=True) for line in lines]
    return Section("fatigue", "Fatigue", blocks)


def _panel(loading: Loading, channel: str) -> Panel:
    spectrum = query.spectra(loading, [channel])
    return Panel(
        f"spectrum-{channel.replace('.', '-')}",
        f"{channel}: load spectrum",
        f"Ranges of {channel} that so many cycles a revolution reach, for half, 90 and 99 % of the joints",
        partial(_draw, spectrum=spectrum, revolutions=loading.settings.revolutions),
        (4.9, 3.5),
        top=drawing.legend_room(rendering.key()[1]),
    )


def _draw(ax: Axes, spectrum: pd.DataFrame, revolutions: float) -> None:
    rendering.panel(ax, spectrum, revolutions)
    drawing.legend_above(ax, *rendering.key())
