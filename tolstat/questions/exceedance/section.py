"""Exceedance on the page: curves of the leading loads, the reader, quantiles; loads of a sweep."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tolstat.analysis.binomial import simultaneous
from tolstat.analysis.sample import Sample
from tolstat.common.load_kinds import Kind
from tolstat.common.loads import LOADS, PANELS, QUANTITY, load_of, names_of
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, ResultFile, Section, Table, Text
from tolstat.display.table import Rows, as_block
from tolstat.questions.exceedance import curves_figure, query, rendering, sweep
from tolstat.store.recorded import joint_of
from tolstat.store.view import View

THIN_LEVELS = 80
"""Maximum number of points of a curve without a band."""


def sections(view: View, asked: Asked) -> list[Section]:
    """Loads of a sweep against the swept value; exceedance of every load of other campaigns."""
    if view.method == "sweep":
        return [_of_sweep(view)]
    if not (view.shown_loads and view.count(*VALID)):
        return []
    blocks: list[Block] = [Panels([_leading_panel(view, name) for name in view.leading])] if view.leading else []
    blocks.append(Text(_note(view), small=True))
    limits = query.limit_rows(view)
    blocks.append(ResultFile(query.readings(view), _read_first(view, limits)))
    blocks.append(_quantiles(view))
    if view.limits and view.sampled and view.numerical_error:
        title = "What makes the shares above limits uncertain, in per cent of the joints"
        blocks.append(as_block(title, rendering.BUDGET, limits))
    return [Section("exceedance", "Which load is exceeded by which share", blocks)]


def _read_first(view: View, limits: Rows) -> str:
    """Load that the reader begins with: that of the limit which the verdict names; without limits a leading load."""
    return str(query.most_exceeded(view, limits)["load"]) if limits else view.most_exceeded


def _note(view: View) -> str:
    said = text.sentence(rendering.note(view))
    if len(view.nominal):
        said += f" Triangle: the joint without errors.{_beyond(view)}"
    if len(view.points) > 1:
        said += " Loads are the largest over all operating points, unless they name some."
    missing = query.not_kept(view)
    return f"{said} {text.sentence(missing)}" if missing else said


def _beyond(view: View) -> str:
    """Why the force without errors is smaller than T/(2 R); empty where it is not, or at several operating points."""
    forces = [view.load(name).nominal for name in ("cross1.F", "cross2.F") if name in view.bushing_loads]
    if not forces or len(view.points) > 1:
        return ""
    torque, radius = abs(view.store.operation.torque), joint_of(view.store, 0).cross.R
    if not max(forces) < torque / (2.0 * radius):
        return ""
    at_middle = text.value(torque / (2.0 * radius), "N")
    return f" Its force on the cross is below T/(2 R) = {at_middle}: without errors pins bear at their outer ends."


def _described(load: Sample) -> str:
    half, few = (text.value(load.quantile(share).estimate, load.unit) for share in (0.5, 0.99))
    return f"{load.name}: half of the joints exceed {half}, 1 % {few}"


def _leading_panel(view: View, name: str) -> Panel:
    """Curve of a leading load with its band; on switches the other bushings, and a band for the whole curve."""
    load, plain = view.load(name), view.narrowed(name)[1]
    others = [other for other in view.bushing_loads if other != plain and plain in view.bushing_loads]
    others = [other for other in others if LOADS[other].kind == LOADS[plain].kind]
    others = [f"{other}{name.removeprefix(plain)}" for other in others]
    switches = [("others", "other bushings, without bands (cross solid, fork dashed)")] if others else []
    if view.design.has_interval("band"):
        switches.append(("curve-band", "95 % band for the whole curve (DKW)"))
    return Panel(
        f"leading-{name}",
        f"{name}: share of the joints above x",
        _described(load) if load.valid.size else f"{name}: no joint with a valid result",
        partial(_leading, view=view, load=load, others=others),
        (4.9, 3.7),
        reads=(name, *others),
        switches=switches,
    )


def _leading(ax: Axes, view: View, load: Sample, others: list[str]) -> None:
    """One load with its band, limit and nominal joint; other loads as thin lines, and the band for all x, switched."""
    table = query.curve(load, 0.95, curves_figure.DRAWN_LEVELS)
    if not len(table):
        drawing.empty(ax, "no joint with a valid result")
        return
    known = [other for other in view.loads(others) if other.valid.size]
    thin = {other.name: query.curve(other, 0.95, THIN_LEVELS) for other in known}
    levels = np.concatenate([table["level"], *(own["level"] for own in thin.values())])
    low, high = curves_figure.axis_range(levels, [] if load.limit is None else [load.limit])
    floor = 0.5 * load.design.smallest(table["n"][0], table["estimate"])
    ax.set_xlim(low, high)
    style.share_axis(ax, floor)
    curves_figure.steps(ax, table, 0, low, floor)
    x = np.concatenate([[low], table["level"][1:]])
    if view.design.has_interval("band"):
        half = simultaneous(load.valid.size)
        for end in (table["bound_upper"] + half, table["bound_lower"] - half):
            drawn = ax.step(x, end.clip(1e-3 * floor, 1.0), where="post", color=style.INK, lw=0.9, ls=(0.0, (4.0, 2.0)))
            drawing.switched(drawn[0], "curve-band")
    for other, own in thin.items():
        dash = "-" if load_of(other).place.group == "cross" else (0.0, (4.0, 1.5))
        along, shares = np.append(low, own["level"][1:]), own["estimate"].clip(1e-3 * floor, 1.0)
        drawn = ax.step(along, shares, where="post", color=style.FAINT, lw=0.7, ls=dash)
        drawing.switched(drawn[0], "others")
    if load.limit is not None:
        curves_figure.limit_lines(ax, {load.limit: [1, 2, 3, 4]}, load.unit)
    if low <= load.nominal <= high:
        style.mark(ax, load.nominal, 1.0, style.COLOURS[0])
    ax.xaxis.set_major_locator(MaxNLocator(5 if load.unit != "1" else 3))
    unit = drawing.loads_axis(ax.xaxis, load.limit or high, load.unit)
    ax.set_xlabel(f"x: {load.name} [{unit or '1'}], largest over the revolution")
    ax.set_ylabel("share of joints above x")


def _quantiles(view: View) -> Table:
    """Quantiles of every load with their intervals, and its tolerance limit."""
    table = rendering.by_load(query.quantile_rows(view))
    title = f"Quantiles with 95 % intervals {view.design.of_quantiles}, and one-sided tolerance limits (Wilks)"
    columns = rendering.quantile_columns(query.tolerance_limits(view))
    return as_block(title if view.design.has_interval("quantile") else "Quantiles", columns, table)


def _of_sweep(view: View) -> Section:
    """Loads against the swept value."""
    room = drawing.legend_room(sweep.key(view)[1])
    panels = [
        Panel(
            f"sweep-{group}-{kind.symbol}",
            f"{group.capitalize()} bushings, {QUANTITY[kind.unit]}",
            f"Largest {QUANTITY[kind.unit]} of the {group} bushings against the swept value",
            partial(_sweep, view=view, group=group, kind=kind),
            (4.9, 3.3 + room),
            top=room,
        )
        for group, kind in PANELS
        if any(name in view.bushing_loads for name in names_of(group, kind))
    ]
    table = sweep.worst(view)
    rows = [[f"{x:.5g}" if isinstance(x, float) else str(x) for x in row] for row in table.itertuples(index=False)]
    blocks: list[Block] = [Panels(panels)] if panels else []
    blocks.append(Table("Worst bushing", list(table.columns), rows))
    return Section("sweep", "Loads against the swept value", blocks)


def _sweep(ax: Axes, view: View, group: str, kind: Kind) -> None:
    sweep.panel(ax, view, group, kind)
    drawing.legend_above(ax, *sweep.key(view))
