"""Histograms of the leading loads, and of the errors that each entry of the tolerances drew."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from tolstat.analysis.sample import Sample
from tolstat.common import loads, units
from tolstat.common.errors import TolstatError
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Axes, Panel, Panels, Part, Sentence
from tolstat.questions.shares import inapplicable
from tolstat.store.view import View
from tolstat.study import axes
from tolstat.study.tolerances.entry import SingleEntry

JOINTS = 20_000
"""Maximum number of joints (the first ones) whose errors are counted."""
BINS = 30
"""Number of bins."""


class Drawn(NamedTuple):
    """Errors that an entry of ``[tolerances]`` drew, all in one histogram.

    Attributes
    ----------
    entry : str
        Pattern of the entry.
    number : str
        What its number is, see `study.tolerances.entry.Meaning`.
    errors : tuple of str
        Errors that it sets, columns of the table ERROR.
    unit : str
        Their SI unit.
    band : tuple of float, optional
        Lower and upper limit of the drawing, SI; None for a zone, and where none is given.
    outside : float
        Share of the values outside the band; NaN without one.
    others : tuple of str
        Patterns of other entries that the same errors include, such as that of the tilt of a pair in its positions.
    edges : ndarray, shape (m + 1,)
        Edges of the bins, ascending, SI.
    share : ndarray, shape (m,)
        Share of the values, of all these errors in all joints, in each bin.
    """

    entry: str
    number: str
    errors: tuple[str, ...]
    unit: str
    band: tuple[float, float] | None
    outside: float
    others: tuple[str, ...]
    edges: loads.FloatArray
    share: loads.FloatArray


def histograms(view: View) -> Answer:
    """Draw histograms of the loads, and of the errors drawn.

    Parameters
    ----------
    view : View
        A campaign of a study whose joints are drawn from tolerances.

    Returns
    -------
    Answer
        Pictures of the leading loads, and of the errors of each entry of the tolerances, see `of_load` and `drawn`.

    Raises
    ------
    NotApplicable
        When the joints are no sample of a production, or there are none.
    """
    parts: list[Part] = []
    if view.sampled and view.leading and view.count(*VALID):
        parts.append(Panels([_load_panel(load) for load in view.loads(view.leading)]))
    errors: list[Drawn] = []
    with suppress(TolstatError):  # a study that can no longer be read
        errors = drawn(view)
    if errors:
        words = "Small pictures: all errors that an entry of the tolerances sets, in one histogram; between the dashed "
        words += f"lines its tolerance band.{f' The first {JOINTS} joints.' if view.n > JOINTS else ''}"
        pictures = Panels([_drawn_panel(histogram, k, errors) for k, histogram in enumerate(errors)], small=True)
        parts += [pictures, Sentence(words)]
    if not parts:
        remedy = "give the result file of a study with [tolerances] whose joints are drawn at random"
        raise inapplicable(view, "holds no errors or loads of a random sample", remedy)
    return Answer("histograms", "What was drawn, and the loads that came of it", parts)


def drawn(view: View) -> list[Drawn]:
    """Histogram of the errors of each entry, in the study's order, over the first `JOINTS` joints.

    Entries that say more than one thing, such as zones of offset and tilt, have
    several; empty for joints that are no sample of a production, and for a study without tolerances.

    Raises
    ------
    InputError, StoreError
        When the study cannot be read.
    """
    errors_of: dict[tuple[Any, ...], dict[str, None]] = {}
    entries_of: dict[str, list[str]] = {}
    for entry in view.study.entries if view.sampled and view.n else ():
        for site, model in entry.models:
            band, meanings = model.band(site) if isinstance(model, SingleEntry) else None, model.meaning(site)
            moved = set()
            for meaning in meanings:
                key = (entry.pattern, meaning.number, meaning.unit, band)
                errors_of.setdefault(key, {}).update(dict.fromkeys(meaning.errors))
                moved |= {*meaning.errors}
            feature, _, kind = site.name.rpartition(".")
            if axes.is_pair(feature) and kind in axes.ORIENTATIONS:  # the tilt of a pair's axis moves both its features
                moved |= {*axes.columns_of(site.name)}
            for name in moved:
                entries_of.setdefault(name, []).append(entry.pattern)
    if not errors_of:
        return []
    samples = np.arange(min(view.n, JOINTS))
    table = view.errors(samples, sorted({name for names in errors_of.values() for name in names}))
    histograms = []
    for (pattern, number, unit, band), names in errors_of.items():
        others = dict.fromkeys(other for name in names for other in entries_of[name] if other != pattern)
        counted = _counted(np.concatenate([table[name] for name in names]), band)
        histograms.append(Drawn(pattern, number, tuple(names), unit, band, counted[0], tuple(others), *counted[1:]))
    return histograms


def of_load(load: Sample) -> tuple[loads.FloatArray, loads.FloatArray]:
    """Histogram of a load over its valid joints; bins of equal ratio where it has a long tail.

    Returns
    -------
    edges : ndarray, shape (m + 1,)
        Edges of the bins, ascending, SI.
    share : ndarray, shape (m,)
        Share of the joints in each bin.
    """
    values = load.values[load.is_valid]
    low, high = float(values.min()), float(values.max())
    high = high if high > low else low + max(1e-3 * abs(low), 1e-12)
    edges = np.geomspace(low, high, BINS + 1) if load.long_tailed else np.linspace(low, high, BINS + 1)
    edges[0], edges[-1] = low, high  # rounding must not put the extreme values outside
    return edges, _shares(values, edges)


def _counted(
    values: loads.FloatArray, band: tuple[float, float] | None
) -> tuple[float, loads.FloatArray, loads.FloatArray]:
    """Share outside the band, edges, and shares in the bins; the bins cover values and band."""
    ends = band or ()
    outside = ((values < band[0]) | (values > band[1])).mean() if band else np.nan
    low, high = min([values.min(), *ends]), max([values.max(), *ends])
    edges = np.linspace(low, high, BINS + 1) if high > low else np.array([low, low + max(abs(low), 1e-9) * 1e-3])
    return float(outside), edges, _shares(values, edges)


def _shares(values: loads.FloatArray, edges: loads.FloatArray) -> loads.FloatArray:
    return np.asarray(np.histogram(values, edges)[0] / values.size)


def _load_panel(load: Sample) -> Panel:
    median, most = (text.value(load.quantile(share).estimate, load.unit) for share in (0.5, 0.95))
    scale = "logarithmic" if load.long_tailed else "linear"
    title = f"{load.name}: distribution of the joints"
    words = f"Half of the joints are below {median}, 95 % below {most}; scale of loads {scale}"
    return Panel(f"histogram-{load.name}", title, words, partial(_draw_load, load=load), (drawing.WIDTH, 2.7))


def _draw_load(ax: Axes, load: Sample) -> None:
    edges, share = of_load(load)
    _bars(ax, edges, 100.0 * share)
    low, high = float(edges[0]), float(edges[-1])
    if load.limit is not None and 0.5 * low <= load.limit <= 2.0 * high:
        low, high = min(low, load.limit), max(high, load.limit)
        limit = f"limit {text.value(load.limit, load.unit)}"
        ax.axvline(load.limit, color=style.INK, lw=1.4, ls=(0.0, (8.0, 3.0)), label=limit)
    if load.long_tailed:
        unit = drawing.log_loads(ax.xaxis, 0.95 * low, 1.05 * high, load.limit or high, load.unit)
    else:
        margin = 0.03 * (high - low)
        ax.set_xlim(low - margin, high + margin)
        ax.xaxis.set_major_locator(style.ticker.MaxNLocator(6))
        unit = drawing.loads_axis(ax.xaxis, load.limit or high, load.unit)
    left, right = ax.get_xlim()
    if left <= load.nominal <= right:
        style.mark(ax, load.nominal, 0.96 * ax.get_ylim()[1], style.COLOURS[0])
    ax.set(xlabel=f"{load.name} [{unit or '1'}], largest over the revolution", ylabel="share of the joints [%]")


def _drawn_panel(drawn: Drawn, k: int, every: Sequence[Drawn]) -> Panel:
    """One picture; of several with one entry each says whether it is of offsets or of tilts."""
    kinds = dict.fromkeys(name.rpartition(".")[2].partition("_")[0] for name in drawn.errors)
    kind = f", {' and '.join(kinds)}" if sum(other.entry == drawn.entry for other in every) > 1 else ""
    outside = "" if drawn.band is None else f"; {text.percent(drawn.outside)} outside"
    others = f"; includes {' and '.join(drawn.others)}" if drawn.others else ""
    title = f"{drawn.entry}{kind}: {drawn.number}{outside}{others}"
    words, draw = f"Histogram of {', '.join(drawn.errors)}", partial(_draw_errors, drawn=drawn)
    return Panel(f"drawn-errors-{k}", title, words, draw, (2.5, 1.4), 0.15, 0.06)


def _draw_errors(ax: Axes, drawn: Drawn) -> None:
    unit, factor = units.DISPLAY_UNITS.get(drawn.unit, (drawn.unit, 1.0))
    _bars(ax, factor * drawn.edges, drawn.share)
    ends = factor * np.array(drawn.band or ())
    for end in ends:
        ax.axvline(end, color=style.INK, lw=1.0, ls=(0.0, (4.0, 2.0)))
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    if drawn.band is None:
        ax.xaxis.set_major_locator(style.ticker.MaxNLocator(3))
    else:
        marks = (ends[0], ends.mean(), ends[1])
        ax.set_xticks(marks, [f"{x:.3g}" for x in marks])
    ax.grid(visible=False)
    ax.set_xlabel(f"[{unit or '1'}]")


def _bars(ax: Axes, edges: loads.FloatArray, share: loads.FloatArray) -> None:
    ax.stairs(share, edges, fill=True, color=style.COLOURS[0], alpha=0.55)
    ax.stairs(share, edges, color=style.COLOURS[0], lw=1.0)
    ax.set_ylim(0.0, 1.08 * max(float(share.max()), 1e-10))
