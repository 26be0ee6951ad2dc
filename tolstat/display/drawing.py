"""Style of the page's pictures: one panel each, legible on a telephone and in print."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Mapping, Sequence
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
"""Margins below and beside the axes, inches."""
WIDTH = 4.9
"""Usual width of a panel, inches."""
TITLE = 0.34
"""Room for the title above a panel in a file of its own, inches."""
LETTER, KEY = 0.071, 0.5
"""Width of a letter of a legend, and of the rest of an entry, inches."""
GREY = "#B8B8B8"
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


def _place(panel: Panel, top: float) -> tuple[float, float, float, float]:
    """Position of the axes as fractions of the panel's size: left, bottom, width, height; `top` inches are above."""
    if panel.bare:
        return (0.0, 0.0, 1.0, 1.0)
    (width, height), left = panel.size, _left(panel)
    return (left / width, BOTTOM / height, 1.0 - (left + RIGHT) / width, 1.0 - (BOTTOM + top) / height)


def _left(panel: Panel) -> float:
    """Room for the labels of the y axis, inches: for those of rows 0.064 a letter of the longest line."""
    letters = [len(line) for label in panel.rows for line in label.split("\n")]
    return max(panel.left, 1.2, 0.064 * max(letters) + 0.12) if letters else panel.left


def _draw(ax: Axes, panel: Panel) -> float:
    """Draw a panel with its rows and its legend, and return the room above the axes, inches."""
    if panel.rows:
        ax.set_yticks(range(len(panel.rows)), panel.rows)
        ax.set_ylim(len(panel.rows) - 0.4, -0.6)
        ax.tick_params(axis="y", length=0)
        ax.grid(axis="y", visible=False)
        ax.spines["left"].set_visible(False)
    panel.draw(ax)
    entries = {label: handle for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    if not entries:
        return panel.top
    labels = list(entries)
    # as many columns, filled one after the other, as fit the width of the axes
    width = panel.size[0] - _left(panel) - RIGHT
    for columns in range(len(labels), 0, -1):
        lines = -(-len(labels) // columns)
        letters = sum(max(map(len, labels[i : i + lines])) for i in range(0, len(labels), lines))
        if LETTER * letters + KEY * columns <= width or columns == 1:
            break
    where: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.0}
    ax.legend(list(entries.values()), labels, ncols=columns, handlelength=2.2, columnspacing=1.2, **where)
    return max(panel.top, 0.08 + 0.2 * lines)


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
        ax = figure.add_axes(_place(panel, panel.top))
        ax.set_position(_place(panel, _draw(ax, panel)))
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
        for ax in axes.flat[len(panels) :]:
            ax.remove()
        for panel, ax in zip(panels, axes.flat[: len(panels)], strict=True):
            top = _draw(ax, panel)
            pad = 6.0 if panel.bare else 72.0 * top
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


def curves(
    ax: Axes,
    x: ArrayLike,
    lines: Mapping[str, Sequence[ArrayLike]],
    marks: Iterable[float] = (),
    bands: int = 0,
    colours: Sequence[str] = style.COLOURS,
    step: Literal["pre", "post"] | None = None,
) -> None:
    """Draw lines by their labels, each with the ends of its interval, over `x`; bands show the first `bands` intervals.

    Vertical lines mark some values of `x`; steps go on to the left or to the right of each value.
    """
    way = f"steps-{step}" if step else "default"
    for (label, (middle, *_)), colour, dash in zip(lines.items(), colours, style.DASHES, strict=False):
        ax.plot(x, middle, color=colour, ls=dash, drawstyle=way, label=label)
    for i, ((_, low, high), colour) in enumerate(zip(list(lines.values())[:bands], colours, strict=False)):
        name = None if i else "95 % band"
        ax.fill_between(x, low, high, step=step, color=colour, alpha=0.2, lw=0, label=name)
    for mark in marks:
        ax.axvline(float(mark), color=style.FAINT, lw=1.0, ls=style.DASHES[2])


def loads_axis(axis: Axis, typical: float, unit: str) -> str:
    """Let an axis of loads show the multiple of their unit that a load has, see `text.multiple`; return its text."""
    size, name = text.multiple(typical, unit)
    if size != 1.0:
        axis.set_major_formatter(style.ticker.FuncFormatter(lambda x, _: f"{x / size:g}"))
    return name


def log_loads(axis: Axis, low: float, high: float, typical: float, unit: str) -> str:
    """Make an axis logarithmic, over loads from `low` to `high`, SI; otherwise as `loads_axis`."""
    size, name = text.multiple(typical, unit)
    which = "x" if axis is axis.axes.xaxis else "y"
    axis.axes.set(**{f"{which}scale": "log", f"{which}lim": (low, high)})
    axis.set_major_locator(style.ticker.LogLocator(subs=(1.0, 2.0, 5.0) if high < 200.0 * low else (1.0,)))
    axis.set_major_formatter(style.ticker.FuncFormatter(lambda x, _: f"{x / size:g}"))
    axis.set_minor_formatter(style.ticker.NullFormatter())
    return name


def empty(ax: Axes, why: str) -> None:
    """Say in an empty panel why it is empty."""
    ax.text(0.5, 0.5, why, ha="center", va="center", transform=ax.transAxes)
    ax.set(xticks=[], yticks=[])


def share_bar(
    ax: Axes,
    y: float,
    share: Sequence[float],
    drawn: float,
    floor: float,
    colour: str,
    height: float,
    off: float = 0.0,
    label: str = "",
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
    label : str
        Name of the change in the legend.
    """
    moved, low, high = (max(end, floor) for end in share)
    ax.barh(y, moved - drawn, height, left=drawn, color=colour, zorder=2, label=label)
    ax.plot([low, high], [y - off, y - off], color=style.INK, lw=1.2, zorder=3)
    if share[1] < floor:
        ax.plot(floor, y - off, marker=style.markers.CARETLEFT, color=style.INK, ms=5.0, zorder=4, clip_on=False)


def accepted(ax: Axes, share: float, y: float) -> None:
    """Draw the accepted share into a panel of horizontal rows, with words at the height y; nothing if there is none."""
    if share > 0.0:
        ax.axvline(share, color=style.COLOURS[2], lw=1.4, ls=(0.0, (6.0, 2.0)))
        ax.text(share, y, f"accepted {text.percent(share)}", **WORDS)


def rows_height(count: int) -> float:
    """Height of a panel of horizontal rows, inches."""
    return 0.235 * count + BOTTOM + 0.36
