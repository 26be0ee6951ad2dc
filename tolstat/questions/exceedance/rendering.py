"""Load exceedance as text and pictures: tables of limits and quantiles, curves with their bands."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from tolstat.analysis import exceedance
from tolstat.common.tables import VALID, Status
from tolstat.display import drawing, style, text
from tolstat.display.table import Column, Row
from tolstat.questions.exceedance.query import SHARES, curve
from tolstat.store.view import View

DRAWN_LEVELS = 200
"""Maximum number of points of a curve in the picture."""
LIMIT_DASH, ZERO_DASH = (0.0, (8.0, 3.0)), (0.0, (1.0, 2.0))


def _has_unresolved(table: pd.DataFrame) -> bool:
    return bool((table["n_failed"] + table["n_unsettled"]).any())


def _has_error(table: pd.DataFrame) -> bool:
    return bool(table["numerical_error"].notna().any())


def _outer(row: Row) -> str:
    kind = "bound" if math.isnan(row["outer_lower"]) else "outer"
    return text.span(row[f"{kind}_lower"], row[f"{kind}_upper"])


def _is_weighted(table: pd.DataFrame) -> bool:
    return bool(table["unsearched_upper"].notna().any())


def _unsearched(row: Row) -> str:
    return text.percent(row["unsearched_upper"])


def _is_known(table: pd.DataFrame) -> bool:
    return "both_lower" in table


def _both(row: Row) -> str:
    return text.span(row["both_lower"], row["both_upper"])


def above(row: Row) -> str:
    """Joints above a limit, and of how many with a valid load."""
    return f"{row['count']} of {row['n'] - row['n_failed'] - row['n_unsettled']}"


LIMITS = (
    Column("load", lambda row: str(row["load"])),
    Column("limit", lambda row: text.value(row["level"], row["unit"])),
    Column("nominal", lambda row: text.value(row["nominal"], row["unit"]), rank=1),
    Column("above", above),
    Column("share", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
    Column("with unresolved joints", _outer, shown=_has_unresolved, rank=2),
    Column("total interval", lambda row: text.span(row["total_lower"], row["total_upper"]), shown=_has_error, rank=3),
    Column("with measured parts", _both, shown=_is_known, rank=1),
    Column("at most, if ways are missed", _unsearched, shown=_is_weighted),
)
"""Columns of the table `query.limits`. Joints above are counted among the valid ones, as the share is; the last two
columns count failed and unsettled joints below, then above the limit, and shift every load by the numerical error."""


def at_points(view: View) -> tuple[Column, ...]:
    """Columns of the table `query.at_points`: the share above each limit at each operating point."""

    def share(point: str) -> Column:
        return Column(point, lambda row: text.percent(row[point]))

    head = (Column("load", lambda row: str(row["load"])), Column("limit", lambda r: text.value(r["level"], r["unit"])))
    return (*head, *map(share, view.points))


AT_POINTS = "share of the joints above each limit at each operating point"
"""Title of the table `query.at_points`."""


def _numerical(row: Row) -> str:
    return text.percent(max(abs(row[f"numerical_{end}"] - row["estimate"]) for end in ("lower", "upper")))


BUDGET = (
    Column("limit", text.limit),
    Column("share", lambda row: text.percent(row["estimate"])),
    Column("sampling, ±", lambda row: text.percent(0.5 * (row["upper"] - row["lower"]))),
    Column("numerical error, up to", _numerical),
    Column("failed and unsettled, width", lambda row: text.percent(row["bound_upper"] - row["bound_lower"])),
)
"""Contributions to the uncertainty of each share above a limit, from the table `query.limits`."""


def quantile_columns(tolerance: dict[str, float] | None = None) -> tuple[Column, ...]:
    """Columns of the table `by_load`: quantiles with intervals and, if given, tolerance limits by load."""

    def limit(row: Row) -> str:
        upper = (tolerance or {})[row["load"]]
        return "needs more joints" if math.isinf(upper) else text.value(upper, row["unit"])

    def quantile(share: float) -> Column:
        def cell(row: Row) -> str:
            own, lower, upper = row[share]
            size = text.multiple(own, row["unit"])[0]
            ends = f" ({text.number(lower / size)} .. {text.number(upper / size)})"
            ends = ends if tolerance and not math.isnan(lower) else ""
            return text.value(own, row["unit"]) + ends

        rank = {SHARES[-1]: 0, SHARES[0]: 0}.get(share, 3)
        return Column(f"{100 * share:g} %" + (" stay below" if tolerance else ""), cell, rank=rank)

    def interval(row: Row) -> str:
        _, lower, upper = row[SHARES[-1]]
        return text.span_of(lower, upper, row["unit"])

    head = (
        Column("load", lambda row: str(row["load"])),
        Column("nominal", lambda r: text.value(r["nominal"], r["unit"]), rank=1),
    )
    last = Column(f"95 % interval of {100 * SHARES[-1]:g} %", interval) if tolerance is None else None
    last = last or Column("tolerance limit 99 % / 95 %", limit)
    return (*head, *(quantile(share) for share in SHARES), last)


def by_load(quantiles: pd.DataFrame) -> pd.DataFrame:
    """One row per load of the table `query.quantiles`: for each share (estimate, lower, upper)."""
    rows = []
    for name, part in quantiles.groupby("load", sort=False):
        ends = {row["share"]: (row["estimate"], row["lower"], row["upper"]) for row in part.to_dict("records")}
        rows.append({"load": str(name), "unit": part["unit"].iloc[0], "nominal": part["nominal"].iloc[0], **ends})
    return pd.DataFrame(rows)


def note(view: View) -> str:
    """Sentence on what the intervals cover."""
    if view.weighted:
        text = (
            "joints counted by their weights; bands: pointwise 95 % Clopper–Pearson intervals of as many equal joints "
            f"as would be as sure{_distrust(view)}"
        )
        if view.aimed:
            text += (
                "; intervals hold if the proposals reach every way to the limit, the "
                "last column, from the joints of the tolerances alone, whatever they miss"
            )
    elif view.replicates > 1 or view.lots is not None:
        text = f"bands: pointwise 95 % intervals of the settled joints, {view.interval_of}"
    elif view.iid:
        text = "bands: pointwise 95 % Clopper–Pearson intervals of the settled joints"
    else:
        text = "no intervals: Clopper–Pearson holds for independent samples only"
    if view.count(*VALID, Status.PENDING) < view.n:
        text += "; light bands: with the others counted below and above every x"
    return text


def _distrust(view: View) -> str:
    """Words on limits without a share, because few joints have most of the weight above them."""
    poor = []
    for name, level in view.limits.items():
        load = view.load(name)
        if not load.supports(level):
            found = load.trust(level)
            tail = "" if np.isnan(found.k) else f", Pareto k {found.k:.2f}"
            poor.append(f"{name} ({found.effective:.0f} effective joints above{tail})")
    return f"; no share, needs more joints or other proposals: {', '.join(poor)}" if poor else ""


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
        for group, letter, ax in panels:
            panel(ax, view, group, letter, confidence)
        _legend(page, view)
    return page


def panel(ax: Axes, view: View, group: str, letter: str, confidence: float = 0.95) -> None:
    """Draw the curves of four bushings: ``cross`` or ``fork``, ``F`` or ``T``."""
    names = [f"{group}{i}.{letter}" for i in (1, 2, 3, 4)]
    tables = [
        curve(view.load(name), confidence, DRAWN_LEVELS)
        if name in view.bushing_loads
        else np.empty(0, exceedance.CURVE)
        for name in names
    ]
    unit = "N" if letter == "F" else "N*m"
    if letter == "F":
        ax.set_ylabel("share of joints above x")
    levels = np.concatenate([table["level"] for table in tables])
    if not levels.size:
        held = any(name in view.bushing_loads for name in names)
        found = "no joint with a valid result" if held else "not kept by the study"
        ax.text(0.5, 0.5, found, ha="center", transform=ax.transAxes)
        ax.set(xticks=[], yticks=[])
        return
    marked = _limit_levels(view, group, letter)
    low, high = axis_range(levels, list(marked))
    ax.set_xlim(low, high)
    shown = drawing.loads_axis(ax.xaxis, max(marked, default=high), unit)
    ax.set_xlabel(f"x: largest |{letter}| over the revolution [{shown}]")
    floor = 0.5 * min(least(view, table) for table in tables if table.size)
    style.share_axis(ax, floor)
    for i, table in enumerate(tables):
        if table.size:
            steps(ax, table, i, low, floor)
            nominal = view.load(names[i]).nominal
            if low <= nominal <= high:
                style.mark(ax, nominal, 1.0, style.COLOURS[i])
    if view.has_intervals:
        ends = [table["outer_upper"][-1] for table in tables if table.size]
        ax.axhline(max(ends), color=style.FAINT, lw=1.1, ls=ZERO_DASH, zorder=1.5)
    limit_lines(ax, marked, unit)


def least(view: View, table: NDArray[np.void]) -> float:
    """Smallest share that a curve shows: that of one joint or, with weights, the smallest positive estimate."""
    shares = table["estimate"][table["estimate"] > 0]
    return 1.0 / float(table["n"][0]) if not view.weighted else float(shares.min(initial=1.0))


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


def _limit_levels(view: View, group: str, letter: str) -> dict[float, list[int]]:
    """Limits of a panel: level -> numbers of the bushings that have it."""
    found: dict[float, list[int]] = {}
    for i in (1, 2, 3, 4):
        name = f"{group}{i}.{letter}"
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
    if view.has_intervals:
        handles += [Patch(color=style.FAINT, alpha=0.4, lw=0)]
        handles += [Line2D([], [], color=style.FAINT, lw=1.1, ls=ZERO_DASH)]
        labels += ["95 % band", "upper end where none exceeds x"]
    if len(view.nominal):
        handles.append(Line2D([], [], marker="v", color=style.FAINT, ls="", ms=7.5))
        labels.append("nominal joint")
    style.legend(page, handles, labels)
