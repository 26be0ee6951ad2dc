"""Histograms on the page: loads, and the errors that each entry of the tolerances drew."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from tolstat.analysis.sample import Sample
from tolstat.common.tables import VALID
from tolstat.common.units import DISPLAY_UNITS
from tolstat.display import drawing, style, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Text
from tolstat.questions.histograms import query
from tolstat.questions.histograms.query import Drawn, Histogram
from tolstat.store.view import View


def sections(view: View, asked: Asked) -> list[Section]:
    """Histograms of the leading loads and of the errors drawn; none for joints that are no sample of a production."""
    if not view.sampled:
        return []
    blocks: list[Block] = []
    if view.leading and view.count(*VALID):
        blocks.append(Panels([_load_panel(load) for load in view.loads(view.leading)]))
    with asked.noting("no histograms of errors"):
        found = query.drawn(view)
        if found:
            blocks.append(Panels([_drawn_panel(own, k, found) for k, own in enumerate(found)], small=True))
            blocks.append(Text(_note(view), small=True))
    return [Section("histograms", "What was drawn, and the loads that came of it", blocks)] if blocks else []


def _note(view: View) -> str:
    said = (
        "Small pictures: all errors that an entry of the tolerances sets, in one histogram; between the dashed lines "
    )
    said += "its tolerance band."
    if view.n > query.JOINTS:
        said += f" The first {query.JOINTS} joints."
    return f"{said} {view.design.counting}".rstrip()


def _load_panel(load: Sample) -> Panel:
    median, most = (text.value(load.quantile(share).estimate, load.unit) for share in (0.5, 0.95))
    scale = ", logarithmic" if load.long_tailed else ""
    return Panel(
        f"histogram-{load.name}",
        f"{load.name}: distribution of the joints",
        f"Half of the joints are below {median}, 95 % below {most}; scale of loads{scale or ' linear'}",
        partial(_load, load=load),
        (4.9, 2.7),
    )


def _load(ax: Axes, load: Sample) -> None:
    found = query.of_load(load)
    _bars(ax, found, 100.0)
    low, high = float(found.edges[0]), float(found.edges[-1])
    if load.limit is not None and 0.5 * low <= load.limit <= 2.0 * high:
        low, high = min(low, load.limit), max(high, load.limit)
        ax.axvline(load.limit, color=style.INK, lw=1.4, ls=(0.0, (8.0, 3.0)))
        ax.annotate(
            f"limit {text.value(load.limit, load.unit)}", (load.limit, 1.015), xycoords=ax.get_xaxis_transform(),
            ha="center", va="bottom",
        )  # fmt: skip
    if load.long_tailed:
        unit = drawing.log_loads(ax, 0.95 * low, 1.05 * high, load.limit or high, load.unit)
    else:
        margin = 0.03 * (high - low)
        ax.set_xlim(low - margin, high + margin)
        ax.xaxis.set_major_locator(MaxNLocator(6))
        unit = drawing.loads_axis(ax.xaxis, load.limit or high, load.unit)
    left, right = ax.get_xlim()
    if left <= load.nominal <= right:
        style.mark(ax, load.nominal, ax.get_ylim()[1], style.COLOURS[0])
    ax.set(xlabel=f"{load.name} [{unit or '1'}], largest over the revolution", ylabel="share of the joints [%]")


def _drawn_panel(found: Drawn, k: int, every: list[Drawn]) -> Panel:
    """One picture; of several with one entry each says whether it is of offsets or of tilts."""
    kinds = dict.fromkeys(name.partition(".")[2].partition("_")[0] for name in found.errors)
    kind = f", {' and '.join(kinds)}" if sum(own.entry == found.entry for own in every) > 1 else ""
    outside = "" if found.band is None else f"; {text.percent(found.outside)} outside"
    return Panel(
        f"drawn-errors-{k}",
        f"{found.entry}{kind}: {found.number}{outside}",
        f"Histogram of {', '.join(found.errors)}",
        partial(_drawn, found=found),
        (2.5, 1.4),
        0.15,
        0.06,
    )


def _drawn(ax: Axes, found: Drawn) -> None:
    unit, factor = DISPLAY_UNITS.get(found.unit, (found.unit, 1.0))
    histogram = Histogram(factor * found.histogram.edges, found.histogram.share)
    _bars(ax, histogram, 1.0)
    for end in found.band or ():
        ax.axvline(factor * end, color=style.INK, lw=1.0, ls=(0.0, (4.0, 2.0)))
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    if found.band is None:
        ax.xaxis.set_major_locator(MaxNLocator(3))
    else:
        ends = np.array(found.band) * factor
        ax.set_xticks([ends[0], ends.mean(), ends[1]], [f"{x:.3g}" for x in (ends[0], ends.mean(), ends[1])])
    ax.grid(visible=False)
    ax.set_xlabel(f"[{unit or '1'}]")


def _bars(ax: Axes, found: Histogram, factor: float) -> None:
    ax.stairs(factor * found.share, found.edges, fill=True, color=style.COLOURS[0], alpha=0.55)
    ax.stairs(factor * found.share, found.edges, color=style.COLOURS[0], lw=1.0)
    ax.set_ylim(0.0, 1.08 * factor * max(float(found.share.max()), 1e-12))
