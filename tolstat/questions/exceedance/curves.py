"""Pictures of load exceedance: curves with their bands, limits and the nominal joint."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.binomial import simultaneous
from tolstat.analysis.estimates import CURVE
from tolstat.analysis.sample import Sample
from tolstat.common.load_kinds import Kind
from tolstat.common.loads import LOADS, PANELS, load_of, names_of
from tolstat.display import drawing, style, text
from tolstat.display.blocks import Panel, Reader
from tolstat.display.mpl import lines, mpl, patches, ticker
from tolstat.display.table import Rows
from tolstat.questions.exceedance.rows import curve, limit_rows, most_exceeded, readings
from tolstat.questions.exceedance.verdicts import ends
from tolstat.store.view import View

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DRAWN_LEVELS = 200
"""Maximum number of points of a curve in the picture."""
THIN_LEVELS = 80
"""Maximum number of points of a curve without a band."""
LIMIT_DASH, ZERO_DASH = (0.0, (8.0, 3.0)), (0.0, (1.0, 2.0))


def sheet(view: View, subtitle: str, confidence: float = 0.95) -> Figure:
    """Draw the exceedance curves of all bushing loads that the study keeps.

    Parameters
    ----------
    view : View
        The campaign; without a valid joint, the panels say so.
    subtitle : str
        Lines of small print.
    confidence : float
        Confidence level of the bands.

    Returns
    -------
    Figure
        Four panels, empty where no load is kept; share of the joints on a logarithmic axis down to half a joint.
    """
    with style.settings():
        title = f"{view.name}: share of joints whose largest load exceeds x"
        page, panels = style.panels(title, subtitle)
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
            size=0.9 * mpl.rcParams["font.size"],
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
        lines.Line2D([], [], color=c, ls=dash) for c, dash in zip(style.COLOURS, style.DASHES, strict=True)
    ]
    labels = [f"bushing {i}" for i in (1, 2, 3, 4)]
    if view.design.has_interval("share"):
        handles += [patches.Patch(color=style.FAINT, alpha=0.4, lw=0)]
        handles += [lines.Line2D([], [], color=style.FAINT, lw=1.1, ls=ZERO_DASH)]
        labels += ["95 % band", "upper end where none exceeds x"]
    if len(view.nominal):
        handles.append(lines.Line2D([], [], marker="v", color=style.FAINT, ls="", ms=7.5))
        labels.append("nominal joint")
    style.legend(page, handles, labels)


def _described(load: Sample) -> str:
    half, few = (text.value(load.quantile(share).estimate, load.unit) for share in (0.5, 0.99))
    return f"{load.name}: half of the joints exceed {half}, 1 % {few}"


def leading_panel(view: View, name: str) -> Panel:
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
    table = curve(load, 0.95, DRAWN_LEVELS)
    if not len(table):
        drawing.empty(ax, "no joint with a valid result")
        return
    known = [other for other in view.loads(others) if other.valid.size]
    thin = {other.name: curve(other, 0.95, THIN_LEVELS) for other in known}
    levels = np.concatenate([table["level"], *(own["level"] for own in thin.values())])
    low, high = axis_range(levels, [] if load.limit is None else [load.limit])
    floor = 0.5 * load.design.smallest(table["n"][0], table["estimate"])
    ax.set_xlim(low, high)
    style.share_axis(ax, floor)
    steps(ax, table, 0, low, floor)
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
        limit_lines(ax, {load.limit: [1, 2, 3, 4]}, load.unit)
    if low <= load.nominal <= high:
        style.mark(ax, load.nominal, 1.0, style.COLOURS[0])
    ax.xaxis.set_major_locator(ticker.MaxNLocator(5 if load.unit != "1" else 3))
    unit = drawing.loads_axis(ax.xaxis, load.limit or high, load.unit)
    ax.set_xlabel(f"x: {load.name} [{unit or '1'}], largest over the revolution")
    ax.set_ylabel("share of joints above x")


def reader(view: View) -> Reader:
    """The reader: it begins with the limit that the verdict names; without limits with a leading load."""
    limits = limit_rows(view)
    return Reader(readings(view), str(most_exceeded(view, limits)["load"]) if limits else view.most_exceeded)


def forest_panel(rows: Rows, accepted: float) -> Panel:
    """Share above each limit with its intervals, side by side; `rows` as those of `limit_rows`."""
    said = (
        f"{row['load']} above {text.value(row['level'], row['unit'])}: {text.percent(row['estimate'])}, "
        f"95 % interval {text.span(row['lower'], row['upper'])}"
        for row in rows
    )
    return Panel(
        "forest",
        "Share of the joints above each limit",
        "; ".join(said),
        partial(_forest, rows=rows, accepted=accepted),
        (4.9, drawing.rows_height(len(rows))),
        max(1.4, drawing.rows_left(_labels(rows))),
    )


def _labels(rows: Rows) -> list[str]:
    """Each limit as a label: ``cross1.F > 1500 N``."""
    return [f"{row['load']} > {text.value(row['level'], row['unit'])}" for row in rows]


def _forest(ax: Axes, rows: Rows, accepted: float) -> None:
    """Estimate, interval and total interval of each limit, on an axis from the least to the largest of them."""
    spans = [ends(row) if not np.isnan(ends(row)[0]) else (row["bound_lower"], row["bound_upper"]) for row in rows]
    n = max(1, *(row["n"] for row in rows))
    shown = np.array([*(row["estimate"] for row in rows), *np.ravel(spans)], float)
    shown = np.array([*shown[shown >= 0.5 / n], *([accepted] if accepted > 0 else ())])
    high = min(1.4 * shown.max(initial=0.5 / n), 1.0)
    drawing.rows(ax, _labels(rows))
    style.share_axis(ax, min(0.7 * shown.min(initial=high), 0.3 * high), "x", high)
    low = ax.get_xlim()[0]
    for i, (row, span) in enumerate(zip(rows, spans, strict=True)):
        ax.plot([max(span[0], 0.1 * low), span[1]], [i, i], color=drawing.GREY, lw=5.0, solid_capstyle="butt")
        if not np.isnan(row["estimate"] + row["lower"]):
            ax.plot([max(row["lower"], 0.1 * low), row["upper"]], [i, i], color=style.COLOURS[0], lw=2.0)
        if row["estimate"] >= low:
            ax.plot(row["estimate"], i, "o", color=style.COLOURS[0], ms=5.5)
        elif row["estimate"] >= 0:
            ax.plot(low, i, "<", color=style.COLOURS[0], ms=6, clip_on=False)
    if accepted > 0:
        ax.axvline(accepted, color=style.INK, lw=1.4, ls=LIMIT_DASH)
        ax.text(accepted, -0.75, f"accepted: {text.percent(accepted)}", ha="center", va="bottom")
    ax.set_xlabel("share of the joints above the limit")
