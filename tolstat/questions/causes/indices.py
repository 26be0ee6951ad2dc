"""Indices of errors: shares of a load's variance, ranks, and what sets the joints of its tail apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from tolstat import sampling
from tolstat.analysis import pick_freeze, ranks, sensitivity
from tolstat.analysis.sample import Sample
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import ANY_LIMIT, FloatArray
from tolstat.display import text
from tolstat.display.table import Column, Row, Rows, has
from tolstat.questions.shares import rows_of, tail_level
from tolstat.store.hdf5 import store_error
from tolstat.store.view import View

MIN_JOINTS = 200
"""Minimum number of valid joints."""
MAX_JOINTS = sensitivity.MOST
"""Maximum number of joints (the first ones) for shares and ranks, and on either side of the tail: more add little, and
a million joints with fifty errors do not fit into a gigabyte."""
KINDS = ("first", "total", "srrc", "direction", "size")
TAIL = KINDS[-2:]

Parts = Mapping[str, NamedTuple]
"""Estimates of all errors with their ends, by name of `KINDS`."""


class Indices(NamedTuple):
    """What each error contributes to a load.

    Attributes
    ----------
    facts : mapping
        ``load``, ``unit``, ``logarithm``; ``joints`` (valid), ``used`` (of them for shares and ranks),
        ``without_load``; ``level`` at which the tail begins, SI: the study's limit or, without one, the 90 % quantile;
        ``above``: number of joints above it; ``std`` of the load or its logarithm; ``additive``: sum of the
        first-order indices; ``r2`` of the rank regression, NaN for a pick-freeze design.
    rows : sequence of mapping
        One row per error that scatters (two per vector of a zone), the largest first-order index first: ``error``; with
        ``_lower`` and ``_upper``: ``first``, ``total`` (NaN for correlated errors), ``srrc``, ``direction`` and
        ``size``; the last two also with ``_p``, and NaN if too few joints are on either side of the level. For a
        pick-freeze design, one row per group of errors, with ``first`` and ``total`` only.
    """

    facts: Mapping[str, Any]
    rows: Rows

    @property
    def quantity(self) -> str:
        """Name of the decomposed quantity: the load, or its logarithm."""
        return f"log {self.facts['load']}" if self.facts["logarithm"] else str(self.facts["load"])

    @property
    def of_design(self) -> bool:
        """Whether the joints are a pick-freeze design."""
        return math.isnan(self.facts["r2"])

    @property
    def with_intervals(self) -> bool:
        """Whether the samples are independent."""
        return not all(math.isnan(row["first_lower"]) for row in self.rows)


def estimated(
    head: str, name: str, rank: int = 0, form: str = ".1f", ends: tuple[float, float] | None = None
) -> Column:
    """Column of an estimate between two `ends`, in per cent unless `form` has two digits, with its interval."""
    factor = 1.0 if form.endswith("2f") else 100.0

    def cell(row: Row) -> str:
        if math.isnan(value := row.get(name, math.nan)):
            return "-"
        low, high = (factor * row[f"{name}{end}"] for end in ("_lower", "_upper"))
        value = factor * (value if ends is None else min(max(value, ends[0]), ends[1])) + 0.0  # no -0
        return f"{value:{form}}" + ("" if math.isnan(low) else f" ({text.ends(low, high, form)})")

    return Column(head, cell, shown=has(name), rank=rank)


def indices(
    view: View, by: str, logarithm: bool = False, joints: int | None = None, confidence: float = 0.95
) -> Indices:
    """Estimate what each error contributes to a load.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances, all of the same weight.
    by : str
        A load that can have a limit (``cross1.F``, ``pin2.contact``, ``psi``).
    logarithm : bool
        Decompose the variance of the load's logarithm: for a load whose variance a few joints dominate.
    joints : int, optional
        Number of samples to use, from the first; by default all. Of a pick-freeze design all are used.
    confidence : float
        Confidence level of all intervals.

    Returns
    -------
    Indices

    Raises
    ------
    InputError
        When there is no such load, the study does not keep it, or `logarithm` is set and a value is not positive.
    StoreError
        When the file has too few valid joints, or joints that are not drawn from tolerances or differ in weight.
    """
    view.check_drawn()
    view.check("index")
    load = view.load(by)
    if joints is not None and not view.study.groups:
        load = load.only(np.arange(min(joints, view.n)))
    estimate = _of_design if view.study.groups else _of_samples
    names, parts, variance = estimate(view, load, logarithm, confidence)
    first: Any = parts["first"]
    ranks: Any = parts.get("srrc")
    valid, level = load.valid, tail_level(load)
    facts = {"load": load.name, "unit": load.unit, "logarithm": logarithm, "joints": valid.size}
    facts |= {"used": min(valid.size, MAX_JOINTS) if ranks else valid.size, "without_load": sum(load.unresolved)}
    facts |= {"level": level, "above": int((valid > level).sum()), "std": math.sqrt(variance)}
    facts |= {"additive": float(first.estimate.sum()), "r2": ranks.r2 if ranks else math.nan}
    columns: dict[str, Any] = {"error": names}
    for kind in KINDS:
        found = parts[kind]._asdict() if kind in parts else {}
        keys = {"": "estimate", "_lower": "lower", "_upper": "upper"} | ({"_p": "p"} if kind in TAIL else {})
        for end, key in keys.items():
            columns[f"{kind}{end}"] = np.broadcast_to(found.get(key, np.nan), len(names)).tolist()
    return Indices(facts, sorted(rows_of(columns), key=lambda row: -row["first"]))


def scattering(components: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Those of the components (`sampling.components`) that vary over the joints."""
    return {name: own for name, own in components.items() if np.ptp(own) > 0}


def _of_samples(view: View, load: Sample, logarithm: bool, confidence: float) -> tuple[list[str], Parts, float]:
    """Names, estimates and variance from joints that are all drawn from the same tolerances."""
    study, independent = view.study, view.design.has_interval("index")
    samples = np.flatnonzero(load.is_valid)
    values = load.values[samples]
    needed = max(MIN_JOINTS, len(sampling.streams(study)) + 2 * ranks.GROUPS)
    if values.size < needed:
        what = "load on all limits" if load.name == ANY_LIMIT else load.name
        raise store_error(view.path, f"has {values.size} joints with a valid {what}", f"run {needed} joints or more")
    if np.ptp(values) == 0:
        found = f"has the same {load.name} in all joints: no error causes it"
        raise store_error(view.path, found, "name another load with --by")
    columns = sampling.columns(study)
    components = scattering(sampling.components(study, view.errors(samples[:MAX_JOINTS], columns)))
    names, x = list(components), np.column_stack(list(components.values()))
    response = (_logarithm(load.name, values) if logarithm else values)[:MAX_JOINTS]
    parts: dict[str, NamedTuple] = {"srrc": ranks.regression(x, values[:MAX_JOINTS], confidence, independent)}
    if study.copula.names or study.sampling.is_matched:
        first = sensitivity.first_order(x, response, confidence, independent)
    else:
        first, parts["total"] = sensitivity.first_and_total(x, response, confidence, independent)
    above = values > tail_level(load)
    if ranks.FEWEST <= above.sum() <= above.size - ranks.FEWEST:
        chosen = np.sort(np.concatenate([np.flatnonzero(side)[:MAX_JOINTS] for side in (above, ~above)]))
        scores = sampling.normal_scores(study, view.errors(samples[chosen], columns))
        z = np.column_stack([scores[name] for name in names])
        parts |= ranks.tail(z, above[chosen], confidence, independent)._asdict()
    return names, parts | {"first": first}, float(first.variance)


def _of_design(view: View, load: Sample, logarithm: bool, confidence: float) -> tuple[list[str], Parts, float]:
    """Names of groups, their Sobol' indices and variance from a pick-freeze design."""
    groups = view.study.groups
    if not view.store.whole:
        raise store_error(view.path, "holds a slice of a design", "merge all slices first: tolstat merge")
    values = _logarithm(load.name, load.values) if logarithm else load.values
    points = values.reshape(-1, len(groups) + 2)
    try:
        found = pick_freeze.indices(points[:, 0], points[:, 1], points[:, 2:], confidence)
    except ValueError as error:
        remedy = f"run {pick_freeze.FEWEST} points or more; decompose the logarithm of a load with a long tail"
        raise store_error(view.path, str(error), remedy) from error
    return [group.label for group in groups], {"first": found.first, "total": found.total}, float(found.variance)


def _logarithm(name: str, values: FloatArray) -> FloatArray:
    if np.nanmin(values, initial=np.inf) <= 0:
        remedy = "decompose the variance of the load itself, not of its logarithm"
        raise InputError([Fault(name, "is not positive in all joints", remedy)])
    return np.asarray(np.log(values))
