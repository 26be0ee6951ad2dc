"""Histograms of the errors that each entry of the tolerances drew, and of loads."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.sample import Sample
from tolstat.common.loads import FloatArray
from tolstat.store.view import View
from tolstat.study.tolerances.entry import SingleEntry

JOINTS = 20_000
"""Maximum number of joints (the first ones) whose errors are counted."""
BINS = 30
"""Number of bins."""


class Histogram(NamedTuple):
    """Shares of values in bins.

    Attributes
    ----------
    edges : ndarray, shape (m + 1,)
        Edges of the bins, ascending, SI.
    share : ndarray, shape (m,)
        Share of the values in each bin.
    """

    edges: FloatArray
    share: FloatArray


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
    histogram : Histogram
        Values of all these errors in all joints.
    """

    entry: str
    number: str
    errors: tuple[str, ...]
    unit: str
    band: tuple[float, float] | None
    outside: float
    histogram: Histogram


def drawn(view: View) -> list[Drawn]:
    """Histogram of the errors of each entry, in the study's order, over the first `JOINTS` joints.

    Joints are counted by their weights. Entries that say more than one thing, such as zones of offset and tilt, have
    several; empty for a study without tolerances.

    Raises
    ------
    InputError, StoreError
        When the study cannot be read.
    """
    found: dict[tuple[Any, ...], list[str]] = {}
    for entry in view.study.entries:
        for site, model in entry.models:
            band = model.band(site) if isinstance(model, SingleEntry) else None
            for meaning in model.meaning(site):
                found.setdefault((entry.pattern, meaning.number, meaning.unit, band), []).extend(meaning.errors)
    if not (found and view.n):
        return []
    samples = np.arange(min(view.n, JOINTS))
    table = view.errors(samples, sorted({name for names in found.values() for name in names}))
    weights = view.design.counts_as(view.n)[: len(samples)]
    return [
        _drawn(pattern, number, tuple(dict.fromkeys(names)), unit, band, table, weights)
        for (pattern, number, unit, band), names in found.items()
    ]


def _drawn(
    entry: str,
    number: str,
    errors: tuple[str, ...],
    unit: str,
    band: tuple[float, float] | None,
    table: NDArray[np.void],
    weights: FloatArray,
) -> Drawn:
    values = np.concatenate([table[name] for name in errors])
    weights = np.tile(weights, len(errors))
    outside = np.nan
    if band is not None:
        beyond = (values < band[0]) | (values > band[1])
        outside = float(weights[beyond].sum() / weights.sum())
    low, high = min([values.min(), *(band or ())]), max([values.max(), *(band or ())])
    edges = np.linspace(low, high, BINS + 1) if high > low else np.array([low, low + max(abs(low), 1e-9) * 1e-3])
    return Drawn(entry, number, errors, unit, band, outside, _counted(values, edges, weights))


def of_load(load: Sample) -> Histogram:
    """Histogram of a load over its valid joints, counted by weight; bins of equal ratio where it has a long tail."""
    values, weights = load.values[load.is_valid], load.counts_as
    low, high = float(values.min()), float(values.max())
    high = high if high > low else low + max(1e-3 * abs(low), 1e-12)
    edges = np.geomspace(low, high, BINS + 1) if load.long_tailed else np.linspace(low, high, BINS + 1)
    edges[0], edges[-1] = low, high  # rounding must not put the extreme values outside
    return _counted(values, edges, weights)


def _counted(values: FloatArray, edges: FloatArray, weights: FloatArray) -> Histogram:
    counts = np.histogram(values, edges, weights=weights)[0]
    return Histogram(edges, counts / weights.sum())
