"""Fatigue by loads: rainflow cycles of the joints, also for pyLife, damage-equivalent loads, damage sums, spectra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import cycles, prediction
from tolstat.analysis.cycles import Cycles
from tolstat.analysis.sample import Sample
from tolstat.common import load_kinds, loads, strict
from tolstat.common.channels import BUSHING_LOADS, CHANNELS, LoadHistory, channels_of, histories_of
from tolstat.common.errors import Fault, StoreError, raise_all
from tolstat.common.late import pandas as pd
from tolstat.common.tables import SIMULATED, Status
from tolstat.display.table import Row, Rows
from tolstat.questions.fatigue import duty
from tolstat.questions.fatigue.duty import ANY, CONFIDENCE, Joints, only
from tolstat.solver.histories import KEPT, count
from tolstat.store import hdf5, reader, revolutions
from tolstat.store.view import View
from tolstat.study.selection import select

SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints at which quantiles are given."""
MAX_NUMBERS = 40
"""Maximum number of points of a spectrum."""
SHOWN = tuple(channel.name for channel in CHANNELS.values() if channel.kind.shown)
"""Channels that are evaluated unless others are asked for: those of the loads that every report shows."""


def channels(patterns: Sequence[str]) -> tuple[str, ...]:
    """Names of the channels that any of the patterns selects, in the order of `channels.CHANNELS`.

    Raises
    ------
    InputError
        With every pattern that selects nothing.
    """
    selected = {pattern: select(pattern, CHANNELS) for pattern in patterns}
    raise_all(
        Fault(f"channel {pattern!r}", "selects nothing", strict.did_you_mean(pattern, list(CHANNELS)[:8]))
        for pattern, names in selected.items()
        if not names
    )
    return tuple(name for name in CHANNELS if any(name in names for names in selected.values()))


def cycles_of(store: reader.Reader, slots: NDArray[np.intp], names: Sequence[str] | None = None) -> Cycles:
    """Rainflow cycles of joints over one revolution.

    Cycles stored by the workers (``histories = "cycles"``) are read. Otherwise they are counted now, from the load
    histories or from the loads restored from harmonics.

    Parameters
    ----------
    store : ResultFile
        The campaign.
    slots : ndarray of int, shape (m,)
        File slots, ascending.
    names : sequence of str, optional
        Channels to keep; by default those `SHOWN`, 64 of bushings: some 8 kB per joint.

    Returns
    -------
    Cycles
        Row i is the joint ``slots[i]``; NaN for joints without results.

    Raises
    ------
    StoreError
        When the file holds no histories.
    """
    if not store.history_specs:
        remedy = 'set histories = "cycles" in [output] of the study: tolstat run STUDY --out OTHER.h5'
        raise StoreError(str(Fault(str(store.path), "holds neither cycles nor load histories", remedy)))
    names = SHOWN if names is None else tuple(names)
    histories = histories_of(names)
    order = [channel.name for history in histories for channel in channels_of(history)]
    columns = [order.index(name) for name in names]
    lacking = [name for h in histories if (name := f"{h.prefix}cycles") not in store.history_specs]
    if lacking and "cycles" in store.history_specs and not revolutions.held(store, histories):
        raise StoreError(str(Fault(str(store.path), f"holds no {', '.join(lacking)}", hdf5.RUN_AGAIN)))
    table = np.empty((len(slots), len(names), KEPT, 2), np.float32)
    number = np.empty((len(slots), len(names)))
    for part in revolutions.blocks(len(slots)):
        counted, counts = _count(store, slots[part], histories)
        table[part], number[part] = counted[:, columns], counts[:, columns]
    status = store.status(slice(int(slots.max(initial=-1)) + 1))[slots]
    without = ~np.isin(status, SIMULATED)
    table[without], number[without] = np.nan, np.nan
    used = max(1, int(np.max(number, initial=0.0, where=np.isfinite(number))))
    table = table[..., :used, :]
    return Cycles.of_revolution(names, table[..., 0], table[..., 1], number)


def _count(
    store: reader.Reader, slots: NDArray[np.intp], histories: Sequence[LoadHistory]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Cycles of a few joints, and their numbers, as `histories.count` gives them; history after history."""
    names = [[f"{history.prefix}{name}" for history in histories] for name in ("cycles", "cycle_count")]
    if set(names[0]) <= set(store.history_specs):
        counted = {name: store.histories(name, slots) for group in names for name in group}
    else:
        turns = revolutions.loads(store, slots, [BUSHING_LOADS, *(h for h in histories if h != BUSHING_LOADS)])
        joints = [count({name: group[i] for name, group in turns.items()}) for i in range(len(slots))]
        counted = {name: np.stack([joint[name] for joint in joints]) for group in names for name in group}
    cycles, counts = (np.concatenate([counted[name] for name in group], axis=1) for group in names)
    return cycles, counts


@dataclass(frozen=True)
class Loading(Joints):
    """Load cycles of joints.

    Attributes
    ----------
    cycles : Cycles
        Cycles of the n samples.
    nominal : Cycles
        Cycles of the nominal joint; no rows if there is none that settled.
    """

    cycles: Cycles
    nominal: Cycles


def load_cycles(
    views: Sequence[View],
    shares: Sequence[float] | None = None,
    names: Sequence[str] | None = None,
    samples: int | None = None,
) -> Loading:
    """Rainflow cycles of a campaign, or of the same joints at the several operating points of a duty cycle.

    Parameters
    ----------
    views : sequence of View
        One campaign, whose operating points are the duty cycle if it has several; or the same joints in a campaign for
        each operating point.
    shares : sequence of float, optional
        Share of the revolutions in each of several campaigns; the sum is 1. Those of the operating points of one
        campaign follow from their shares of the time and their speeds, see `View.shares_of_revolutions`.
    names : sequence of str, optional
        Channels to keep, keys of `channels.CHANNELS`; by default those of bushings and those with an S–N line, some
        8 kB per joint.
    samples : int, optional
        Number of samples, from the first; by default all.

    Raises
    ------
    InputError
        When the shares are not shares or not known, or the campaigns have different joints.
    StoreError
        When a file holds no histories, or joints that are no sample of a production.
    """
    views, shares = duty.members(views, shares)
    joints = duty.joints_of(views, shares, samples)
    if names is None:
        names = tuple(name for name in CHANNELS if name in SHOWN or name in joints.settings.lines)
    parts = []
    for view in views:
        first, end = map(int, view.slots([0, joints.status.size]))
        whole = cycles_of(view.store, np.arange(end), names)  # a nominal joint is before the samples
        settled = int((view.nominal["status"] == Status.OK).sum())
        parts.append((whole.rows(slice(first, None)), whole.rows(slice(settled))))
    # the nominal joint of a duty cycle has settled at all operating points, or it has no row
    rows = slice(min(len(nominal.number) for _, nominal in parts))
    mixed = _mixed(joints, [samples for samples, _ in parts], shares)
    nominal = _mixed(joints, [nominal.rows(rows) for _, nominal in parts], shares)
    return Loading(**vars(joints), cycles=mixed, nominal=nominal)


def _mixed(joints: Joints, parts: Sequence[Cycles], shares: Sequence[float]) -> Cycles:
    """Cycles over the duty cycle; those between points of loads whose largest cycle at each point is known."""
    sizes, middles = (
        np.stack([values[..., 0] for values in each], axis=2).astype(float)
        for each in ([part.ranges for part in parts], [part.means for part in parts])
    )
    sizes[sizes == 0] = np.nan  # a constant load: its level is not kept
    between = joints.transitions(middles - 0.5 * sizes, middles + 0.5 * sizes)
    if between is not None:
        unknown = np.isnan(between.ranges) & ~np.isnan(parts[0].number)[..., None]
        between.ranges[unknown] = between.repeats[unknown] = 0.0
    return cycles.duty_cycle(parts, shares, between)


def equivalent_loads(loading: Loading) -> Rows:
    """Quantiles over the joints of the damage-equivalent loads.

    Parameters
    ----------
    loading : Loading
        Cycles of the joints.

    Returns
    -------
    sequence of mapping
        One row per exponent, channel and share of `SHARES`: ``channel``, ``unit``, ``m``, ``nominal``, ``lacking``
        (upper bound of the relative increase of the sum of S^m by cycles that the file does not hold, maximum over the
        joints), the fields of `analysis.estimates.Quantile`, ``confidence``. Loads are ranges in SI units.
    """
    settings, rows = loading.settings, list[Row]()
    for m in settings.exponents:
        values, nominal = (
            cycles.equivalent_load(counted, m, settings.revolutions, settings.reference_cycles)
            for counted in (loading.cycles, loading.nominal)
        )
        lacking = cycles.truncation_bound(loading.cycles, m)
        for c, channel in enumerate(loading.cycles.channels):
            head = {"channel": channel, "unit": CHANNELS[channel].unit, "m": m, "nominal": only(nominal[:, c])}
            head["lacking"] = float(lacking[:, c].max(initial=0.0))
            rows += _quantiles(head, values[:, c], loading)
    return rows


def _quantiles(head: Row, values: loads.FloatArray, loading: Loading) -> Rows:
    """A row for each of `SHARES` of the joints: the head, and the quantile of their values."""
    sample = Sample.of(values, loading.status, loading.design)
    quantiles = [sample.quantile(share, CONFIDENCE)._asdict() for share in SHARES]
    return [{**head, **quantile, "confidence": CONFIDENCE} for quantile in quantiles]


def damages(loading: Loading, delivery: int = prediction.DELIVERY) -> Rows:
    """Share of the joints whose damage sum in the service life exceeds 1, for each channel that has an S–N line.

    Returns
    -------
    sequence of mapping
        One row per channel and, of several, `ANY` for joints with any of these damage sums above 1 (it has no line):
        ``channel``, ``m``, ``S0`` (N or N m), ``N0``, ``nominal`` (damage of the nominal joint), ``median`` (of the
        joints), the fields of `analysis.estimates.Exceedance` for the level 1, ``next_lower`` and ``next_upper``
        (prediction interval for the joints above 1 in the next delivery), ``confidence``.
    """
    lines, life = loading.settings.lines, loading.settings.revolutions
    sums = {
        channel: [
            cycles.damage(part.of(channel), cycles.Line(*line), life)[:, 0]
            for part in (loading.cycles, loading.nominal)
        ]
        for channel, line in lines.items()
        if channel in loading.cycles.channels
    }
    if len(sums) > 1:
        sums[ANY] = [np.maximum.reduce(every) for every in zip(*sums.values(), strict=True)]
    rows = []
    for channel, (damage, nominal) in sums.items():
        sample = Sample.of(damage, loading.status, loading.design)
        row = {"channel": channel, **cycles.Line(*lines.get(channel, [np.nan] * 3))._asdict(), "nominal": only(nominal)}
        row |= {"median": sample.quantile(0.5).estimate} | asdict(sample.above(1.0, CONFIDENCE))
        row |= prediction.columns(sample.delivery(1.0, delivery, CONFIDENCE), delivery) | {"confidence": CONFIDENCE}
        rows.append(row)
    return rows


def spectrum(loading: Loading, channel: str) -> Rows:
    """Cumulative load spectrum: quantiles over the joints of the range that a number of cycles reaches or exceeds.

    Returns
    -------
    sequence of mapping
        One row per number and share of `SHARES`: ``channel``, ``unit``, ``cycles`` (in the service life), ``nominal``,
        the fields of `analysis.estimates.Quantile` (intervals are pointwise), ``confidence``. Ranges in SI units,
        ascending numbers.
    """
    part = loading.cycles.of(channel)
    order = np.argsort(-part.ranges[:, 0], axis=1)
    steps = np.cumsum(np.take_along_axis(part.repeats[:, 0], order, axis=1), axis=1)
    steps = steps[np.take_along_axis(part.ranges[:, 0], order, axis=1) > 0]
    numbers = np.unique(np.append(steps.round(9), 1.0))  # at which the spectra of the joints have steps
    numbers = numbers[np.linspace(0, numbers.size - 1, min(numbers.size, MAX_NUMBERS)).round().astype(int)]
    values, nominal = (cycles.spectrum(each.of(channel), numbers)[:, 0] for each in (loading.cycles, loading.nominal))
    head, rows = {"channel": channel, "unit": CHANNELS[channel].unit}, list[Row]()
    for number, ranges, ideal in zip(numbers, values.T, nominal.T, strict=True):
        columns = {"nominal": only(ideal), "cycles": number * loading.settings.revolutions}
        rows += _quantiles(head | columns, ranges, loading)
    return rows


def most_loaded(rows: Rows) -> list[str]:
    """Channel with the largest equivalent load for each kind of loads at each place, from `equivalent_loads`.

    Evaluated at the middle exponent and the highest share. Moduli, whose cycles are not those of a component, are used
    only if the table has nothing else. Empty if no joint has a valid result.
    """
    exponents = sorted({row["m"] for row in rows})
    last = [row for row in rows if row["share"] == SHARES[-1] and row["m"] == exponents[len(exponents) // 2]]
    valid = [row for row in last if not np.isnan(row["estimate"])]
    largest: dict[tuple[str, str], Row] = {}
    for row in [row for row in valid if not CHANNELS[row["channel"]].is_modulus] or valid:
        key = CHANNELS[row["channel"]].place, CHANNELS[row["channel"]].kind.key
        largest[key] = max(largest.get(key, row), row, key=lambda row: float(row["estimate"]))
    return [row["channel"] for row in largest.values()]


def leading(rows: Rows) -> list[str]:
    """Channel with the largest equivalent load for force and torque of the cross bushings and of the fork bushings.

    Candidates are the channels `most_loaded` of the table; all exponents count.
    """
    names, chosen = most_loaded(rows), []
    candidates = [row for row in rows if row["share"] == SHARES[-1] and row["channel"] in names]
    for group, kind in loads.PANELS:
        of_group = [row for row in candidates if CHANNELS[row["channel"]].kind == kind]
        of_group = [row for row in of_group if load_kinds.PLACES[CHANNELS[row["channel"]].place].group == group]
        chosen += [max(of_group, key=lambda row: float(row["estimate"]))["channel"]] if of_group else []
    return chosen


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
    table = pylife_table(view, channels, bins, revolutions, nominal)
    levels = [
        pd.IntervalIndex.from_arrays(table[f"{name}_left"], table[f"{name}_right"], closed="left") for name in INTERVALS
    ]
    names = [*INTERVALS, "joint", "channel"]
    index = pd.MultiIndex.from_arrays([*levels, table["joint"], table["channel"]], names=names)
    return pd.Series(table["cycles"].to_numpy(float), index, name="cycles")


def pylife_table(
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
                edge = np.searchsorted(edges, sizes, side="right") - 1
                ends[:, kind] = edges[edge], edges[edge + 1]
        columns |= dict(zip((f"{name}_left", f"{name}_right"), ends, strict=True))
    keys = ["joint", "channel", *(f"{name}_{side}" for name in INTERVALS for side in ("left", "right"))]
    frame = pd.DataFrame(columns | {"cycles": cycles.repeats[joint, channel, cycle] * revolutions})
    classes = frame.groupby([*keys[:2], "unit", *keys[2:]])[["cycles"]].sum().reset_index()
    classes["channel"] = np.array(cycles.channels, dtype=object)[classes["channel"]]
    return classes
