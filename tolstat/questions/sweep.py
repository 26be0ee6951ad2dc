"""Loads of a sweep: largest force and torque of every bushing against the swept value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import Fault, NotApplicable
from tolstat.common.load_kinds import Kind
from tolstat.common.loads import PANELS, QUANTITY, UNIT_OF_LOAD, FloatArray, names_of, unit_text
from tolstat.common.strict import read_section
from tolstat.common.tables import ERROR_FIELDS, FAILED, SIMULATED, UNSETTLED, Status
from tolstat.common.units import DISPLAY_UNITS
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Part, Sheet, Table
from tolstat.display.blocks import Panel, Panels
from tolstat.display.mpl import lines, ticker
from tolstat.display.table import Row, Rows, plain
from tolstat.store import recorded
from tolstat.store.view import View
from tolstat.study.selection import UNITS
from tolstat.study.swept import KEYS

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Mask = NDArray[np.bool_]
MAX_LEGEND = 6
"""Maximum number of values of the second swept quantity in the legend."""


def sweep(view: View) -> Answer:
    """Compare the largest loads of the joints of a sweep.

    Parameters
    ----------
    view : View
        A campaign of the method ``sweep``.

    Returns
    -------
    Answer
        Table ``sweep``: one row per joint, pending and failed ones included, with the swept values, headed by label and
        unit for the reader (``pin*.diameter [mm]``); ``status``; force and torque of each bushing, SI, headed likewise;
        ``psi``. Loads that the study does not keep are left out. Pictures of the loads against the first swept value.

    Raises
    ------
    NotApplicable
        When the campaign is no sweep.
    """
    if view.method != "sweep":
        remedy = "give the result file of a study with [sweep]"
        raise NotApplicable(str(Fault(str(view.path), "holds no sweep", remedy)))
    rows = _rows(view)
    seen = [_short(row) for row in rows]
    names = [name for name in (seen[0] if seen else ()) if "." in name]
    table = Table("sweep", "Worst bushing", plain(seen, names[1:]), rows, seen=seen)
    pictures: list[Part] = [Panels(_panels(view)), Sheet("sweep", partial(sheet, view))] if view.bushing_loads else []
    return Answer("sweep", "Loads against the swept value", [*pictures, table])


def _rows(view: View) -> Rows:
    columns: dict[str, Sequence[object]] = {_head(axis): axis.values.tolist() for axis in swept_axes(view)}
    columns["status"] = [Status(int(code)).label for code in view.status]
    names = dict.fromkeys([*view.shown_loads, *(name for name in view.kept_loads if name == "psi")])
    for load in view.loads(list(names)):
        head = load.name if load.unit == "1" else f"{load.name} [{load.unit}]"
        columns[head] = view.simulated(load.name).tolist()
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _short(row: Row) -> Row:
    """Row for people: largest force and torque of the cross bushings and of the fork bushings."""
    groups = {f"{group}.{kind.symbol} [{kind.unit}]": names_of(group, kind) for group, kind in PANELS}
    loads = {f"{name} [{UNIT_OF_LOAD[name]}]" for names in groups.values() for name in names}
    short = {key: value for key, value in row.items() if key not in loads}
    for head, names in groups.items():
        held = [row[key] for name in names if (key := f"{name} [{UNIT_OF_LOAD[name]}]") in row]
        if held:
            short[head] = float(np.fmax.reduce(held))
    return short


def _panels(view: View) -> list[Panel]:
    room = drawing.legend_room(key(view)[1])
    return [
        Panel(
            f"sweep-{group}-{kind.symbol}",
            f"{group.capitalize()} bushings, {QUANTITY[kind.unit]}",
            f"Largest {QUANTITY[kind.unit]}s of the {group} bushings against the swept value",
            partial(_with_legend, view=view, group=group, kind=kind),
            (4.9, 3.3 + room),
            top=room,
        )
        for group, kind in PANELS
        if any(name in view.bushing_loads for name in names_of(group, kind))
    ]


def _with_legend(ax: Axes, view: View, group: str, kind: Kind) -> None:
    panel(ax, view, group, kind)
    drawing.legend_above(ax, *key(view))


def sheet(view: View) -> Figure:
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
    ax.xaxis.set_major_locator(ticker.MaxNLocator(6))
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
    """Colours of `style.shades` for so many values, in order."""
    shades = style.shades()
    return [shades[i] for i in np.linspace(0, len(shades) - 1, count).round().astype(int)]


def key(view: View) -> tuple[list[Artist], list[str]]:
    """Handles and labels of a panel's legend."""
    axes = swept_axes(view)
    handles: list[Artist]
    if len(axes) < 2:
        handles = [
            lines.Line2D([], [], color=c, ls=d, marker="o", ms=3.2)
            for c, d in zip(style.COLOURS, style.DASHES, strict=True)
        ]
        labels = [f"bushing {i}" for i in (1, 2, 3, 4)]
    else:
        second = np.unique(axes[1].values)
        named = np.unique(np.linspace(0, second.size - 1, MAX_LEGEND).round().astype(int))
        shades = _shades(second.size)
        handles = [lines.Line2D([], [], color=shades[i], marker="o", ms=3.2) for i in named]
        labels = [f"{second[i]:.4g} {axes[1].unit}".strip() for i in named]
    if len(view.nominal):
        handles.append(lines.Line2D([], [], color=style.FAINT, lw=1.1, ls=(0.0, (1.0, 2.0))))
        labels.append("nominal joint, largest")
    if view.count(*UNSETTLED):
        handles.append(lines.Line2D([], [], ls="", marker="o", ms=6.5, mfc="white", mec=style.INK))
        labels.append("not settled")
    if view.count(*FAILED):
        handles.append(lines.Line2D([], [], ls="", marker="x", color=style.INK))
        labels.append("no result")
    return handles, labels


class Axis(NamedTuple):
    """One independently swept quantity.

    Attributes
    ----------
    label : str
        The study's pattern, such as ``pin*.diameter``, or the error's name.
    unit : str
        Display unit, such as ``mm``.
    values : ndarray, shape (n,)
        Value at each joint, in `unit`.
    """

    label: str
    unit: str
    values: FloatArray


def swept_axes(view: View) -> list[Axis]:
    """Quantities that a sweep varies, in the study's order.

    Errors and dimensions with equal values in every joint are swept together and form one axis.

    Parameters
    ----------
    view : View
        A campaign with the sampling method ``sweep``.

    Returns
    -------
    list of Axis
        Empty when nothing varies.
    """
    patterns = _patterns(read_section(view.store.path, view.store.study_text, "sweep"))
    errors = view.errors(np.arange(view.n))
    columns = {(field.name, field.unit): errors[field.name] for field in ERROR_FIELDS}
    if len(view.parts) == 1:  # of several operating points none is swept
        own = recorded.operating_points(view.store, slice(view.store.first_sample, None))
        columns |= {(f"operation.{key}", UNITS[f"operation.{key}"]): values for key, values in own.items()}
    if view.store.variants:
        columns |= {(key, KEYS[key]): of[view.store.first_sample :] for key, of in recorded.swept(view.store).items()}
    groups: dict[bytes, list[tuple[str, str]]] = {}
    for key, column in columns.items():
        if column.size and np.ptp(column) > 0:
            groups.setdefault(column.tobytes(), []).append(key)
    axes = []
    for keys in groups.values():
        names = [name for name, _ in keys]
        unit, factor = DISPLAY_UNITS.get(keys[0][1], (keys[0][1], 1.0))
        values = columns[keys[0]] * factor
        values[np.abs(values) < 1e-12 * np.abs(values).max()] = 0.0  # rounding error of a sweep through zero
        axes.append(Axis(_label(names, patterns), unit, values))
    rank = {pattern: i for i, pattern in enumerate(patterns)}
    return sorted(axes, key=lambda axis: rank.get(axis.label, len(rank)))


def _patterns(table: Mapping[str, Any], before: str = "") -> list[str]:
    """Key paths of the entries of ``[sweep]``, whether quoted or dotted."""
    found = []
    for key, value in table.items():
        nested = isinstance(value, Mapping) and "from" not in value
        found += _patterns(value, f"{before}{key}.") if nested else [f"{before}{key}"]
    return found


def _label(names: list[str], patterns: list[str]) -> str:
    for pattern in patterns:
        if all(fnmatchcase(name, pattern) for name in names):
            return pattern
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
