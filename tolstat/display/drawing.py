"""Style of the page's pictures: one panel each, legible on a telephone and in print."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Sequence
from html import escape
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Literal

from numpy.typing import ArrayLike

from tolstat.display import style, text, unseen
from tolstat.display.blocks import Panel

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

BOTTOM, RIGHT = 0.5, 0.12
"""Margins below and beside the axes, inches; `Panel.left` and `Panel.top` are the others."""
WIDTH = 4.9
"""Usual width of a panel, inches."""
TITLE = 0.34
"""Room for the title above a panel in a file of its own, inches."""
LETTER, KEY = 0.071, 0.5
"""Width of a letter of a legend, and of the rest of an entry, inches."""
GREY = "#B8B8B8"
ACCEPTED: dict[str, Any] = {"color": style.COLOURS[2], "lw": 1.4, "ls": (0.0, (6.0, 2.0))}
"""Look of the line of an accepted share."""
WORDS: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8.0, "backgroundcolor": "white"}
"""Look of words on a vertical line."""
_SETTINGS = {
    "font.size": 8.8,
    "lines.linewidth": 1.6,
    "legend.frameon": True,
    "legend.framealpha": 0.95,
    "legend.facecolor": "white",
    "legend.edgecolor": "none",
    "svg.fonttype": "none",  # keep text as text: small, sharp, searchable, readable aloud
}
"""Font and line sizes of a single panel, beside the common style."""


def _place(panel: Panel) -> tuple[float, float, float, float]:
    """Position of the axes as fractions of the panel's size: left, bottom, width, height."""
    if panel.bare:
        return (0.0, 0.0, 1.0, 1.0)
    (width, height), across, along = panel.size, panel.left + RIGHT, BOTTOM + panel.top
    return (panel.left / width, BOTTOM / height, 1.0 - across / width, 1.0 - along / height)


def svg(panel: Panel) -> tuple[str, tuple[float, ...]]:
    """Draw a panel as inline SVG: the same panel gives the same bytes, and all ids are unique on the page.

    Returns
    -------
    str
        The element.
    tuple of float
        Left, right, upper, lower edge of the axes, points from the left and the top; loads at both ends of the x axis.
    """
    with style.settings(_SETTINGS):
        figure = style.new_figure(figsize=panel.size, dpi=72)
        ax = figure.add_axes(_place(panel))
        panel.draw(ax)
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, transparent=True)
    box, height = ax.get_window_extent(), figure.bbox.height
    frame = (box.x0, box.x1, height - box.y1, height - box.y0, *ax.get_xlim())
    return _inline(buffer.getvalue(), panel), frame


def sheet(panels: Sequence[Panel], title: str = "", notes: Sequence[str] = (), columns: int = 1) -> Figure:
    """Put panels with their titles on one sheet, `columns` side by side, below a headline and above small print."""
    heights = [panel.size[1] + TITLE for panel in panels[::columns]]
    head, foot = wrap(title, 44 * columns), [line for note in notes for line in wrap(note, 62 * columns)]
    size = (columns * panels[0].size[0], sum(heights) + 0.35 * len(head) + 0.2 * len(foot))
    with style.settings(_SETTINGS):
        figure = style.new_figure(figsize=size, layout="constrained")
        axes = figure.subplots(len(heights), columns, squeeze=False, height_ratios=heights)
        for panel, ax in zip(panels, axes.flat, strict=True):
            panel.draw(ax)
            pad = 6.0 if panel.bare else 72.0 * panel.top
            ax.set_title("\n".join(wrap(panel.title, 62)), fontsize=10, fontweight="normal", pad=pad)
            ax.set_anchor("N")
        left = {"x": 0.1 / size[0], "ha": "left"}
        figure.suptitle("\n".join(head), **left, fontsize=12.5, fontweight="bold")
        figure.supxlabel("\n".join(foot), **left, fontsize=8.8, linespacing=1.5)
    return figure


def switched(artist: Artist, name: str) -> None:
    """Let an artist be drawn only while a switch of its panel is on, see `blocks.Panel.switches`."""
    artist.set_gid(f"switch-{name}")


def _inline(drawn: str, panel: Panel) -> str:
    """Body of an SVG file as an element of the page, whose style sheet has fonts, joins and colours of all pictures."""
    body = style.with_variables(unseen.visible(drawn[drawn.index("<svg") :]))
    body = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>", "", body, flags=re.DOTALL)
    body = body.replace("font-family: 'DejaVu Sans'; ", "")
    body = re.sub(r'<path d="[^"]*" style="fill: none"/>', "", body)  # background of figure and axes
    body = re.sub(r' d="[^"]+"', lambda m: m[0].replace("\n", ""), body)
    body = re.sub(r">\s+<", "><", body)
    body = re.sub(r' id="switch-([^"]+)"', r' class="\1"', body)
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', body))
    body = re.sub(r' id="([^"]+)"', lambda m: f' id="{panel.key}-{m[1]}"' if m[1] in used else "", body)
    body = re.sub(r'(href="#|url\(#)', rf"\1{panel.key}-", body)
    body = re.sub(r' (?:d|x|y|points)="[^"]+"', lambda m: re.sub(r"(\.\d\d)\d+", r"\1", m[0]), body)  # in points
    box = re.search(r'viewBox="[^"]+"', body)
    assert box is not None
    spaces = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    head = f'<svg {spaces} {box[0]} role="img" aria-labelledby="{panel.key}-title {panel.key}-desc">'
    title, description = (escape(unseen.visible(words)) for words in (panel.title, panel.description))
    texts = f'<title id="{panel.key}-title">{title}</title><desc id="{panel.key}-desc">{description}</desc>'
    return head + texts + body[body.index(">") + 1 :].strip()


def rows(ax: Axes, labels: list[str]) -> None:
    """Label the horizontal rows of a panel, the first row on top."""
    ax.set_yticks(range(len(labels)), labels)
    ax.set_ylim(len(labels) - 0.4, -0.6)
    ax.tick_params(axis="y", length=0)
    ax.grid(axis="y", visible=False)
    ax.spines["left"].set_visible(False)


def legend_above(ax: Axes, handles: Sequence[Artist], labels: Sequence[str]) -> None:
    """Put a legend above the axes, where it covers nothing; `legend_room` is the room that it takes."""
    where: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.0}
    columns = _legend_columns(labels, ax.get_window_extent().width / ax.figure.dpi)
    ax.legend(handles, labels, ncols=columns, handlelength=2.2, columnspacing=1.2, **where)


def legend_room(labels: Sequence[str], left: float = Panel.left) -> float:
    """Room that a legend takes above the axes of a panel of usual width, inches; `left` as in `Panel`."""
    return 0.08 + 0.2 * -(-len(labels) // _legend_columns(labels, WIDTH - left - RIGHT))


def _legend_columns(labels: Sequence[str], width: float) -> int:
    """Largest number of columns, filled one after the other, that fit a width, inches."""
    for columns in range(len(labels), 1, -1):
        rows = -(-len(labels) // columns)
        letters = sum(max(map(len, labels[i : i + rows])) for i in range(0, len(labels), rows))
        if LETTER * letters + KEY * columns <= width:
            return columns
    return 1


def curves(
    ax: Axes,
    x: ArrayLike,
    lines: Iterable[Iterable[ArrayLike]],
    marks: Iterable[float],
    bands: int,
    colours: Sequence[str] = style.COLOURS,
    step: Literal["post"] | None = None,
) -> list[Artist]:
    """Draw lines, each with the ends of its interval, over `x`, the first of them with `bands`; return the lines.

    Vertical lines mark some values of `x`; steps go on to the right of each value.
    """
    handles: list[Artist] = []
    for (middle, low, high), colour, dash in zip(lines, colours, style.DASHES, strict=False):
        handles += ax.plot(x, middle, color=colour, ls=dash, drawstyle="steps-post" if step else "default")
        if len(handles) <= bands:
            ax.fill_between(x, low, high, step=step, color=colour, alpha=0.2, lw=0)
    for mark in marks:
        ax.axvline(float(mark), color=style.FAINT, lw=1.0, ls=style.DASHES[2])
    return handles


def loads_axis(axis: Axis, typical: float, unit: str) -> str:
    """Let an axis of loads show the multiple of their unit that a load has, see `text.multiple`; return its text."""
    size, name = text.multiple(typical, unit)
    if size != 1.0:
        axis.set_major_formatter(style.ticker.FuncFormatter(lambda x, _: f"{x / size:g}"))
    return name


def log_loads(ax: Axes, low: float, high: float, typical: float, unit: str) -> str:
    """Make the x axis logarithmic, over loads from `low` to `high`, SI; otherwise as `loads_axis`."""
    size, name = text.multiple(typical, unit)
    ax.set_xscale("log")
    ax.set_xlim(low, high)
    ax.xaxis.set_major_locator(style.ticker.LogLocator(subs=(1.0, 2.0, 5.0) if high < 200.0 * low else (1.0,)))
    ax.xaxis.set_major_formatter(style.ticker.FuncFormatter(lambda x, _: f"{x / size:g}"))
    ax.xaxis.set_minor_formatter(style.ticker.NullFormatter())
    return name


def empty(ax: Axes, why: str) -> None:
    """Say in an empty panel why it is empty."""
    ax.text(0.5, 0.5, why, ha="center", va="center", transform=ax.transAxes)
    ax.set(xticks=[], yticks=[])


def share_bar(
    ax: Axes, y: float, share: Sequence[float], drawn: float, floor: float, colour: str, height: float, off: float = 0.0
) -> None:
    """Draw how far a change moves a share: a bar from the share as drawn, and the interval of the new one.

    Parameters
    ----------
    ax : Axes
        Panel of horizontal rows with an axis of shares.
    y : float
        Row.
    share : sequence of float
        Share, lower and upper end of its interval.
    drawn : float
        Share as drawn.
    floor : float
        Left end of the axis; an arrow there stands for an end that is smaller.
    colour, height
        Of the bar.
    off : float
        Distance of the interval above the middle of the row.
    """
    moved, low, high = (max(end, floor) for end in share)
    ax.barh(y, moved - drawn, height, left=drawn, color=colour, zorder=2)
    ax.plot([low, high], [y - off, y - off], color=style.INK, lw=1.2, zorder=3)
    if share[1] < floor:
        ax.plot(floor, y - off, marker=style.markers.CARETLEFT, color=style.INK, ms=5.0, zorder=4, clip_on=False)


def accepted(ax: Axes, share: float, y: float) -> None:
    """Draw the accepted share into a panel of horizontal rows, with words at the height y; nothing if there is none."""
    if share > 0.0:
        ax.axvline(share, **ACCEPTED)
        ax.text(share, y, f"accepted {text.percent(share)}", **WORDS)


def rows_left(labels: Sequence[str]) -> float:
    """Room for the labels of a panel of horizontal rows, inches."""
    return max(1.2, 0.064 * max((len(line) for label in labels for line in label.split("\n")), default=0) + 0.12)


def rows_height(count: int) -> float:
    """Height of a panel of horizontal rows, inches."""
    return 0.235 * count + BOTTOM + 0.36
