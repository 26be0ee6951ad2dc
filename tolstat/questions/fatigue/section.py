"""Section of the page: load spectra, damage-equivalent loads and damage sums of the channels loaded most."""

from __future__ import annotations

from functools import partial
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from tolstat.common.tables import Status
from tolstat.display import text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Table, Text
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
    loads = query.equivalent_loads(loading)
    leading = query.leading(loads)
    blocks: list[Block] = [Panels([_panel(loading, channel) for channel in leading])] if leading else []
    blocks.append(_loads(loads[loads["channel"].isin(leading)]))
    damages = query.damages(loading)
    if len(damages):
        head = ["channel", "nominal damage", "median", "joints above 1", "share", "95 % interval"]
        sums = [_damage(row) for row in damages.to_dict("records")]
        blocks.append(Table("Damage sum of the service life", head, sums))
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
    )


def _draw(ax: Axes, spectrum: pd.DataFrame, revolutions: float) -> None:
    rendering.panel(ax, spectrum, revolutions)
    ax.legend(*rendering.key(), loc="upper right")


def _loads(shown: pd.DataFrame) -> Table:
    """Damage-equivalent loads, one row per channel and exponent."""
    rows = []
    ordered = shown.sort_values(["channel", "m", "share"])
    for (channel, m), part in ordered.groupby(["channel", "m"], sort=False):
        unit, highest = str(part["unit"].iloc[0]), part.iloc[-1]
        cells = [f"{channel}, m = {m:g}", text.value(float(part["nominal"].iloc[0]), unit)]
        cells += [text.value(x, unit) for x in part["estimate"]]
        rows.append([*cells, text.span_of(float(highest["lower"]), float(highest["upper"]), unit)])
    shares = [f"{100 * share:g} % stay below" for share in query.SHARES]
    return Table(
        "Damage-equivalent loads", ["channel and exponent", "nominal", *shares, "95 % interval of the last"], rows
    )


def _damage(row: dict[Any, Any]) -> list[str]:
    own = [row["channel"], f"{row['nominal']:.2g}", f"{row['median']:.2g}", f"{row['count']} of {row['n']}"]
    return [*own, text.percent(row["estimate"]), text.span(row["lower"], row["upper"])]
