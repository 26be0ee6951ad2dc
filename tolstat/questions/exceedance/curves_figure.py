"""Pictures of load exceedance: curves with their bands, limits and the nominal joint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from tolstat.analysis.estimates import CURVE
from tolstat.common.load_kinds import Kind
from tolstat.common.loads import PANELS, names_of
from tolstat.display import drawing, style, text
from tolstat.questions.exceedance.query import curve
from tolstat.questions.exceedance.rendering import note
from tolstat.store.view import View

DRAWN_LEVELS = 200
"""Maximum number of points of a curve in the picture."""
LIMIT_DASH, ZERO_DASH = (0.0, (8.0, 3.0)), (0.0, (1.0, 2.0))


def figure(view: View, confidence: float = 0.95) -> Figure:
    """Draw the exceedance curves of all bushing loads that the study keeps.

    Parameters
    ----------
    view : View
        The campaign; without a valid joint, the panels say so.
    confidence : float
        Confidence level of the bands.

    Returns
    -------
    Figure
        Four panels, empty where no load is kept; share of the joints on a logarithmic axis down to half a joint.
    """
    with style.settings():
        title = f"{view.name}: share of joints whose largest load exceeds x"
        page, panels = style.panels(title, f"{view.head()}\n{note(view)}")
        for group, kind, ax in panels:
            panel(ax, view, group, kind, confidence)
        _legend(page, view)
    return page


def panel(ax: Axes, view: View, group: str, kind: Kind, confidence: float = 0.95) -> None:
    """Draw the curves of the loads of one kind at four bushings: ``cross`` or ``fork``."""
    names = names_of(group, kind)
    tables = [
        curve(view.load(name), confidence, DRAWN_LEVELS) if name in view.bushing_loads else np.empty(0, CURVE)
        for name in names
    ]
    unit = kind.unit
    if kind == PANELS[0][1]:
        ax.set_ylabel("share of joints above x")
    levels = np.concatenate([table["level"] for table in tables])
    if not levels.size:
        held = any(name in view.bushing_loads for name in names)
        found = "no joint with a valid result" if held else "not kept by the study"
        ax.text(0.5, 0.5, found, ha="center", transform=ax.transAxes)
        ax.set(xticks=[], yticks=[])
        return
    marked = _limit_levels(view, names)
    low, high = axis_range(levels, list(marked))
    ax.set_xlim(low, high)
    shown = drawing.loads_axis(ax.xaxis, max(marked, default=high), unit)
    ax.set_xlabel(f"x: largest |{kind.symbol}| over the revolution [{shown}]")
    floor = 0.5 * min(view.design.smallest(table["n"][0], table["estimate"]) for table in tables if table.size)
    style.share_axis(ax, floor)
    for i, table in enumerate(tables):
        if table.size:
            steps(ax, table, i, low, floor)
            nominal = view.load(names[i]).nominal
            if low <= nominal <= high:
                style.mark(ax, nominal, 1.0, style.COLOURS[i])
    if view.design.has_interval("share"):
        ends = [table["outer_upper"][-1] for table in tables if table.size]
        ax.axhline(max(ends), color=style.FAINT, lw=1.1, ls=ZERO_DASH, zorder=1.5)
    limit_lines(ax, marked, unit)


def axis_range(levels: NDArray[np.float64], marked: list[float]) -> tuple[float, float]:
    """Range of the x axis: the loads, which are not negative, and the limits unless they lie far off."""
    low, high = float(levels.min()), float(levels.max())
    reach = max(high - low, 0.02 * abs(high), 1e-12)
    near = [x for x in marked if low - 0.8 * reach <= x <= high + 0.8 * reach]
    low, high = min([low, *near]), max([high, *near])
    margin = 0.05 * max(high - low, reach)
    return max(low - margin, min(low, 0.0)), high + margin


def steps(ax: Axes, table: NDArray[np.void], i: int, low: float, floor: float) -> None:
    """Draw one curve with its bands as steps; its first row is drawn from the left edge `low` on."""
    if not table.size:
        return
    x = np.concatenate([[low], table["level"][1:]])
    colour = style.COLOURS[i]

    def shown(field: str) -> NDArray[np.float64]:
        shares: NDArray[np.float64] = table[field].clip(1e-3 * floor, 1.0)
        return shares

    def band(lower: str, upper: str, alpha: float) -> None:
        ax.fill_between(x, shown(lower), shown(upper), step="post", color=colour, alpha=alpha, lw=0)

    iid = np.isfinite(table["lower"]).all()
    if iid:
        band("lower", "upper", 0.2)
    if table["n_failed"][0] + table["n_unsettled"][0]:
        band("outer_lower" if iid else "bound_lower", "outer_upper" if iid else "bound_upper", 0.1)
    ax.step(x, shown("estimate"), where="post", color=colour, ls=style.DASHES[i], zorder=3)


def _limit_levels(view: View, names: Sequence[str]) -> dict[float, list[int]]:
    """Limits of a panel: level -> numbers of the bushings that have it."""
    found: dict[float, list[int]] = {}
    for i, name in enumerate(names, 1):
        if name in view.limits:
            found.setdefault(view.limits[name], []).append(i)
    return dict(sorted(found.items()))


def limit_lines(ax: Axes, marked: dict[float, list[int]], unit: str) -> None:
    """Mark limits by vertical lines, labelled above the panel; an arrow stands for one out of range. SI `unit`."""
    labels: list[tuple[float, str, str]] = []
    low, high = ax.get_xlim()
    for level, numbers in marked.items():
        words = f"limit {text.value(level, unit)}" + ("" if len(numbers) == 4 else f" ({', '.join(map(str, numbers))})")
        colour = style.COLOURS[numbers[0] - 1] if len(numbers) == 1 else style.INK
        if low <= level <= high:
            ax.axvline(level, color=colour, lw=1.4, ls=LIMIT_DASH, zorder=2)
        else:
            words = f"{words} →" if level > high else f"← {words}"
        place = float(np.clip((level - low) / (high - low), 0.0, 1.0))
        labels = _without_overlap(labels, (place, words, colour))
    for place, words, colour in labels:
        side = "left" if place < 0.12 else "right" if place > 0.88 else "center"
        ax.text(
            place,
            1.015,
            words,
            transform=ax.transAxes,
            ha=side,
            va="bottom",
            size=0.9 * rcParams["font.size"],
            color=colour,
        )


def _without_overlap(labels: list[tuple[float, str, str]], new: tuple[float, str, str]) -> list[tuple[float, str, str]]:
    """Append a label, or merge it with the previous one if they would overlap (0.014 panel widths per letter)."""
    if not labels:
        return [new]
    place, text, _ = labels[-1]
    if new[0] - place > 0.007 * (len(text) + len(new[1])) + 0.02:
        return [*labels, new]
    joined = (0.5 * (place + new[0]), f"{text}, {new[1].replace('limit ', '')}", style.INK)
    return _without_overlap(labels[:-1], joined)


def _legend(page: Figure, view: View) -> None:
    handles: list[Artist] = [
        Line2D([], [], color=c, ls=dash) for c, dash in zip(style.COLOURS, style.DASHES, strict=True)
    ]
    labels = [f"bushing {i}" for i in (1, 2, 3, 4)]
    if view.design.has_interval("share"):
        handles += [Patch(color=style.FAINT, alpha=0.4, lw=0)]
        handles += [Line2D([], [], color=style.FAINT, lw=1.1, ls=ZERO_DASH)]
        labels += ["95 % band", "upper end where none exceeds x"]
    if len(view.nominal):
        handles.append(Line2D([], [], marker="v", color=style.FAINT, ls="", ms=7.5))
        labels.append("nominal joint")
    style.legend(page, handles, labels)
