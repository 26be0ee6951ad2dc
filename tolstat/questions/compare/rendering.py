"""Two campaigns side by side: text, CSV and a picture of their curves and the difference."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from tolstat.analysis import difference
from tolstat.common.loads import unit_text
from tolstat.display import style
from tolstat.display.table import Column, Row
from tolstat.display.text import csv, formed, limit, percent

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.questions.compare.query import Change, Comparison, Sides

LEVELS = 200
"""Approximate number of levels of a curve."""
MAX_LOADS = 4
"""Maximum number of loads in the picture."""


def tables(found: Comparison, loads: bool = False) -> list[tuple[Sequence[Column], pd.DataFrame]]:
    """Tables of the differences: shares above limits; quantiles and means with `loads` or without limits."""
    shares = [(_share_columns(found.sides.paired), found.shares)] if len(found.shares) else []
    return [*shares, (LOADS, found.loads)] if loads or not shares else [*shares]


def note(found: Comparison, a: str, b: str) -> str:
    """Notes: differences between the studies, numbers of joints, and what the intervals leave out."""
    sides = found.sides
    lines = [f"A: {a}", f"B: {b}"]
    lines += [f"  {_change(change)}" for change in found.changes] or ["  the studies are the same"]
    if sides.paired:
        lines.append(f"{len(sides.a.samples)} pairs of joints with the same random numbers")
        lines.append(f"{len(found.switched)} times only one joint of a pair is above a limit")
    else:
        lines.append(f"{len(sides.a.samples)} and {len(sides.b.samples)} joints with different random numbers")
    unresolved = sides.a.unresolved + sides.b.unresolved
    if unresolved:
        lines.append(
            f"{unresolved} joints without a valid load: left out; the bounds in the CSV count them below, then above"
        )
    if not sides.has_intervals:
        lines.append("no intervals: they hold for independent samples only")
    return "\n".join(lines)


def write(found: Comparison, stem: Path, names: tuple[str, str]) -> list[Path]:
    """Write ``STEM_compare.png``, ``.svg``, ``_shares.csv``, ``_loads.csv`` and ``_switched.csv``.

    Parameters
    ----------
    found : Comparison
        The comparison.
    stem : Path
        Folder, and beginning of all file names.
    names : tuple of str
        What the legend calls A and B.

    Returns
    -------
    list of Path
        The files; tables without rows are not written.
    """
    files = style.save(figure(found, names), stem.with_name(f"{stem.name}_compare"))
    for what in ("shares", "loads", "switched"):
        table = getattr(found, what)
        if len(table):
            files.append(csv(table, stem, what))
    return files


def figure(found: Comparison, names: tuple[str, str]) -> Figure:
    """Draw both exceedance curves of at most `MAX_LOADS` of the loads compared, and below them the difference.

    Parameters
    ----------
    found : Comparison
        The comparison.
    names : tuple of str
        What the legend calls A and B.

    Returns
    -------
    Figure
        Bands are pointwise 95 % intervals; those of the difference use the pairs if joints are paired.
    """
    loads = list(dict.fromkeys(found.loads["load"]))[:MAX_LOADS]
    with style.settings():
        page = Figure(figsize=(max(4.2 * len(loads), 6.5), 6.6))
        axes = page.subplots(2, len(loads), squeeze=False, sharex="col", height_ratios=(3, 2))
        for (upper, lower), name in zip(axes.T, loads, strict=True):
            limits = found.shares.loc[found.shares["load"] == name, "level"] if len(found.shares) else ()
            _curves(upper, found.sides, name)
            _difference(lower, found.sides, name)
            for ax in (upper, lower):
                for level in limits:
                    ax.axvline(float(level), color=style.FAINT, lw=1.0, ls=style.DASHES[2])
        axes[0, 0].set_ylabel("share of joints above x")
        axes[1, 0].set_ylabel("B less A, % of the joints")
        handles: list[Artist] = [
            Line2D([], [], color=c, ls=d) for c, d in zip(style.COLOURS, style.DASHES[:2], strict=False)
        ]
        labels = [f"A: {names[0]}", f"B: {names[1]}"]
        if found.sides.has_intervals:
            handles.append(Patch(color=style.FAINT, alpha=0.3, lw=0))
            labels.append("95 % band" + (" (below: of pairs)" if found.sides.paired else ""))
        page.subplots_adjust(
            left=0.75 / page.get_figwidth(), right=0.985, top=0.93, bottom=0.17, wspace=0.24, hspace=0.09
        )
        style.legend(page, handles, labels)
    return page


def _curves(ax: Axes, sides: Sides, name: str) -> None:
    a, b = sides.load(name)
    ax.set_title(name)
    levels, floor = _levels(a.values, b.values), 0.5 / max(a.values.size, b.values.size)
    for load, colour, dash in zip((a, b), style.COLOURS, style.DASHES, strict=False):
        table = load.curve(levels)
        ax.step(levels, table["estimate"].clip(0.1 * floor), where="post", color=colour, ls=dash)
        if sides.has_intervals:
            _band(ax, levels, table["lower"].clip(0.1 * floor), table["upper"], colour)
    style.share_axis(ax, floor)


def _difference(ax: Axes, sides: Sides, name: str) -> None:
    a, b = sides.load(name)
    levels = _levels(a.values, b.values)
    found = difference.shares(a, b, levels, sides.paired)
    ax.axhline(0.0, color=style.FAINT, lw=1.0)
    ax.step(levels, 100.0 * found.estimate, where="post", color=style.INK)
    if sides.has_intervals:
        _band(ax, levels, 100.0 * found.lower, 100.0 * found.upper, style.INK)
    ax.set_xlabel(f"x [{unit_text(a.unit)}]" if a.unit != "1" else "x")


def _band(
    ax: Axes, x: NDArray[np.float64], lower: NDArray[np.float64], upper: NDArray[np.float64], colour: str
) -> None:
    ax.fill_between(x, lower, upper, step="post", color=colour, alpha=0.2, lw=0)


def _levels(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Levels of the curves: quantiles of both campaigns pooled, denser in the tail."""
    both = np.concatenate([a[np.isfinite(a)], b[np.isfinite(b)]])
    tail = np.geomspace(1.0, 1.0 / both.size, LEVELS // 2)
    shares = np.union1d(np.linspace(0.0, 1.0, LEVELS // 2), 1.0 - tail)
    return np.unique(np.quantile(both, shares, method="inverted_cdf"))


def _share_columns(paired: bool) -> tuple[Column, ...]:
    """Columns of the table `Comparison.shares`; joints above on one side only are counted for pairs."""

    def only(side: str) -> Callable[[Row], str]:
        return lambda row: str(row[f"only_{side}"]) if paired else "-"

    return (
        Column("load > limit", limit),
        Column("A", lambda row: percent(row["a"])),
        Column("B", lambda row: percent(row["b"])),
        Column("B - A", lambda row: f"{100 * row['estimate']:+.3g} %"),
        Column("ppm", lambda row: f"{1e6 * row['estimate']:+.4g}", rank=2),
        Column("95 % interval", lambda row: _interval(row, 100.0, " %")),
        Column("only A", only("a"), rank=1),
        Column("only B", only("b"), rank=1),
        Column("p", lambda row: formed(row["p"], ".2g")),
    )


def _unit(row: Row) -> str:
    return f" {unit_text(row['unit'])}".rstrip()


def _interval(row: Row, factor: float, unit: str) -> str:
    low, high = factor * row["lower"], factor * row["upper"]
    return "-" if math.isnan(low) else f"{low:+.3g} .. {high:+.3g}{unit}"


LOADS = (
    Column("load", lambda row: str(row["load"])),
    Column("statistic", lambda row: str(row["statistic"])),
    Column("A", lambda row: f"{row['a']:.4g}{_unit(row)}"),
    Column("B", lambda row: f"{row['b']:.4g}{_unit(row)}"),
    Column("B - A", lambda row: f"{row['estimate']:+.3g}{_unit(row)}"),
    Column("95 % interval", lambda row: _interval(row, 1.0, _unit(row))),
)
"""Columns of the table `Comparison.loads`."""


def _change(change: Change) -> str:
    more = f" and {len(change.keys) - 1} more" if len(change.keys) > 1 else ""
    return f"{change.keys[0]}{more}: {_side(change.a)} -> {_side(change.b)}"


def _side(value: object) -> str:
    return "nothing" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
