"""Common style of all figures, colours that colour-blind readers can tell apart, on dark paper too; figure files."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.common.files import atomic_write
from tolstat.common.late import Late

if TYPE_CHECKING:
    import matplotlib.figure
    from matplotlib import lines as lines
    from matplotlib import markers as markers
    from matplotlib import patches as patches
    from matplotlib import ticker as ticker
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
else:
    matplotlib = Late("matplotlib")
    lines, markers, patches, ticker = (Late(f"matplotlib.{name}") for name in ("lines", "markers", "patches", "ticker"))

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#56B4E9")
"""Colours of curves, see `curve`: the four of Okabe and Ito's colours (2008) that dichromats tell apart best."""
Dash = str | tuple[float, tuple[float, ...]]
DASHES: tuple[Dash, ...] = ("-", (0.0, (6.0, 2.0)), (0.0, (3.0, 1.5)), (0.0, (1.2, 0.9)))
"""Dashes of curves: where curves coincide, the lower one shows through the gaps."""
INK, FAINT = "#222222", "#777777"

_DARK = {
    "#ffffff": ("paper", "#16171a"),
    INK: ("ink", "#e8e8ea"),
    "#666666": ("soft", "#a9adb5"),
    FAINT: ("faint", "#8d929b"),
    "#b8b8b8": ("grey", "#6b7079"),
    "#e2e2e2": ("grid", "#33363c"),
    "#e6e6e6": ("pale", "#41454d"),
    COLOURS[0].lower(): ("line1", "#58aee6"),
    COLOURS[1].lower(): ("line2", "#f08c4e"),
    COLOURS[2].lower(): ("line3", "#3fbf93"),
    COLOURS[3].lower(): ("line4", "#b3dcf7"),
    "#c04a00": ("marked", "#ff9552"),
    "#cfe4f3": ("cross", "#24465e"),
    "#f6dfc6": ("input", "#5c4527"),
    "#cdebdd": ("output", "#24513d"),
}
"""Name of the CSS variable and dark value of colours that pictures are drawn with, as matplotlib writes them."""

_SETTINGS: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # where it is put, so that nothing is measured to find out
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


def shades(first: float = 0.0, last: float = 0.88) -> list[str]:
    """Twelve colours of viridis, which stay in order in grey and for colour-blind readers."""
    return [matplotlib.colors.to_hex(matplotlib.colormaps["viridis"](x)) for x in np.linspace(first, last, 12)]


@cache
def _schemes() -> dict[str, tuple[str, str]]:
    """CSS variables and dark values of the page's colours: on dark paper `shades` begin with the light ones."""
    dark = enumerate(zip(shades(), shades(1.0, 0.35), strict=True))
    return _DARK | {light: (f"shade{i}", shade) for i, (light, shade) in dark}


def with_variables(svg: str) -> str:
    """Replace the colours of an SVG by CSS variables; `style_sheet` gives their values.

    Colours without a dark value stay as they are in both schemes.
    """
    names = {colour: f"var(--{name})" for colour, (name, _) in _schemes().items()}
    svg = re.sub(r' fill="(#[0-9a-f]{6})"', r' style="fill: \1"', svg)
    return re.sub(r'style="[^"]+"', lambda look: re.sub("#[0-9a-f]{6}", lambda m: names.get(m[0], m[0]), look[0]), svg)


def style_sheet() -> str:
    """CSS that defines the variables: light, and dark on a screen whose reader prefers it."""
    light = "; ".join(f"--{name}: {colour}" for colour, (name, _) in _schemes().items())
    dark = "; ".join(f"--{name}: {colour}" for name, colour in _schemes().values())
    return f":root {{ {light}; }}\n@media screen and (prefers-color-scheme: dark) {{ :root {{ {dark}; }} }}"


@contextmanager
def settings(others: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Apply the common style, and `others`, inside the context; the caller's settings are restored afterwards."""
    with matplotlib.rc_context(_SETTINGS | (others or {})):
        yield


def new_figure(**look: Any) -> Figure:
    """Make a figure that is drawn into files only."""
    return matplotlib.figure.Figure(**look)


def curve(i: int) -> dict[str, Any]:
    """Colour and dash of the curve of bushing `i` of a group, from 0: from the fifth on, colours have another dash."""
    return {"color": COLOURS[i % len(COLOURS)], "ls": DASHES[(i + i // len(COLOURS)) % len(DASHES)]}


def share_axis(ax: Axes, low: float, which: str = "y", high: float = 1.0) -> None:
    """Make an axis logarithmic, in per cent, from `low` to slightly above `high` so that a curve there is visible.

    An axis of less than two decades has marks at 1, 2 and 5.
    """
    ax.set(**{f"{which}scale": "log", f"{which}lim": (low, high * (high / low) ** 0.04)})
    axis = ax.yaxis if which == "y" else ax.xaxis
    if high < 100.0 * low:
        axis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(ticker.FuncFormatter(lambda x, _: f"{100.0 * x:g} %"))
    left, right = sorted(axis.get_view_interval())
    decades = np.arange(np.floor(np.log10(left)), np.ceil(np.log10(right)))
    marks = np.outer(10.0**decades, np.arange(2.0, 10.0)).ravel()  # those beyond the view would be made but not drawn
    axis.set_minor_locator(ticker.FixedLocator(marks[(marks > 0.999 * left) & (marks < 1.001 * right)].tolist()))
    axis.set_minor_formatter(ticker.NullFormatter())


def mark(ax: Axes, x: float, y: float, colour: str) -> None:
    """Mark the nominal joint by a small triangle."""
    look: Any = {"ms": 7.5, "mec": "white", "mew": 0.7, "ls": "", "clip_on": False, "zorder": 5}
    ax.plot(x, y, "v", color=colour, label="nominal joint", **look)


def save(figure: Figure, stem: Path, suffixes: tuple[str, ...] = (".png", ".svg")) -> list[Path]:
    """Write a figure in each format; the same figure gives the same bytes.

    Returns
    -------
    list of Path
        The files written: `stem` with each suffix appended.
    """
    files = [stem.with_name(stem.name + suffix) for suffix in suffixes]
    for path, suffix in zip(files, suffixes, strict=True):
        with settings(), atomic_write(path) as temporary, temporary.open("wb") as file:
            metadata = {"Date": None} if suffix.lower() == ".svg" else None
            figure.savefig(file, format=suffix.lower().lstrip("."), dpi=150, metadata=metadata)
    return files
