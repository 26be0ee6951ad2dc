"""Share of the joints above a limit if a line of the drawing had another width, from joints with the same seeds."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from tolstat.analysis import difference, pick_freeze
from tolstat.analysis.sample import Sample
from tolstat.campaign import what_if as sets
from tolstat.campaign.what_if import EXCHANGE, WIDTH
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import ANY_LIMIT, FloatArray
from tolstat.common.shown import shown
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import Status
from tolstat.store import what_if as kept
from tolstat.store.view import View
from tolstat.store.what_if import Altered
from tolstat.study import widths
from tolstat.study.points import at
from tolstat.study.widths import EXACT, HALF, Line

NEGLIGIBLE = 0.1
"""Difference of two lines that does not matter for their order, relative to the share of the joints as drawn."""
TAIL_STARTS_AT = 0.9
"""Quantile of the load that takes the place of a limit where the study sets none."""


class Measure(NamedTuple):
    """How the load that orders the lines follows from the loads that a file keeps.

    Attributes
    ----------
    parts : tuple of (tuple of str, float)
        Names of loads, of which the largest counts, and what it is divided by: 1, or the limit of each of all limits.
    """

    parts: tuple[tuple[tuple[str, ...], float], ...]

    def held(self, one: Altered) -> bool:
        """Whether a set has all these loads."""
        return all(one.holds(names) for names, _ in self.parts)

    def of(self, one: Altered) -> FloatArray:
        """Load of each joint of a set, NaN where one of its loads is not valid, (n,)."""
        return np.asarray(np.maximum.reduce([one.valid(names) / level for names, level in self.parts]))


@shown
class WhatIf(NamedTuple):
    """Share of the joints above a limit, or above at least one of all limits, with other widths.

    Attributes
    ----------
    load, unit : str
        The load, and its SI unit; ``"any limit"`` for the largest ratio of load to limit.
    level : float
        The limit; without one, the 90 % quantile of the load.
    n : int
        Number of joints as drawn.
    share, lower, upper : float
        Share of these above the level, and its interval with failed and unsettled joints.
    table : DataFrame
        One row per line and step, lines in the order of their share if half as wide: ``line``, ``size``, ``step``,
        ``words``, ``factor`` (NaN if it differs within the line), ``n``, ``share`` with ``_lower`` and ``_upper``, and
        ``change``, the paired difference to the joints as drawn, with ends. Where `n` is larger than that of the line,
        its share is the share of all joints as drawn plus the change.
    indices : DataFrame
        One row per line: ``line``, ``pairs``; ``alone`` and ``in_all`` with ends, the closed and total Sobol' index of
        the load, or of its logarithm; ``above_alone`` and ``above_in_all``, those of the event that it is above the
        level. NaN for correlated lines.
    logarithmic : bool
        Whether the logarithm of the load is decomposed.
    missing, left_out : tuple of str
        Entries of ``[tolerances]`` without joints in the file, and those whose width is not changed.
    settled : bool
        Whether the order of the lines is settled: neighbours differ, or by less than `NEGLIGIBLE` of the share.
    """

    load: str
    unit: str
    level: float
    n: int
    share: float
    lower: float
    upper: float
    table: pd.DataFrame
    indices: pd.DataFrame
    logarithmic: bool
    missing: tuple[str, ...]
    left_out: tuple[str, ...]
    settled: bool


def what_if(view: View, by: str, confidence: float = 0.95) -> WhatIf | None:
    """Evaluate the joints with other widths that a file holds.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    by : str
        A load that can have a limit (``cross1.F``, ``pin2.contact``, ``psi``), or ``"any limit"`` of the study.
    confidence : float
        Confidence level of all intervals.

    Returns
    -------
    WhatIf or None
        None where the file holds no such joints (`run.simulate` adds them).

    Raises
    ------
    InputError
        When there is no such load, or the study does not keep it.
    StoreError
        When the joints are not drawn from tolerances, or differ in weight.

    Examples
    --------
    >>> with tolstat.open(path) as store:  # doctest: +SKIP
    ...     found = tolstat.what_if(store.view(), "fork1.F")
    """
    check(view)
    load, own = view.load(by), measure(view, by)
    held = [one for one in view.altered.values() if one.about["kind"] == WIDTH and own.held(one)]
    base = as_drawn(view, by, view.altered)
    if not held or not np.isfinite(base).any():
        return None
    level = level_of(load)
    study_lines = widths.lines(view.study)
    rows = [_row(view, one, base, own, level, confidence) for one in held]
    table = pd.DataFrame([row for row in rows if row is not None])
    if table.empty:
        return None
    order = _order(table)
    table = table.sort_values(["line", "step"], key=lambda c: c.map(order | _STEPS), kind="stable", ignore_index=True)
    above = _sample(base).above(level, confidence)
    return WhatIf(
        load=by,
        unit=load.unit,
        level=level,
        n=len(base),
        share=above.estimate,
        lower=above.outer_lower,
        upper=above.outer_upper,
        table=table,
        indices=_indices(view, base, load, level, confidence, list(order)),
        logarithmic=load.long_tailed,
        missing=tuple(line.label for line in study_lines if line.label not in order),
        left_out=tuple(widths.left_out(view.study)),
        settled=is_settled(halves(view.altered, study_lines, own), base, level, confidence),
    )


def check(view: View) -> None:
    """Refuse a file whose joints are not drawn from tolerances, differ in weight, or are a part of the campaign's.

    Raises
    ------
    StoreError
        The hint names what can be used.
    """
    view.check_drawn()
    view.check("difference")
    if view.study.groups:
        remedy = 'give the file of a study with sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(view.path), "holds a pick-freeze design", remedy)))
    if not view.store.whole:
        remedy = "merge all slices first: tolstat merge SLICE... --out FILE"
        raise StoreError(str(Fault(str(view.path), "holds a part of the campaign only", remedy)))


def names_at_points(view: View, load: str) -> tuple[str, ...]:
    """Names that the file keeps of a load, one for each operating point: that of the load unless it has several."""
    own, plain = view.narrowed(load)
    return tuple(at(plain, [point], list(view.store.points)) for point in own.points)


def measure(view: View, load: str) -> Measure:
    """Measure of a load, or of all limits together."""
    if load == ANY_LIMIT:
        return Measure(tuple((names_at_points(view, name), level) for name, level in view.limits.items()))
    return Measure(((names_at_points(view, load), 1.0),))


def level_of(load: Sample) -> float:
    """Limit of a load; without one, the 90 % quantile of the joints."""
    return load.quantile(TAIL_STARTS_AT).estimate if load.limit is None else load.limit


def own_joints(view: View) -> int:
    """Number of samples of the campaign, from the first, that serve as joints as drawn: none of them pending."""
    if not view.design.has_interval("difference"):
        return 0
    waiting = np.flatnonzero(view.status == Status.PENDING)
    return int(waiting[0]) if waiting.size else view.n


def as_drawn(view: View, load: str, held: Mapping[str, Altered]) -> FloatArray:
    """Load of the joints as drawn, from sample 0 on, NaN without a valid one, (n,): the campaign's, then fresh ones."""
    own = own_joints(view)
    values = view.load(load).values[:own]
    more, how = held.get(kept.key(sets.as_drawn(view.study, range(0)).about)), measure(view, load)
    if more is None or not how.held(more) or not more.first <= own < more.end:
        return values
    return np.concatenate([values, how.of(more)[own - more.first :]])


def halves(held: Mapping[str, Altered], lines: list[Line], load: Measure) -> list[FloatArray]:
    """Load of the joints of each line that is half as wide; of those lines that the file has."""
    by_label = {
        one.about["label"]: load.of(one)
        for one in held.values()
        if one.about["kind"] == WIDTH and one.about["step"] == HALF and load.held(one)
    }
    return [by_label[line.label] for line in lines if line.label in by_label]


def is_settled(values: list[FloatArray], base: FloatArray, level: float, confidence: float = 0.95) -> bool:
    """Whether the order of lines by their shares above a level is settled.

    Neighbours in the order are compared joint by joint. Their difference has an interval, at a confidence level that
    holds for all of them together (Bonferroni); it excludes zero, or lies within `NEGLIGIBLE` of the share as drawn.
    """
    if len(values) < 2:
        return True
    n = min(len(base), *map(len, values))
    ranked = sorted(values, key=lambda own: float(np.mean(own[:n] > level)))
    drawn = float(np.mean(base[:n] > level))
    own = 1.0 - (1.0 - confidence) / (len(values) - 1)
    for one, other in pairwise(ranked):
        found = difference.shares(_sample(one[:n]), _sample(other[:n]), [level], paired=True, confidence=own)
        low, high = float(found.lower[0]), float(found.upper[0])
        if low <= 0.0 <= high and max(-low, high) > NEGLIGIBLE * drawn:
            return False
    return True


def best(found: WhatIf) -> Mapping[Any, Any] | None:
    """Row of the line that lowers the share most if half as wide; None if none surely lowers it."""
    rows = [row for row in found.table.to_dict("records") if row["step"] == HALF and row["change_upper"] < 0.0]
    return min(rows, key=lambda row: float(row["share"]), default=None)


Ends = tuple[float, float, float]
"""An estimate, and the ends of its interval."""
_STEPS = {step: number for number, step in enumerate(widths.STEPS)}


def _order(table: pd.DataFrame) -> dict[str, int]:
    """Place of each line: by its share if half as wide, then if exact; lines without these behind."""
    by: dict[str, tuple[int, float]] = {}
    for row in table.to_dict("records"):
        rank = {HALF: 0, EXACT: 1}.get(row["step"], 2)
        by[row["line"]] = min(by.get(row["line"], (3, 0.0)), (rank, row["share"]))
    return {line: place for place, line in enumerate(sorted(by, key=lambda line: by[line]))}


def _row(
    view: View, one: Altered, base: FloatArray, load: Measure, level: float, confidence: float
) -> dict[str, object] | None:
    n = min(len(base), one.end)
    if one.first or not n:
        return None
    values = load.of(one)[:n]
    if not np.isfinite(values).any() or not np.isfinite(values + base[:n]).any():
        return None
    drawn, own = (_sample(loads).above(level, confidence) for loads in (base, values))
    pair = difference.shares(_sample(base[:n]), _sample(values), [level], paired=True, confidence=confidence)
    factors = {own["factor"] for own in one.about["tolerances"].values()}
    factor = factors.pop() if len(factors) == 1 else np.nan
    change = float(pair.estimate[0]), float(pair.outer_lower[0]), float(pair.outer_upper[0])
    share = own.estimate, own.outer_lower, own.outer_upper
    if n < len(base):
        share = _moved((drawn.estimate, drawn.outer_lower, drawn.outer_upper), change)
    line = Line(one.about["label"], tuple(one.about["tolerances"]))
    return {
        "line": line.label,
        "names": line.names,
        "size": widths.size(view.study, line),
        "step": one.about["step"],
        "words": one.about["words"],
        "factor": factor,
        "n": n,
        "share": share[0],
        "share_lower": share[1],
        "share_upper": share[2],
        "change": change[0],
        "change_lower": change[1],
        "change_upper": change[2],
    }


def _moved(drawn: Ends, change: Ends) -> Ends:
    """Share as drawn plus a change that fewer joints tell, with the interval of both (Zou and Donner 2008).

    The share and its change have a negative covariance, so the interval is wide rather than narrow.
    """
    share = drawn[0] + change[0]
    low, high = (np.hypot(drawn[0] - drawn[k], change[0] - change[k]) for k in (1, 2))
    found = (share, share - low, share + high)
    return tuple(float(np.clip(value, 0.0, 1.0)) for value in found)  # type: ignore[return-value]


def _sample(values: FloatArray) -> Sample:
    """Sample of loads; joints without one have failed."""
    return Sample.of(values, np.full(values.size, Status.OK))


def _indices(
    view: View, base: FloatArray, load: Sample, level: float, confidence: float, order: list[str]
) -> pd.DataFrame:
    own = measure(view, load.name)
    held = {one.about["label"]: one for one in view.altered.values() if one.about["kind"] == EXCHANGE}
    rows = []
    for label in order:
        one = held.get(label)
        n = 0 if one is None else min(one.end, len(base) // 2)
        if one is None or one.first or n < pick_freeze.FEWEST or not own.held(one):
            continue
        a, b, ab = base[: 2 * n : 2], base[1 : 2 * n : 2], own.of(one)[:n]
        row: dict[str, object] = {"line": label, "pairs": n}
        of_load, of_event = _decomposed(a, b, ab, load.long_tailed), _event(a, b, ab, level)
        for name, parts, estimate in (("", of_load, pick_freeze.indices), ("above_", of_event, pick_freeze.of_event)):
            try:
                found = estimate(parts[0], parts[1], parts[2][:, None], confidence)
            except ValueError:  # too few joints with a load, or none, or all of them, above the level
                continue
            for word, index in (("alone", found.first), ("in_all", found.total)):
                for end, value in zip(("", "_lower", "_upper"), index, strict=True):
                    row[f"{name}{word}{end}"] = float(value[0])
        rows.append(row)
    words = [f"{name}{word}{end}" for name in ("", "above_") for word in ("alone", "in_all") for end in _ENDS]
    return pd.DataFrame(rows, columns=["line", "pairs", *words])


_ENDS = ("", "_lower", "_upper")


def _decomposed(a: FloatArray, b: FloatArray, ab: FloatArray, log: bool) -> tuple[FloatArray, ...]:
    return tuple(np.log(values) if log else values for values in (a, b, ab))


def _event(a: FloatArray, b: FloatArray, ab: FloatArray, level: float) -> tuple[FloatArray, ...]:
    return tuple(np.where(np.isfinite(values), values > level, np.nan) for values in (a, b, ab))


def find_lines(view: View, each: str, groups: list[str]) -> list[Line]:
    """Lines to change: the entries of the study, or its features or single errors; and the groups that a user names.

    Raises
    ------
    InputError
        With every fault of the groups; `each` is none of ``entry``, ``feature``, ``error``.
    """
    kinds = {"entry": widths.lines, "feature": widths.features, "error": widths.errors}
    if each not in kinds:
        raise InputError([Fault("--each", f"{each!r} is not allowed", did_you_mean(each, list(kinds)))])
    return [*kinds[each](view.study), *widths.named(view.study, groups)]


def independent(view: View, line: Line) -> bool:
    """Whether no error of a line is correlated with one of another line, so that it can be exchanged."""
    copula = view.study.copula
    own = [k for k, name in enumerate(copula.names) if name in line.names]
    others = [k for k, name in enumerate(copula.names) if name not in line.names]
    return not np.any(copula.matrix[np.ix_(own, others)]) if own and others else True
