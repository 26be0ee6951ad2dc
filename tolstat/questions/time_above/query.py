"""Share of a revolution in which a load is above a level; not the share of joints that exceed the level."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat.analysis import binomial, cycles
from tolstat.analysis.design import Design
from tolstat.analysis.sample import Sample
from tolstat.common.channels import CHANNELS, histories_of
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.loads import FloatArray
from tolstat.common.shown import shown
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import Status
from tolstat.store import revolutions
from tolstat.store.view import View
from tolstat.study.selection import Entry, quantity

SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints at which quantiles of the time above are given."""
POINTS = 60
"""Number of levels of a curve."""


@shown
class TimeAbove(NamedTuple):
    """Time above levels within a revolution, over the joints.

    Attributes
    ----------
    name : str
        Name of the study.
    joints, left_out : int
        Joints with and without a settled revolution, those pending not counted.
    table : DataFrame
        One row per load and level, SI: ``load``, ``unit``, ``level``; ``joints_above`` (share of the joints that are
        above the level at any time), with ``_lower`` and ``_upper``; ``time`` (mean share of the revolution over the
        joints), with ends; ``time_50``, ``time_90``, ``time_99`` (share of the revolution that this percentage of the
        joints does not exceed), with ends. NaN ends for dependent samples.
    curves : DataFrame
        The same columns for many levels of each load; empty unless asked for.
    """

    name: str
    joints: int
    left_out: int
    table: pd.DataFrame
    curves: pd.DataFrame


def time_above(
    view: View,
    by: Sequence[str] = (),
    levels: Sequence[str] = (),
    curves: bool = False,
    confidence: float = 0.95,
) -> TimeAbove:
    """Estimate for which share of a revolution loads are above levels.

    Parameters
    ----------
    view : View
        A campaign with load histories, in full or as harmonics.
    by : sequence of str
        Loads over the input angle, `channels.CHANNELS`: ``cross1.F``, ``fork2.T_e``, ``output.moment``; by default
        those that have a limit.
    levels : sequence of str
        ``"700 N"``; by default the load's limit. A level applies to all loads of its unit.
    curves : bool
        Whether to evaluate `POINTS` levels of each load as well.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    TimeAbove

    Raises
    ------
    InputError
        With every fault of loads and levels.
    StoreError
        When the file holds no histories, joints that are no sample of a production, or no settled joint.
    """
    view.check("mean")
    asked = _levels(view, by, levels)
    settled = np.flatnonzero(view.status == Status.OK)
    if not settled.size:
        raise StoreError(str(Fault(str(view.path), "has no settled joint", "resume the campaign")))
    shares, ends = _shares(view, settled, asked)
    design = view.design.only(settled)
    rows = list(_rows(asked, shares, design, confidence))
    more: list[dict[str, Any]] = []
    if curves:
        spread = {name: np.linspace(*ends[name], POINTS) for name in asked}
        more = list(_rows(spread, _shares(view, settled, spread)[0], design, confidence))
    left_out = view.counts.done - settled.size
    return TimeAbove(view.name, settled.size, left_out, pd.DataFrame(rows), pd.DataFrame(more))


def _levels(view: View, by: Sequence[str], levels: Sequence[str]) -> dict[str, FloatArray]:
    """Levels of each load that is asked for, SI."""
    faults: list[Fault] = []
    names = list(by) or [name for name in view.limits if name in CHANNELS]
    if not names:
        faults.append(Fault("--by", "the study limits no load over the input angle", "name one: --by cross1.F"))
    faults += [
        Fault("--by", f"{name!r} is no load over the input angle", did_you_mean(name, list(CHANNELS)))
        for name in names
        if name not in CHANNELS
    ]
    units = {CHANNELS[name].unit for name in names if name in CHANNELS}
    given: dict[str, list[float]] = {unit: [] for unit in units}
    for text in levels if units else ():
        with gather(faults):
            unit, value = _level(text, sorted(units))
            given[unit].append(value)
    found = {}
    for name in (name for name in names if name in CHANNELS):
        own = given[CHANNELS[name].unit] or ([] if levels or name not in view.limits else [view.limits[name]])
        if not own and not faults:
            faults.append(Fault("--level", f"{name} has neither a level nor a limit", 'give one: --level "700 N"'))
        found[name] = np.array(own, dtype=float)
    if faults:
        raise InputError(faults)
    return found


def _level(text: str, units: Sequence[str]) -> tuple[str, float]:
    """Unit and value of a level, in the first of the units that it can have."""
    *others, last = units
    for unit in others:
        with suppress(InputError):
            return unit, quantity(Entry(text, (text,), text), unit, "--level")
    return last, quantity(Entry(text, (text,), text), last, "--level")


def _shares(
    view: View, samples: NDArray[np.intp], levels: Mapping[str, FloatArray]
) -> tuple[dict[str, FloatArray], dict[str, tuple[float, float]]]:
    """Share of the revolution above each level, (m, levels), and smallest and largest value, of each load."""
    shares = {name: np.empty((len(samples), len(own))) for name, own in levels.items()}
    ends = dict.fromkeys(levels, (np.inf, -np.inf))
    slots = view.slots(samples)
    for part in revolutions.blocks(len(slots)):
        loads = revolutions.loads(view.store, slots[part], histories_of(levels))
        for name, own in levels.items():
            load = CHANNELS[name].of(loads)
            ends[name] = min(ends[name][0], float(load.min())), max(ends[name][1], float(load.max()))
            for k, level in enumerate(own):
                shares[name][part, k] = cycles.share_of_revolution_above(load, float(level))
    return shares, ends


def _rows(
    levels: Mapping[str, FloatArray], shares: Mapping[str, FloatArray], design: Design, confidence: float
) -> Iterator[dict[str, Any]]:
    """One row per load and level, as in `TimeAbove`."""
    for name, own in levels.items():
        for level, time in zip(own, shares[name].T, strict=True):
            sample = Sample.of(time, np.full(time.size, Status.OK), design)
            above = sample.above(0.0, confidence)
            row = {"load": name, "unit": CHANNELS[name].unit, "level": float(level)}
            row |= _ends("joints_above", above.estimate, above.lower, above.upper)
            # a variable in [0, 1] has at most the variance of a Bernoulli variable with the same mean
            known = design.has_interval("mean")
            mean = binomial.clopper_pearson(time.sum(), time.size, confidence) if known else (np.nan, np.nan)
            row |= _ends("time", float(time.mean()), *map(float, mean))
            for share in SHARES:
                q = sample.quantile(share, confidence)
                lower, upper = np.clip([q.lower, q.upper], 0.0, 1.0)
                row |= _ends(f"time_{100 * share:g}", q.estimate, lower, upper)
            yield row


def _ends(name: str, estimate: float, lower: float, upper: float) -> dict[str, float]:
    return {name: estimate, f"{name}_lower": lower, f"{name}_upper": upper}
