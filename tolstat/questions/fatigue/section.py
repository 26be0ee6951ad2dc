"""Section of the page: failures of the parts; load spectra, damage-equivalent loads and damage of the channels."""

from __future__ import annotations

from functools import partial

import pandas as pd
from matplotlib.axes import Axes

from tolstat.common.tables import Status
from tolstat.display import drawing, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Text
from tolstat.display.table import as_block
from tolstat.questions.fatigue import parts_rendering, query, rendering
from tolstat.questions.fatigue.parts import part_failures
from tolstat.questions.fatigue.query import Loading
from tolstat.questions.fatigue.stress import Stressed, load_stresses
from tolstat.store.revolutions import held
from tolstat.store.view import View
from tolstat.study.fatigue import of_text

JOINTS = 5000
"""Maximum number of samples, the first ones, whose cycles are evaluated: more add little and take memory."""


def sections(view: View, asked: Asked) -> list[Section]:
    """Section on fatigue; none for a sweep, without a settled joint, or without histories and points."""
    blocks: list[Block] = []
    if view.method != "sweep" and view.count(Status.OK):
        with asked.noting("load cycles are left out"):
            points = of_text(view.store.study_text, str(view.path)).points
            joints = JOINTS if held(view.store) else min(asked.replay, JOINTS)
            if points and joints:
                blocks += _parts(load_stresses([view], samples=joints))
            if view.store.history_specs:
                blocks += _loads(query.load_cycles([view], samples=JOINTS))
    return [Section("fatigue", "Fatigue", blocks)] if blocks else []


def _parts(stressed: Stressed) -> list[Block]:
    failures = part_failures(stressed)
    panel = Panel(
        "failures-over-life",
        "Share of the joints with a failed part, with pointwise 95 % intervals",
        "Share of the joints in which a part has failed, against revolutions of the input shaft",
        partial(parts_rendering.panel, stressed=stressed, failures=failures),
        (6.5, 3.6),
    )
    lines = parts_rendering.notes(stressed, failures).splitlines()
    return [
        Panels([panel]),
        as_block("Parts", parts_rendering.PARTS, failures),
        *(Text(text.sentence(line), small=True) for line in lines),
    ]


def _loads(loading: Loading) -> list[Block]:
    loads, damages = query.equivalent_loads(loading), query.damages(loading)
    leading = query.leading(loads)
    shown = rendering.by_channel(loads[loads["channel"].isin(leading)].sort_values(["channel", "m", "share"]))
    blocks: list[Block] = [Panels([_panel(loading, channel) for channel in leading])] if leading else []
    blocks.append(as_block("Damage-equivalent loads", rendering.LOADS, shown))
    if len(damages):
        blocks.append(as_block("Damage sum of the service life", rendering.DAMAGES, damages))
    lines = rendering.notes(loading, loads).splitlines()
    blocks += [Text(text.sentence(line), small=True) for line in lines]
    return blocks


def _panel(loading: Loading, channel: str) -> Panel:
    spectrum = query.spectra(loading, [channel])
    return Panel(
        f"spectrum-{channel}",
        f"{channel}: load spectrum",
        f"Ranges of {channel} that so many cycles a revolution reach, for half, 90 and 99 % of the joints",
        partial(_draw, spectrum=spectrum, revolutions=loading.settings.revolutions),
        (4.9, 3.5),
        top=drawing.legend_room(rendering.key()[1]),
    )


def _draw(ax: Axes, spectrum: pd.DataFrame, revolutions: float) -> None:
    rendering.panel(ax, spectrum, revolutions)
    drawing.legend_above(ax, *rendering.key())
