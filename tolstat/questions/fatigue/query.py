"""Fatigue of a campaign or of a duty cycle: load cycles, damage-equivalent loads, damage sums and load spectra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat.analysis import cycles, prediction
from tolstat.analysis.cycles import Cycles, FloatArray
from tolstat.analysis.design import Design
from tolstat.analysis.prediction import DELIVERY
from tolstat.analysis.sample import Sample
from tolstat.common.channels import CHANNELS, Channel
from tolstat.common.load_kinds import PLACES, Kind
from tolstat.common.loads import PANELS
from tolstat.common.shown import shown
from tolstat.common.tables import Status
from tolstat.questions.fatigue import duty
from tolstat.questions.fatigue.counting import SHOWN, cycles_of
from tolstat.store.view import View
from tolstat.study.fatigue import Fatigue, of_text

ANY = "any of them"
"""Name of the row for all channels together."""
SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints at which quantiles are given."""
MAX_NUMBERS = 40
"""Maximum number of points of a spectrum."""


@shown
@dataclass(frozen=True)
class Loading:
    """Load cycles of the joints of one campaign or of a duty cycle, and the settings of their evaluation.

    Attributes
    ----------
    name : str
        Name of the study, or of the studies.
    cycles : Cycles
        Cycles of the n samples.
    status : ndarray, shape (n,)
        `tables.Status`; with several operating points the worst, see `tables.worst_status`.
    nominal : Cycles
        Cycles of the nominal joint; no rows if there is none that settled.
    design : Design
        How the joints were drawn.
    settings : Fatigue
        Section ``[fatigue]`` of the study; of the first study if there are several.
    duty : tuple of (str, float)
        Operating points, or files, and their shares of the revolutions; one entry with share 1 for a single point.
    """

    name: str
    cycles: Cycles
    status: NDArray[np.uint8]
    nominal: Cycles
    design: Design
    settings: Fatigue
    duty: tuple[tuple[str, float], ...]

    @property
    def settled(self) -> int:
        """Number of joints that settled at all operating points."""
        return int((self.status == Status.OK).sum())


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
        campaign follow from their shares of the time and their speeds, see `points.shares_of_revolutions`.
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
    name = " + ".join(view.name for view in views)
    views, shares = duty.members(views, shares)
    first = views[0]
    # the section alone, like limits: it is at hand even where the study refers to files that are not
    settings = of_text(first.store.study_text, str(first.path))
    if names is None:
        names = tuple(name for name in CHANNELS if name in SHOWN or name in settings.lines)
    parts = [_cycles_of(view, names, samples) for view in views]
    # the nominal joint of a duty cycle has settled at all operating points, or it has no row
    rows = slice(min(len(nominal.number) for _, nominal in parts))
    return Loading(
        name=name,
        cycles=cycles.duty_cycle([own for own, _ in parts], shares),
        status=duty.status(views, samples),
        nominal=cycles.duty_cycle([nominal.rows(rows) for _, nominal in parts], shares),
        design=duty.design(first, samples),
        settings=settings,
        duty=duty.described(views, shares),
    )


def _cycles_of(view: View, names: Sequence[str], samples: int | None) -> tuple[Cycles, Cycles]:
    """Cycles of the first samples, and of the nominal joint (no rows if there is none that settled)."""
    n = view.n if samples is None else min(samples, view.n)
    first, end = map(int, view.slots([0, n]))
    whole = cycles_of(view.store, np.arange(end), names)  # the nominal joint, if the file has it, is before the samples
    settled = int((view.nominal["status"] == Status.OK).sum())
    return whole.rows(slice(first, None)), whole.rows(slice(settled))


def equivalent_loads(loading: Loading, shares: Sequence[float] = SHARES, confidence: float = 0.95) -> pd.DataFrame:
    """Quantiles over the joints of the damage-equivalent loads.

    Parameters
    ----------
    loading : Loading
        Cycles of the joints.
    shares : sequence of float
        Shares of the joints at or below the quantile.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    DataFrame
        One row per channel, exponent and share: ``channel``, ``unit``, ``m``, ``nominal``, ``lacking`` (upper bound of
        the relative increase of the sum of S^m by cycles that the file does not hold, maximum over the joints), the
        fields of `analysis.estimates.Quantile`, ``confidence``. Loads are ranges in SI units.
    """
    settings, rows = loading.settings, []
    for m in settings.exponents:
        values = cycles.equivalent_load(loading.cycles, m, settings.revolutions, settings.reference_cycles)
        nominal = cycles.equivalent_load(loading.nominal, m, settings.revolutions, settings.reference_cycles)
        lacking = cycles.truncation_bound(loading.cycles, m)
        for c, channel in enumerate(loading.cycles.channels):
            head = {"channel": channel, "unit": CHANNELS[channel].unit, "m": m, "nominal": _only(nominal[:, c])}
            head["lacking"] = float(lacking[:, c].max(initial=0.0))
            sample = Sample.of(values[:, c], loading.status, loading.design)
            for share in shares:
                found = sample.quantile(share, confidence)
                rows.append({**head, **found._asdict(), "confidence": confidence})
    return pd.DataFrame(rows)


def damages(loading: Loading, confidence: float = 0.95, delivery: int = DELIVERY) -> pd.DataFrame:
    """Share of the joints whose damage sum in the service life exceeds 1, for each channel that has an S–N line.

    Returns
    -------
    DataFrame
        One row per channel and, of several, `ANY` for joints with any of these damage sums above 1 (it has no line):
        ``channel``, ``m``, ``S0`` (N or N m), ``N0``, ``nominal`` (damage of the nominal joint), ``median`` (of the
        joints), the fields of `analysis.estimates.Exceedance` for the level 1, ``next_lower`` and ``next_upper``
        (prediction interval for the joints above 1 in the next delivery), ``confidence``.
    """
    rows, worst = [], []
    for channel, values in loading.settings.lines.items():
        if channel not in loading.cycles.channels:
            continue
        line = cycles.Line(*values)
        sums, nominal = (
            cycles.damage(part.of(channel), line, loading.settings.revolutions)[:, 0]
            for part in (loading.cycles, loading.nominal)
        )
        worst.append((sums, nominal))
        head = {"channel": channel, **line._asdict(), "nominal": _only(nominal)}
        rows.append(head | _above_one(loading, sums, confidence, delivery))
    if len(worst) > 1:
        sums, nominal = (np.maximum.reduce(parts) for parts in zip(*worst, strict=True))
        head = {"channel": ANY, **dict.fromkeys(cycles.Line._fields, np.nan), "nominal": _only(nominal)}
        rows.append(head | _above_one(loading, sums, confidence, delivery))
    return pd.DataFrame(rows)


def _above_one(loading: Loading, sums: FloatArray, confidence: float, delivery: int) -> dict[str, object]:
    """Columns of `damages` that follow from the damage sums of the joints."""
    sample = Sample.of(sums, loading.status, loading.design)
    ends = prediction.columns(sample.delivery(1.0, delivery, confidence), delivery)
    above = asdict(sample.above(1.0, confidence))
    return {"median": sample.quantile(0.5).estimate} | above | ends | {"confidence": confidence}


def spectra(
    loading: Loading,
    channels: Sequence[str] | None = None,
    shares: Sequence[float] = SHARES,
    confidence: float = 0.95,
) -> pd.DataFrame:
    """Cumulative load spectra: quantiles over the joints of the range that a number of cycles reaches or exceeds.

    Parameters
    ----------
    loading : Loading
        Cycles of the joints.
    channels : sequence of str, optional
        Channels of ``loading.cycles``; by default all.
    shares, confidence
        As in `equivalent_loads`; the intervals are pointwise.

    Returns
    -------
    DataFrame
        One row per channel, share and number: ``channel``, ``unit``, ``cycles`` (in the service life), ``nominal``, the
        fields of `analysis.estimates.Quantile`, ``confidence``. Ranges in SI units, ascending numbers.
    """
    rows = []
    for channel in loading.cycles.channels if channels is None else channels:
        part = loading.cycles.of(channel)
        numbers = _numbers(part)
        values = cycles.spectrum(part, numbers)[:, 0]
        nominal = cycles.spectrum(loading.nominal.of(channel), numbers)[:, 0]
        samples = [Sample.of(own, loading.status, loading.design) for own in values.T]
        for share in shares:
            for number, sample, own in zip(numbers, samples, nominal.T, strict=True):
                head = {
                    "channel": channel,
                    "unit": CHANNELS[channel].unit,
                    "cycles": number * loading.settings.revolutions,
                }
                found = sample.quantile(share, confidence)
                rows.append({**head, "nominal": _only(own), **found._asdict(), "confidence": confidence})
    return pd.DataFrame(rows)


def most_loaded(table: pd.DataFrame) -> list[str]:
    """Channel with the largest equivalent load for each kind of loads at each place, from `equivalent_loads`.

    Evaluated at the middle exponent and the highest share. Moduli, whose cycles are not those of a component, are used
    only if the table has nothing else. Empty if no joint has a valid result.
    """
    exponents = sorted(table["m"].unique())
    part = _highest(table)
    part = part[part["m"] == exponents[len(exponents) // 2]].dropna(subset="estimate")
    components = part[[not CHANNELS[name].is_modulus for name in part["channel"]]]
    part = components if len(components) else part
    loads = pd.Series([(CHANNELS[name].place, CHANNELS[name].kind.key) for name in part["channel"]], part.index)
    return [str(name) for name in part.loc[part.groupby(loads, sort=False)["estimate"].idxmax(), "channel"]]


def leading(table: pd.DataFrame) -> list[str]:
    """Channel with the largest equivalent load for force and torque of the cross bushings and of the fork bushings.

    Candidates are the channels `most_loaded` of the table; all exponents count.
    """
    part = _highest(table)
    candidates = part[part["channel"].isin(most_loaded(table))].sort_values("estimate")
    found = []
    for group, kind in PANELS:
        here = candidates[[is_in(CHANNELS[name], group, kind) for name in candidates["channel"]]]
        found += [str(here["channel"].iloc[-1])] if len(here) else []
    return found


def is_in(channel: Channel, group: str, kind: Kind) -> bool:
    """Whether a channel is of a kind of loads, at a place of a group, ``"cross"``."""
    return PLACES[channel.place].group == group and channel.kind == kind


def _highest(table: pd.DataFrame) -> pd.DataFrame:
    """Rows of the highest share of the joints."""
    part: pd.DataFrame = table[table["share"] == table["share"].max()]
    return part


def _numbers(part: Cycles) -> FloatArray:
    """Cycles per revolution at which the spectra of the joints have steps, thinned to `MAX_NUMBERS`."""
    order = np.argsort(-part.ranges[:, 0], axis=1)
    steps = np.cumsum(part.repeats[order], axis=1)[np.take_along_axis(part.ranges[:, 0], order, axis=1) > 0]
    numbers = np.unique(np.append(steps.round(9), 1.0))
    thinned = np.linspace(0, numbers.size - 1, min(numbers.size, MAX_NUMBERS)).round().astype(int)
    return np.asarray(numbers[thinned])


def _only(values: FloatArray) -> float:
    return float(values[0]) if values.size else np.nan
