"""Common style of all figures, with colours that colour-blind readers can tell apart; writing of figure files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.common.files import atomic_write
from tolstat.common.load_kinds import Kind
from tolstat.common.loads import PANELS, QUANTITY
from tolstat.display.mpl import figure as figures
from tolstat.display.mpl import mpl, ticker

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#56B4E9")
"""Colours of bushings 1 to 4: the four of Okabe and Ito's colours (2008) that dichromats tell apart best."""
Dash = str | tuple[float, tuple[float, ...]]
DASHES: tuple[Dash, ...] = (
    "-",
    (0.0, (6.0, 2.0)),
    (0.0, (3.0, 1.5)),
    (0.0, (1.2, 0.9)),
)
"""Dashes of bushings 1 to 4: where curves coincide, the lower one shows through the gaps."""
SHADES = (
    "#440154",
    "#481d6f",
    "#453781",
    "#3c4f8a",
    "#32648e",
    "#2a788e",
    "#228b8d",
    "#1f9f88",
    "#2cb17e",
    "#4ec36b",
    "#7ad151",
    "#b0dd2f",
)
DARK_SHADES = (
    "#fde725",
    "#d8e219",
    "#b0dd2f",
    "#89d548",
    "#65cb5e",
    "#46c06f",
    "#2eb37c",
    "#21a585",
    "#1f968b",
    "#23888e",
    "#297a8e",
    "#2f6c8e",
)
"""Colours of viridis in order, which stay in order in grey and for colour-blind readers, on white and on dark paper."""
INK, FAINT = "#222222", "#777777"

_SETTINGS: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # where it is put, so that nothing is measured to find out
    "axes.labelsize": 10.0,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E2E2E2",
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "lines.linewidth": 1.8,
    "legend.frameon": False,
    "svg.hashsalt": "tolstat",
    "text.parse_math": False,  # the name of a study may contain a dollar sign
}


@contextmanager
def settings() -> Iterator[None]:
    """Apply the common style inside the context; the caller's settings are restored afterwards."""
    with mpl.rc_context(_SETTINGS):
        yield


def panels(title: str, subtitle: str) -> tuple[Figure, list[tuple[str, Kind, Axes]]]:
    """Make a page of four panels: force and bending moment of the cross bushings above those of the fork bushings.

    Parameters
    ----------
    title, subtitle : str
        Headline, and the line or lines of small print below it.

    Returns
    -------
    figure : Figure
        The page; the strip at its foot is reserved for `legend`.
    panels : list of (group, kind, Axes)
        One for each of `loads.PANELS`.
    """
    figure = figures.Figure(figsize=(11.0, 8.5))
    axes = figure.subplots(2, 2)
    figure.subplots_adjust(left=0.085, right=0.975, top=0.82, bottom=0.125, hspace=0.42, wspace=0.16)
    figure.text(0.02, 0.972, title, fontsize=15, fontweight="bold", va="top")
    figure.text(0.02, 0.932, subtitle, fontsize=9.5, color="#444444", va="top", linespacing=1.45)
    page = []
    for (group, kind), ax in zip(PANELS, axes.flat, strict=True):
        ax.set_title(f"{group.capitalize()} bushings, {QUANTITY[kind.unit]}", pad=21)
        page.append((group, kind, ax))
    return figure, page


def share_axis(ax: Axes, low: float, which: str = "y", high: float = 1.0) -> None:
    """Make an axis logarithmic, in per cent, from `low` to slightly above `high` so that a curve there is visible.

    An axis of less than two decades has marks at 1, 2 and 5.
    """
    upright = which == "y"
    (ax.set_yscale if upright else ax.set_xscale)("log")
    (ax.set_ylim if upright else ax.set_xlim)(low, high * (high / low) ** 0.04)
    axis = ax.yaxis if upright else ax.xaxis
    if high < 100.0 * low:
        axis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(ticker.FuncFormatter(lambda x, _: f"{100.0 * x:g} %"))
    axis.set_minor_locator(_near_view(*sorted(axis.get_view_interval())))
    axis.set_minor_formatter(ticker.NullFormatter())


def _near_view(low: float, high: float) -> ticker.FixedLocator:
    """Minor marks of a logarithmic axis in the view: those up to a decade beyond it would be made but not drawn."""
    decades = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)))
    marks = np.outer(10.0**decades, np.arange(2.0, 10.0)).ravel()
    return ticker.FixedLocator(marks[(marks > 0.999 * low) & (marks < 1.001 * high)].tolist())


def mark(ax: Axes, x: float, y: float, colour: str) -> None:
    """Mark the nominal joint by a small triangle."""
    ax.plot(x, y, marker="v", ms=7.5, mec="white", mew=0.7, color=colour, clip_on=False, zorder=5)


def note(ax: Axes, text: str, y: float) -> None:
    """Write a note on a horizontal line, at its right end."""
    ax.annotate(
        text,
        (1.0, y),
        xycoords=ax.get_yaxis_transform(),
        xytext=(-2, 3),
        textcoords="offset points",
        ha="right",
        fontsize=9,
    )


def legend(figure: Figure, handles: list[Artist], labels: list[str]) -> None:
    """Put one legend for all panels at the foot of the page, in one or two rows."""
    letters = sum(len(label) + 7 for label in labels)
    figure.legend(
        handles,
        labels,
        loc="lower center",
        ncols=len(labels) if letters < 140 else -(-len(labels) // 2),
        bbox_to_anchor=(0.5, 0.0),
        handlelength=2.4,
        columnspacing=1.3,
        fontsize=9.5,
    )


def save(figure: Figure, stem: Path, suffixes: tuple[str, ...] = (".png", ".svg")) -> list[Path]:
    """Write a figure in each format; the same figure gives the same bytes.

    Returns
    -------
    list of Path
        The files written: `stem` with each suffix appended.
    """
    files = []
    for suffix in suffixes:
        path = stem.with_name(stem.name + suffix)
        metadata = {"Date": None} if suffix == ".svg" else None
        with settings(), atomic_write(path) as temporary:
            figure.savefig(temporary, format=suffix.lstrip("."), dpi=150, metadata=metadata)
        files.append(path)
    return files
