"""Exceedance on the page: curves with all their bands, the reader, quantiles; loads of a sweep."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from tolstat.analysis.exceedance import simultaneous
from tolstat.common.loads import unit_text
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Reader, Section, Table, Text
from tolstat.display.table import as_block
from tolstat.questions.exceedance import query, rendering, sweep
from tolstat.store.sample_load import SampleLoad
from tolstat.store.view import View

GROUPS = [(group, letter) for group in ("cross", "fork") for letter in "FT"]


def sections(view: View, asked: Asked) -> list[Section]:
    """Loads of a sweep against the swept value; exceedance of every load of other campaigns."""
    if view.method == "sweep":
        return [_of_sweep(view)]
    if not (view.shown_loads and view.count(*VALID)):
        return []
    blocks: list[Block] = [Panels([_bands_panel(view, name) for name in view.leading])] if view.leading else []
    blocks.append(Reader(query.readings(view)))
    panels = [
        Panel(
            f"curves-{group}-{letter}",
            _title(group, letter),
            _described(view.loads(names)),
            partial(_group, view=view, group=group, letter=letter),
            (4.9, 3.7),
            reads=tuple(names),
        )
        for group, letter in GROUPS
        if (names := _kept(view, group, letter))
    ]
    blocks += [Panels(panels)] if panels else []
    blocks += [Text(_note(view), small=True), _quantiles(view)]
    if view.limits and view.sampled and view.numerical_error:
        title = "What makes the shares above limits uncertain, in per cent of the joints"
        blocks.append(as_block(title, rendering.BUDGET, query.limits(view)))
    return [Section("exceedance", "Which load is exceeded by which share", blocks)]


def _title(group: str, letter: str) -> str:
    return f"{group.capitalize()} bushings, {'force' if letter == 'F' else 'torque'}"


def _kept(view: View, group: str, letter: str) -> list[str]:
    return [name for i in (1, 2, 3, 4) if (name := f"{group}{i}.{letter}") in view.bushing_loads]


def _note(view: View) -> str:
    said = text.sentence(rendering.note(view))
    if view.has_intervals:
        said += " Triangles: the joint without errors. Dotted: upper end where no joint exceeds x."
    missing = view.missing()
    return f"{said} {text.sentence(missing)}" if missing else said


def _described(loads: list[SampleLoad]) -> str:
    said = []
    for load in loads:
        half, few = (text.value(load.quantile(share).estimate, load.unit) for share in (0.5, 0.99))
        said.append(f"{load.name}: half of the joints exceed {half}, 1 % {few}")
    return "; ".join(said)


def _group(ax: Axes, view: View, group: str, letter: str) -> None:
    rendering.panel(ax, view, group, letter)
    handles = [Line2D([], [], color=c, ls=d) for c, d in zip(style.COLOURS, style.DASHES, strict=True)]
    labels = [f"{group}{i}" for i in (1, 2, 3, 4)]
    ax.set_ylabel("share of joints above x")
    if ax.get_yscale() == "log":
        ax.legend(handles, labels, loc="upper right", handlelength=2.6)


def _bands_panel(view: View, name: str) -> Panel:
    said = _described([view.load(name)]) if name in view.bushing_loads else ""
    return Panel(
        f"bands-{name.replace('.', '-')}",
        f"{name}: exceedance with all of its bands",
        said or f"share of the joints above each value of {name}",
        partial(_bands, view=view, load=view.load(name)),
        (4.9, 3.7),
        reads=(name,),
    )


def _bands(ax: Axes, view: View, load: SampleLoad) -> None:
    """One load: pointwise and simultaneous band, bounds of the unresolved joints, limit and nominal joint."""
    table = query.curve(load, 0.95, rendering.DRAWN_LEVELS)
    if not len(table):
        drawing.empty(ax, "no joint with a valid result")
        return
    low, high = rendering.axis_range(table["level"], [] if load.limit is None else [load.limit])
    n, floor = int(table["n"][0]), 0.5 * rendering.least(view, table)
    valid = load.valid.size
    ax.set_xlim(low, high)
    style.share_axis(ax, floor)
    rendering.steps(ax, table, 0, low, floor)
    handles: list[Any] = [Line2D([], [], color=style.COLOURS[0])]
    labels = ["joints above x"]
    if view.iid and not view.weighted:
        x = np.concatenate([[low], table["level"][1:]])
        half = simultaneous(valid)
        for end in (table["bound_upper"] + half, table["bound_lower"] - half):
            ax.step(x, np.clip(end, 1e-3 * floor, 1.0), where="post", color=style.INK, lw=0.9, ls=(0.0, (4.0, 2.0)))
        handles.append(Line2D([], [], color=style.INK, lw=0.9, ls="--"))
        labels.append("95 % for all x at once (DKW)")
    if view.has_intervals:
        handles.insert(1, Patch(color=style.COLOURS[0], alpha=0.25, lw=0))
        labels.insert(1, f"95 % at each x ({view.interval_of})")
    if valid < n:
        handles.append(Patch(color=style.COLOURS[0], alpha=0.12, lw=0))
        labels.append("with failed and unsettled joints")
    unit = unit_text(load.unit)
    if load.limit is not None:
        rendering.limit_lines(ax, {load.limit: [1, 2, 3, 4]}, unit)
    if low <= load.nominal <= high:
        style.mark(ax, load.nominal, 1.0, style.COLOURS[0])
    ax.legend(handles, labels, loc="upper right")
    ax.xaxis.set_major_locator(MaxNLocator(5 if load.unit != "1" else 3))
    ax.set_xlabel(f"x: {load.name} [{unit or '1'}], largest over the revolution")
    ax.set_ylabel("share of joints above x")


def _quantiles(view: View) -> Table:
    """Quantiles of every load with their intervals, and its tolerance limit."""
    table = rendering.by_load(query.quantiles(view))
    kind = "over replicates" if view.replicates > 1 else "of order statistics"
    title = f"Quantiles with 95 % intervals {kind}, and one-sided tolerance limits (Wilks)"
    columns = rendering.quantile_columns(query.tolerance_limits(view))
    return as_block(title if view.has_intervals else "Quantiles", columns, table)


def _of_sweep(view: View) -> Section:
    """Loads against the swept value."""
    panels = [
        Panel(
            f"sweep-{group}-{letter}",
            _title(group, letter),
            f"Largest {'forces' if letter == 'F' else 'torques'} of the {group} bushings against the swept value",
            partial(_sweep, view=view, group=group, letter=letter),
            (4.9, 3.6),
        )
        for group, letter in GROUPS
        if _kept(view, group, letter)
    ]
    table = sweep.worst(view)
    rows = [[f"{x:.5g}" if isinstance(x, float) else str(x) for x in row] for row in table.itertuples(index=False)]
    blocks: list[Block] = [Panels(panels)] if panels else []
    blocks.append(Table("Worst bushing", list(table.columns), rows))
    return Section("sweep", "Loads against the swept value", blocks)


def _sweep(ax: Axes, view: View, group: str, letter: str) -> None:
    sweep.panel(ax, view, group, letter)
    ax.legend(*sweep.key(view), loc="best", handlelength=2.6)
