"""Fatigue by loads: damage-equivalent loads, damage sums, spectra, and the cycles for pyLife."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from tolstat.analysis import cycles, prediction
from tolstat.analysis.sample import Sample
from tolstat.common import loads
from tolstat.common.channels import BUSHING_LOADS, components, signals_of, unit_of
from tolstat.common.errors import Fault, gather, raise_all
from tolstat.common.late import pandas as pd
from tolstat.common.load_kinds import places
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import SIMULATED
from tolstat.display.table import Row, Rows
from tolstat.questions.fatigue import counting
from tolstat.questions.fatigue.counting import ANY, CONFIDENCE, Counted, only
from tolstat.store.view import View
from tolstat.study.fatigue import Fatigue, counted_names
from tolstat.study.selection import Entry

SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints at which quantiles are given."""
MAX_NUMBERS = 40
"""Maximum number of points of a spectrum."""


def channels(patterns: Sequence[str], mechanism: Mechanism) -> tuple[str, ...]:
    """Names of the components and directions that any of the patterns selects.

    Raises
    ------
    InputError
        With every pattern that selects nothing, or what has no sign.
    """
    names, faults, order = dict[str, None](), list[Fault](), list(components(mechanism))
    for pattern in patterns:
        with gather(faults):
            names |= dict.fromkeys(counted_names(Entry(pattern, (pattern,), None), "--by", mechanism))
    raise_all(faults)
    return tuple(sorted(names, key=lambda name: order.index(name) if name in order else len(order)))


def load_cycles(view: View, names: Sequence[str] | None = None, samples: int | None = None) -> Counted:
    """Rainflow cycles of a campaign, over the duty cycle of its operating points if it has several.

    Parameters
    ----------
    view : View
        The campaign; shares of the revolutions follow from those of the time, see `View.shares_of_revolutions`.
    names : sequence of str, optional
        Components and directions, see `channels.signals_of`; by default components of bushings and what has an S–N
        line, some 6 kB per joint. Cycles of a joint that has not settled are those of its last revolution.
    samples : int, optional
        Number of samples, from the first; by default all.

    Raises
    ------
    InputError
        When the shares of the operating points are not known.
    """
    joints = counting.joints_of(view, samples)
    if names is None:
        of_bushings = (s.name for s in components(view.mechanism).values() if s.history.name == BUSHING_LOADS)
        names = tuple(dict.fromkeys((*of_bushings, *joints.settings.lines)))
    signals = [signal for name in names for signal in signals_of(name, view.mechanism)]
    simulated = np.all([np.isin(part.status[:samples], SIMULATED) for part in view.parts], axis=0)
    return counting.count(view, joints, signals, simulated)


def equivalent_loads(loading: Counted) -> Rows:
    """Quantiles over the joints of the damage-equivalent loads.

    Parameters
    ----------
    loading : Counted
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
        worst, worst_nominal = loading.cycles.worst(m), loading.nominal.worst(m)
        values, nominal = (
            cycles.equivalent_load(counted, m, settings.revolutions, settings.reference_cycles)
            for counted in (worst, worst_nominal)
        )
        lacking = cycles.truncation_bound(worst, m)
        for c, channel in enumerate(worst.channels):
            unit = unit_of(channel, loading.mechanism)
            head = {"channel": channel, "unit": unit, "m": m, "nominal": only(nominal[:, c])}
            head["lacking"] = float(lacking[:, c].max(initial=0.0))
            rows += _quantiles(head, values[:, c], loading)
    return rows


def _quantiles(head: Row, values: loads.FloatArray, loading: Counted) -> Rows:
    """A row for each of `SHARES` of the joints: the head, and the quantile of their values."""
    sample = Sample.of(values, loading.status, loading.design)
    quantiles = [sample.quantile(share, CONFIDENCE)._asdict() for share in SHARES]
    return [{**head, **quantile, "confidence": CONFIDENCE} for quantile in quantiles]


def damages(loading: Counted, delivery: int = prediction.DELIVERY) -> Rows:
    """Share of the joints whose damage sum in the service life exceeds 1, for each channel that has an S–N line.

    Returns
    -------
    sequence of mapping
        One row per channel and, of several, `ANY` for joints with any of these damage sums above 1 (it has no line):
        ``channel``, ``m``, ``S0`` (N or N m), ``N0``, ``nominal`` (damage of the nominal joint), ``median`` (of the
        joints), the fields of `analysis.estimates.Exceedance` for the level 1, ``next_lower`` and ``next_upper``
        (prediction interval for the joints above 1 in the next delivery), ``confidence``.
    """
    lines = loading.settings.lines
    of_joints, of_nominal = (damage_sums(part, loading.settings) for part in (loading.cycles, loading.nominal))
    if len(of_joints) > 1:
        for sums in (of_joints, of_nominal):
            sums[ANY] = np.maximum.reduce(list(sums.values()))
    rows = []
    for channel, damage in of_joints.items():
        nominal = of_nominal[channel]
        sample = Sample.of(damage, loading.status, loading.design)
        m, _, N0, S0, *_ = lines.get(channel, [np.nan] * 4)
        row = {"channel": channel, "m": m, "S0": S0, "N0": N0, "nominal": only(nominal)}
        row |= {"median": sample.quantile(0.5).estimate} | asdict(sample.above(1.0, CONFIDENCE))
        row |= prediction.columns(sample.delivery(1.0, delivery, CONFIDENCE), delivery) | {"confidence": CONFIDENCE}
        rows.append(row)
    return rows


def damage_sums(part: cycles.Cycles, settings: Fatigue) -> dict[str, loads.FloatArray]:
    """Damage sum of each joint in the service life, (n,), by channel that has an S–N line."""
    lines = {channel: line for channel, line in settings.lines.items() if channel in part.channels}
    return {
        channel: cycles.damage(part.of(channel).worst(line.k), line, settings.revolutions)[:, 0]
        for channel, line in lines.items()
    }


def spectrum(loading: Counted, channel: str) -> Rows:
    """Cumulative load spectrum: quantiles over the joints of the range that a number of cycles reaches or exceeds.

    Returns
    -------
    sequence of mapping
        One row per number and share of `SHARES`: ``channel``, ``unit``, ``cycles`` (in the service life), ``nominal``,
        the fields of `analysis.estimates.Quantile` (intervals are pointwise), ``confidence``. Ranges in SI units,
        ascending numbers.
    """
    part, nominal_part = (each.of(channel).worst(_middle(loading)) for each in (loading.cycles, loading.nominal))
    order = np.argsort(-part.ranges[:, 0], axis=1)
    steps = np.cumsum(np.take_along_axis(part.repeats[:, 0], order, axis=1), axis=1)
    steps = steps[np.take_along_axis(part.ranges[:, 0], order, axis=1) > 0]
    numbers = np.unique(np.append(steps.round(12), 1.0))  # at which the spectra of the joints have steps
    numbers = numbers[np.linspace(0, numbers.size - 1, min(numbers.size, MAX_NUMBERS)).round().astype(int)]
    values, nominal = (cycles.spectrum(each, numbers)[:, 0] for each in (part, nominal_part))
    head, rows = {"channel": channel, "unit": unit_of(channel, loading.mechanism)}, list[Row]()
    for number, ranges, ideal in zip(numbers, values.T, nominal.T, strict=True):
        columns = {"nominal": only(ideal), "cycles": number * loading.settings.revolutions}
        rows += _quantiles(head | columns, ranges, loading)
    return rows


def _middle(loading: Counted) -> float:
    exponents = sorted(loading.settings.exponents)
    return exponents[len(exponents) // 2]


def most_loaded(rows: Rows, mechanism: Mechanism) -> list[str]:
    """Channel with the largest equivalent load, a force and a moment at each place, from `equivalent_loads`.

    Evaluated at the middle exponent and the highest share. Empty if no joint has a valid result.
    """
    exponents = sorted({row["m"] for row in rows})
    last = [row for row in rows if row["share"] == SHARES[-1] and row["m"] == exponents[len(exponents) // 2]]
    largest: dict[tuple[str, str], Row] = {}
    for row in last:
        if not np.isnan(row["estimate"]):
            key = signals_of(row["channel"], mechanism)[0].place, row["unit"]
            largest[key] = max(largest.get(key, row), row, key=lambda row: float(row["estimate"]))
    return [row["channel"] for row in largest.values()]


def leading(rows: Rows, mechanism: Mechanism) -> list[str]:
    """Channel with the largest equivalent load for force and torque of each group of bushings.

    Candidates are the channels `most_loaded` of the table; all exponents count.
    """
    names, chosen = most_loaded(rows, mechanism), []
    candidates = [row for row in rows if row["share"] == SHARES[-1] and row["channel"] in names]
    place_of = {name: places(mechanism)[signals_of(name, mechanism)[0].place] for name in names}
    for group, kind in loads.panels(mechanism):
        of_group = [row for row in candidates if row["unit"] == kind.unit and place_of[row["channel"]].group == group]
        chosen += [max(of_group, key=lambda row: float(row["estimate"]))["channel"]] if of_group else []
    return chosen


def pylife_frame(view: View, names: Sequence[str] | None = None, nominal: bool = False) -> pd.DataFrame:
    """Every cycle of every joint of a file, over its duty cycle, as a load collective for pyLife.

    Parameters
    ----------
    view : View
        A campaign.
    names : sequence of str, optional
        As in `load_cycles`. Of a worst direction, that of the middle exponent of the study.
    nominal : bool
        Include the nominal joint, row 0 of the campaign.

    Returns
    -------
    pandas.DataFrame
        One row a cycle: ``joint`` (row of the campaign), ``channel``, ``unit``, ``range`` and ``mean`` (in the unit),
        ``cycles`` (occurrences per revolution of the input shaft). Joints without results have none.

    Raises
    ------
    InputError
        When the shares of the operating points are not known.
    """
    loading = load_cycles(view, names)
    parts = [(loading.cycles, view.rows(np.arange(view.n)))]
    if nominal:
        parts.insert(0, (loading.nominal, view.store.row(view.nominal_slots)))
    frames = [_frame(part.worst(_middle(loading)), rows, view.mechanism) for part, rows in parts]
    return pd.concat(frames, ignore_index=True)


def _frame(part: cycles.Cycles, rows: np.ndarray[tuple[int], np.dtype[np.intp]], mechanism: Mechanism) -> pd.DataFrame:
    joint, channel, cycle = np.nonzero((part.ranges > 0) & (part.repeats > 0))  # leaves out NaN
    units = [unit_of(name, mechanism) for name in part.channels]
    return pd.DataFrame(
        {
            "joint": rows[joint],
            "channel": np.array(part.channels, object)[channel],
            "unit": np.array(units, object)[channel],
            "range": part.ranges[joint, channel, cycle].astype(float),
            "mean": part.means[joint, channel, cycle].astype(float),
            "cycles": part.repeats[joint, channel, cycle],
        }
    )
