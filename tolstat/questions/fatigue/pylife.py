"""Load cycles in pyLife's format: a Series of cycle numbers over classes of range and mean."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tolstat.common.channels import CHANNELS
from tolstat.common.late import pandas as pd
from tolstat.questions.fatigue.loads import cycles_of
from tolstat.store.view import View

INTERVALS = ("range", "mean")


def pylife_series(
    view: View,
    channels: Sequence[str] | None = None,
    bins: int = 100,
    revolutions: float = 1.0,
    nominal: bool = False,
) -> pd.Series[float]:
    """Rainflow cycles of every joint of a file as a pyLife load collective.

    Parameters
    ----------
    view : View
        A campaign that keeps cycles or load histories.
    channels : sequence of str, optional
        Channels to keep, keys of `channels.CHANNELS`; by default those of bushings.
    bins : int
        Number of classes of the range (from 0 to the largest) and of the mean (between its extremes); one set of
        classes for all forces, one for all torques.
    revolutions : float
        Number of revolutions that the numbers of cycles refer to.
    nominal : bool
        Include the nominal joint, row 0 of the campaign.

    Returns
    -------
    pandas.Series
        Name ``cycles``; index levels ``range`` and ``mean`` (intervals closed on the left, N or N m), ``joint`` (row
        of the campaign) and ``channel``. Classes without cycles, and joints without results, are left out.

    Raises
    ------
    StoreError
        When the file holds no histories.
    ValueError
        When `bins` is less than 1.
    """
    return from_table(table(view, channels, bins, revolutions, nominal))


def table(
    view: View,
    channels: Sequence[str] | None = None,
    bins: int = 100,
    revolutions: float = 1.0,
    nominal: bool = False,
) -> pd.DataFrame:
    """Flat table of `pylife_series`: ``joint``, ``channel``, ``unit``, ends of range and mean, ``cycles``."""
    if bins < 1:
        raise ValueError(f"{bins} classes: at least 1 expected")
    first = 0 if nominal else view.store.first_sample
    cycles = cycles_of(view.store, np.arange(first, view.store.n), channels)
    joint, channel, cycle = np.nonzero(cycles.ranges > 0)  # leaves out NaN
    units = np.array([CHANNELS[name].unit for name in cycles.channels], dtype=object)[channel]
    columns: dict[str, Any] = {"joint": np.array(view.store.rows[first:])[joint], "channel": channel, "unit": units}
    for name, values in (("range", cycles.ranges), ("mean", cycles.means)):
        ends = np.zeros((2, len(joint)))
        for kind in (units != "N", units == "N"):
            sizes = values[joint, channel, cycle][kind].astype(float)
            low, high = 0.0 if name == "range" else sizes.min(initial=np.inf), sizes.max(initial=-np.inf)
            if low <= high:  # the last edge is above the largest value
                edges = np.linspace(low, high + 1e-6 * max(high - low, abs(high), 1e-300), bins + 1)
                here = np.searchsorted(edges, sizes, side="right") - 1
                ends[:, kind] = edges[here], edges[here + 1]
        columns |= dict(zip((f"{name}_left", f"{name}_right"), ends, strict=True))
    keys = ["joint", "channel", *(f"{name}_{side}" for name in INTERVALS for side in ("left", "right"))]
    frame = pd.DataFrame(columns | {"cycles": cycles.repeats[joint, channel, cycle] * revolutions})
    classes = frame.groupby([*keys[:2], "unit", *keys[2:]])[["cycles"]].sum().reset_index()
    classes["channel"] = np.array(cycles.channels, dtype=object)[classes["channel"]]
    return classes


def from_table(table: pd.DataFrame) -> pd.Series[float]:
    """Series of a flat table, as `table` makes it or ``pandas.read_csv`` reads it."""
    levels = [
        pd.IntervalIndex.from_arrays(table[f"{name}_left"], table[f"{name}_right"], closed="left") for name in INTERVALS
    ]
    names = [*INTERVALS, "joint", "channel"]
    index = pd.MultiIndex.from_arrays([*levels, table["joint"], table["channel"]], names=names)
    return pd.Series(table["cycles"].to_numpy(float), index, name="cycles")
