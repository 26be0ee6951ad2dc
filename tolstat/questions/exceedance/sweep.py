"""Loads of a sweep: largest force and torque of every bushing against the swept value."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from tolstat.common.load_kinds import Kind
from tolstat.common.loads import PANELS, UNIT_OF_LOAD, names_of, unit_text
from tolstat.common.tables import FAILED, SIMULATED, UNSETTLED, Status
from tolstat.display import style, text
from tolstat.questions.exceedance.swept_axes import Axis, swept_axes
from tolstat.store.view import View

Mask = NDArray[np.bool_]
MAX_LEGEND = 6
"""Maximum number of values of the second swept quantity in the legend."""


def table(view: View) -> pd.DataFrame:
    """Largest loads of every joint of a sweep.

    Parameters
    ----------
    view : View
        A campaign of the method ``sweep``.

    Returns
    -------
    DataFrame
        One row per joint, pending and failed ones included: the swept values, headed by label and unit
        for the reader (``pin*.diameter [mm]``); ``status``; force and torque of each bushing, SI, headed likewise;
        ``psi``. Loads that the study does not keep have no column.
    """
    columns: dict[str, object] = {_head(axis): axis.values for axis in swept_axes(view)}
    columns["status"] = [Status(int(code)).label for code in view.status]
    names = dict.fromkeys([*view.shown_loads, *(name for name in view.kept_loads if name == "psi")])
    for load in view.loads(list(names)):
        columns[load.name if load.unit == "1" else f"{load.name} [{load.unit}]"] = view.simulated(load.name)
    return pd.DataFrame(columns)


def worst(view: View) -> pd.DataFrame:
    """Short form of `table`: largest force and torque of the cross bushings and of the fork bushings."""
    full = table(view)
    loads = [c for c in full.columns if str(c).partition(" ")[0] in UNIT_OF_LOAD] if view.bushing_loads else []
    short = full[[c for c in full.columns if c not in loads]].copy()
    for group, kind in PANELS:
        columns = [column for name in names_of(group, kind) if (column := f"{name} [{kind.unit}]") in loads]
        if columns:
            short[f"{group}.{kind.symbol} [{kind.unit}]"] = full[columns].max(axis=1)
    return short


def figure(view: View) -> Figure:
    """Draw the loads against the first swept quantity.

    One swept quantity gives a line for each bushing. Several give a line for each combination of the others,
    of the largest load among the four bushings, coloured by the second.

    Parameters
    ----------
    view : View
        A campaign of the method ``sweep``.

    Returns
    -------
    Figure
        Four panels; joints that did not settle are hollow, those without a result are crosses at the foot.
    """
    axes = swept_axes(view)
    with style.settings():
        title = f"{view.name}: largest loads against " + (axes[0].label if axes else "the joint's number")
        page, panels = style.panels(title, f"{view.head()}\n{_note(axes)}")
        for group, kind, ax in panels:
            panel(ax, view, group, kind)
        style.legend(page, *key(view))
    return page


def panel(ax: Axes, view: View, group: str, kind: Kind) -> None:
    """Draw the loads of one kind at four bushings: ``cross`` or ``fork``."""
    axes = swept_axes(view)
    first = axes[0] if axes else Axis("joint", "", np.arange(1, view.n + 1, dtype=np.float64))
    ax.set_xlabel(_head(first))
    ax.xaxis.set_major_locator(MaxNLocator(6))
    ax.set_ylabel(f"largest |{kind.symbol}| [{unit_text(kind.unit)}]")
    _lines(ax, view, [first, *axes[1:]], group, kind)


def _head(axis: Axis) -> str:
    return f"{axis.label} [{axis.unit}]" if axis.unit else axis.label


def _note(axes: list[Axis]) -> str:
    if len(axes) < 2:
        return "largest modulus over the last revolution of each joint"
    others = ", ".join(axis.label for axis in axes[2:])
    said = f"largest of the four bushings, coloured by {_head(axes[1])}"
    return said + (f"; one line for each {others}" if others else "")


def _lines(ax: Axes, view: View, axes: list[Axis], group: str, kind: Kind) -> None:
    number = {name: i for i, name in enumerate(names_of(group, kind))}
    names = [name for name in number if name in view.bushing_loads]
    if not names:
        ax.text(0.5, 0.5, "not kept by the study", ha="center", transform=ax.transAxes)
        ax.set(xticks=[], yticks=[])
        return
    loads = [view.simulated(name) for name in names]
    if len(axes) == 1:
        for name, values in zip(names, loads, strict=True):
            i = number[name]
            every = np.ones(values.size, dtype=bool)
            _line(ax, view, axes[0].values, values, every, style.COLOURS[i], style.DASHES[i])
    else:
        for colour, rows in _combinations(axes):
            _line(ax, view, axes[0].values, np.max(loads, axis=0), rows, colour, "-")
    if len(view.nominal):
        nominal = max(load.nominal for load in view.loads(names))
        ax.axhline(nominal, color=style.FAINT, lw=1.1, ls=(0.0, (1.0, 2.0)), zorder=1.5)
    limits = {view.limits[name] for name in names if name in view.limits}
    bottom, top = ax.get_ylim()
    for limit in sorted(limits):
        if limit < top + 0.5 * (top - bottom):
            ax.axhline(limit, color=style.INK, lw=1.3, ls=(0.0, (8.0, 3.0)))
            style.note(ax, f"limit {text.value(limit, kind.unit)}", limit)


def _line(
    ax: Axes,
    view: View,
    x: NDArray[np.float64],
    values: NDArray[np.float64],
    rows: Mask,
    colour: str,
    dash: style.Dash,
) -> None:
    """Draw one line over the joints `rows`; it is broken where a joint has no result."""
    order = np.flatnonzero(rows)[np.argsort(x[rows], kind="stable")]
    status = view.status[order]
    shown = np.where(np.isin(status, SIMULATED), values[order], np.nan)
    ax.plot(x[order], shown, color=colour, ls=dash, marker="o", ms=3.2, zorder=3)
    loose = np.isin(status, UNSETTLED)
    ax.plot(x[order][loose], shown[loose], ls="", marker="o", ms=6.5, mfc="white", mec=colour, zorder=4)
    gone = np.isin(status, FAILED)
    foot = np.full(int(gone.sum()), 0.02)
    ax.plot(x[order][gone], foot, ls="", marker="x", color=style.INK, transform=ax.get_xaxis_transform(), zorder=4)


def _combinations(axes: list[Axis]) -> list[tuple[str, Mask]]:
    """Colour and rows of every combination of the quantities after the first."""
    second = np.unique(axes[1].values)
    shades = dict(zip(second, _shades(second.size), strict=True))
    grid = np.column_stack([axis.values for axis in axes[1:]])
    return [(shades[point[0]], (grid == point).all(axis=1)) for point in np.unique(grid, axis=0)]


def _shades(count: int) -> list[str]:
    """Colours of `style.SHADES` for so many values, in order."""
    return [style.SHADES[i] for i in np.linspace(0, len(style.SHADES) - 1, count).round().astype(int)]


def key(view: View) -> tuple[list[Artist], list[str]]:
    """Handles and labels of a panel's legend."""
    axes = swept_axes(view)
    handles: list[Artist]
    if len(axes) < 2:
        handles = [
            Line2D([], [], color=c, ls=d, marker="o", ms=3.2) for c, d in zip(style.COLOURS, style.DASHES, strict=True)
        ]
        labels = [f"bushing {i}" for i in (1, 2, 3, 4)]
    else:
        second = np.unique(axes[1].values)
        named = np.unique(np.linspace(0, second.size - 1, MAX_LEGEND).round().astype(int))
        shades = _shades(second.size)
        handles = [Line2D([], [], color=shades[i], marker="o", ms=3.2) for i in named]
        labels = [f"{second[i]:.4g} {axes[1].unit}".strip() for i in named]
    if len(view.nominal):
        handles.append(Line2D([], [], color=style.FAINT, lw=1.1, ls=(0.0, (1.0, 2.0))))
        labels.append("nominal joint, largest")
    if view.count(*UNSETTLED):
        handles.append(Line2D([], [], ls="", marker="o", ms=6.5, mfc="white", mec=style.INK))
        labels.append("not settled")
    if view.count(*FAILED):
        handles.append(Line2D([], [], ls="", marker="x", color=style.INK))
        labels.append("no result")
    return handles, labels
