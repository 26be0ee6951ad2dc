"""Share of a revolution in which a load is above a level; not the share of joints that exceed the level."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat.analysis import cycles, exceedance, quantile
from tolstat.analysis.exceedance import FloatArray
from tolstat.common.draw_records import check_equal_weights
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import BUSHINGS, CHANNELS, Status
from tolstat.store import ResultStore, revolutions
from tolstat.study.selection import Entry, quantity

SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints at which quantiles of the time above are given."""
POINTS = 60
"""Number of levels of a curve."""
_COMPONENTS = ("F_e", "F_t", "F_z", "T_e", "T_t", "T_z")


class TimeAbove(NamedTuple):
    """Time above levels within a revolution, over the joints.

    Attributes
    ----------
    name : str
        Name of the study.
    joints, lost : int
        Joints with and without a valid revolution, those pending not counted.
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
    lost: int
    table: pd.DataFrame
    curves: pd.DataFrame


def of_store(
    store: ResultStore,
    by: Sequence[str] = (),
    levels: Sequence[str] = (),
    curves: bool = False,
    confidence: float = 0.95,
) -> TimeAbove:
    """Estimate for which share of a revolution loads are above levels.

    Parameters
    ----------
    store : ResultStore
        File of a campaign with histories, in full or as harmonics.
    by : sequence of str
        Loads of bushings, `tables.CHANNELS`: ``cross1.F``, ``fork2.T_e``; by default those that have a limit.
    levels : sequence of str
        ``"700 N"``; by default the load's limit. A level applies to all loads of its unit.
    curves : bool
        Whether to evaluate `POINTS` levels of each load as well.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    Duration
        Table and curves.

    Raises
    ------
    InputError
        With every fault of loads and levels.
    StoreError
        When the file holds no histories, or no sample of a production, or no valid joint.
    """
    check_equal_weights(store.sampling, store.path)
    if store.sampling["method"] in ("cases", "sweep"):
        remedy = 'give the file of a study with sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(store.path), "holds joints that are no sample of a production", remedy)))
    asked = _asked(store, by, levels)
    status = store.status()
    if store.sampling["nominal_first"] and store.rows.start == 0:
        status[0] = Status.PENDING  # the nominal joint is not part of the sample
    counted = np.flatnonzero(status == Status.OK)
    lost = int(np.sum(status != Status.PENDING)) - counted.size
    if not counted.size:
        raise StoreError(str(Fault(str(store.path), "has no joint with a valid revolution", "run the campaign on")))
    iid = store.sampling["method"] == "random"
    shares, ends = _shares(store, counted, asked)
    rows = list(_rows(asked, shares, iid, confidence))
    more: list[dict[str, Any]] = []
    if curves:
        spread = {name: np.linspace(*ends[name], POINTS) for name in asked}
        more = list(_rows(spread, _shares(store, counted, spread)[0], iid, confidence))
    return TimeAbove(store.study_name, counted.size, lost, pd.DataFrame(rows), pd.DataFrame(more))


def channel(loads: NDArray[Any], name: str) -> FloatArray:
    """One load of joints over a revolution.

    Parameters
    ----------
    loads : ndarray, shape (n, samples, 8, 6)
        As `revolutions.loads` returns them.
    name : str
        One of `tables.CHANNELS`.

    Returns
    -------
    ndarray, shape (n, samples)
        A component, or the modulus of force or torque; N or N m.
    """
    bushing, _, load = name.partition(".")
    own = loads[:, :, BUSHINGS.index(bushing)].astype(float)
    if load in _COMPONENTS:
        return np.asarray(own[..., _COMPONENTS.index(load)])
    return np.asarray(np.linalg.norm(own[..., :3] if load == "F" else own[..., 3:], axis=-1))


def _asked(store: ResultStore, by: Sequence[str], levels: Sequence[str]) -> dict[str, FloatArray]:
    """Levels of each load, SI."""
    faults: list[Fault] = []
    names = list(by) or [name for name in store.limits if name in CHANNELS]
    if not names:
        faults.append(Fault("--by", "the study limits no load of a bushing", "name one: --by cross1.F"))
    faults += [
        Fault("--by", f"{name!r} is no load of a bushing", did_you_mean(name, list(CHANNELS)))
        for name in names
        if name not in CHANNELS
    ]
    units = {CHANNELS[name] for name in names if name in CHANNELS}
    given: dict[str, list[float]] = {unit: [] for unit in units}
    for text in levels if units else ():
        with gather(faults):
            unit, value = _level(text, sorted(units))
            given[unit].append(value)
    found = {}
    for name in (name for name in names if name in CHANNELS):
        own = given[CHANNELS[name]] or ([] if levels or name not in store.limits else [store.limits[name]])
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
    store: ResultStore, rows: NDArray[np.intp], levels: Mapping[str, FloatArray]
) -> tuple[dict[str, FloatArray], dict[str, tuple[float, float]]]:
    """Share of the revolution above each level, (n, levels), and least and largest value, of each load."""
    shares = {name: np.empty((len(rows), len(own))) for name, own in levels.items()}
    ends = dict.fromkeys(levels, (np.inf, -np.inf))
    for begin in range(0, len(rows), revolutions.JOINTS_PER_READ):
        block = revolutions.loads(store, rows[begin : begin + revolutions.JOINTS_PER_READ])
        for name, own in levels.items():
            load = channel(block, name)
            ends[name] = min(ends[name][0], float(load.min())), max(ends[name][1], float(load.max()))
            for k, level in enumerate(own):
                shares[name][begin : begin + len(load), k] = cycles.share_of_revolution_above(load, float(level))
    return shares, ends


def _rows(
    levels: Mapping[str, FloatArray], shares: Mapping[str, FloatArray], iid: bool, confidence: float
) -> Iterator[dict[str, Any]]:
    """One row per load and level, as in `TimeAbove`."""
    for name, own in levels.items():
        for level, time in zip(own, shares[name].T, strict=True):
            every = np.full(time.size, int(Status.OK))
            above = exceedance.at(time, every, 0.0, confidence, iid)
            row = {"load": name, "unit": CHANNELS[name], "level": float(level)}
            row |= _ends("joints_above", above.estimate, above.lower, above.upper)
            # a variable in [0, 1] has at most the variance of a Bernoulli variable with the same mean
            mean = exceedance.clopper_pearson(time.sum(), time.size, confidence) if iid else (np.nan, np.nan)
            row |= _ends("time", float(time.mean()), *map(float, mean))
            for share in SHARES:
                q = quantile.at(time, every, share, confidence, iid)
                lower, upper = np.clip([q.lower, q.upper], 0.0, 1.0)
                row |= _ends(f"time_{100 * share:g}", q.estimate, lower, upper)
            yield row


def _ends(name: str, estimate: float, lower: float, upper: float) -> dict[str, float]:
    return {name: estimate, f"{name}_lower": lower, f"{name}_upper": upper}
