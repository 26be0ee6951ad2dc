"""Causes of a load: errors that contribute to its variance, and errors over-represented in its tail."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import pick_freeze, ranks, sensitivity
from tolstat.analysis.sample import Sample
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.shown import shown
from tolstat.store.view import View

Array = NDArray[np.float64]

TAIL_STARTS_AT = 0.9
"""Share of the joints below the tail, for a load without a limit."""
MIN_JOINTS = 200
"""Minimum number of valid joints."""
MAX_JOINTS = sensitivity.MOST
"""Maximum number of joints (the first ones) for shares and ranks, and on either side of the tail: more add little, and
a million joints with fifty errors do not fit into a gigabyte."""


@shown
class Causes(NamedTuple):
    """Causes of one load.

    Attributes
    ----------
    load : str
        Its name.
    joints : int
        Number of valid joints.
    used : int
        Number of them used for shares and ranks, at most `MAX_JOINTS`.
    without_load : int
        Number of joints without a valid load, which are left out.
    level : float
        Level at which the tail begins, SI: the study's limit or, without one, the 90 % quantile.
    above : int
        Number of valid joints above it.
    unit : str
        SI unit of the load.
    std : float
        Standard deviation of the load, or of its logarithm.
    additive, r2 : float
        Sum of the first-order indices; R^2 of the rank regression, NaN for a pick-freeze design.
    table : DataFrame
        One row per error that scatters (two per vector of a zone), the largest first-order index first: ``error``; with
        ``_lower`` and ``_upper``: ``first``, ``total`` (NaN for correlated errors), ``srrc``, ``direction`` and
        ``size``; the last two also with ``_p``, and NaN if too few joints are on either side of the level. For a
        pick-freeze design, one row per group of errors, with ``first`` and ``total`` only.
    """

    load: str
    joints: int
    used: int
    without_load: int
    level: float
    above: int
    unit: str
    std: float
    additive: float
    r2: float
    table: pd.DataFrame

    @property
    def from_design(self) -> bool:
        """Whether the joints are a pick-freeze design."""
        return math.isnan(self.r2)


def causes_of(view: View, by: str, confidence: float = 0.95, log: bool = False, joints: int | None = None) -> Causes:
    """Find the causes of a load.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances, all of the same weight.
    by : str
        A load that can have a limit (``cross1.F``, ``pin2.contact``, ``psi``).
    confidence : float
        Confidence level of all intervals.
    log : bool
        Decompose the variance of the load's logarithm: for a load whose variance a few joints dominate.
    joints : int, optional
        Number of samples to use, from the first; by default all. Of a pick-freeze design all are used.

    Returns
    -------
    Causes
        Indices of every error that scatters.

    Raises
    ------
    InputError
        When there is no such load, the study does not keep it, or `log` is set and a value is not positive.
    StoreError
        When the file has too few valid joints, or joints that are not drawn from tolerances or differ in weight.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     found = tolstat.causes_of(store.view(), "cross1.F")
    >>> found.table["error"][:2].sort_values().tolist()
    ['pin1.offset_t', 'pin2.offset_z']
    """
    view.check_drawn()
    view.check("index")
    load = view.load(by)
    if view.study.groups:
        return _of_design(view, load, confidence, log)
    if joints is not None:
        load = load.only(np.arange(min(joints, view.n)))
    return _of_samples(view, load, confidence, log)


def _of_samples(view: View, load: Sample, confidence: float, log: bool) -> Causes:
    """Causes from joints that are all drawn from the same tolerances."""
    study = view.study
    samples = np.flatnonzero(load.is_valid)
    values = load.values[samples]
    needed = max(MIN_JOINTS, len(sampling.streams(study)) + 2 * ranks.GROUPS)
    if samples.size < needed:
        what = "load on all limits" if load.name == ANY_LIMIT else load.name
        found = f"has {samples.size} joints with a valid {what}"
        raise StoreError(str(Fault(str(view.path), found, f"run {needed} joints or more")))
    if np.ptp(values) == 0:
        remedy = "name another load with --by"
        found = f"has the same {load.name} in all joints: no error causes it"
        raise StoreError(str(Fault(str(view.path), found, remedy)))
    if log:
        _check_positive(load.name, values)
    errors = view.errors(samples[:MAX_JOINTS], sampling.columns(study))
    own = scattering(sampling.components(study, errors))
    names, x = list(own), np.column_stack(list(own.values()))
    y = values[:MAX_JOINTS]
    response = np.log(y) if log else y
    srrc = ranks.regression(x, y, confidence, view.design.has_interval("index"))
    parts: dict[str, NamedTuple] = {"srrc": srrc}
    if study.copula.names or study.sampling.is_matched:
        first = parts["first"] = sensitivity.first_order(x, response, confidence, view.design.has_interval("index"))
    else:
        first, parts["total"] = sensitivity.first_and_total(x, response, confidence, view.design.has_interval("index"))
        parts["first"] = first
    level = _tail_level(load)
    above = values > level
    if ranks.FEWEST <= above.sum() <= above.size - ranks.FEWEST:
        parts |= _over_represented(view, names, samples, above, confidence)
    return Causes(
        load=load.name,
        joints=samples.size,
        used=len(y),
        without_load=sum(load.unresolved),
        level=level,
        above=int(above.sum()),
        unit=load.unit,
        std=float(np.sqrt(first.variance)),
        additive=float(first.estimate.sum()),
        r2=srrc.r2,
        table=_table(names, parts),
    )


def _over_represented(
    view: View, names: list[str], samples: NDArray[np.intp], above: NDArray[np.bool_], confidence: float
) -> dict[str, NamedTuple]:
    """Compare the errors of the first `MAX_JOINTS` joints above the level with those of at most as many below it."""
    study = view.study
    chosen = np.sort(np.concatenate([np.flatnonzero(side)[:MAX_JOINTS] for side in (above, ~above)]))
    errors = view.errors(samples[chosen], sampling.columns(study))
    scores = sampling.normal_scores(study, errors)
    z = np.column_stack([scores[name] for name in names])
    return ranks.tail(z, above[chosen], confidence, view.design.has_interval("index"))._asdict()


def _of_design(view: View, load: Sample, confidence: float, log: bool) -> Causes:
    """Causes from a pick-freeze design: Sobol' indices of groups of errors."""
    path, groups = str(view.path), view.study.groups
    if not view.store.whole:
        raise StoreError(str(Fault(path, "holds a slice of a design", "merge all slices first: tolstat merge")))
    values = load.values
    if log:
        _check_positive(load.name, values[load.is_valid])
        values = np.log(values)
    points = values.reshape(-1, len(groups) + 2)
    try:
        found = pick_freeze.indices(points[:, 0], points[:, 1], points[:, 2:], confidence)
    except ValueError as error:
        remedy = f"run {pick_freeze.FEWEST} points or more; decompose the logarithm of a load with a long tail"
        raise StoreError(str(Fault(path, str(error), remedy))) from error
    level = _tail_level(load)
    return Causes(
        load=load.name,
        joints=load.valid.size,
        used=load.valid.size,
        without_load=sum(load.unresolved),
        level=level,
        above=int((load.valid > level).sum()),
        unit=load.unit,
        std=float(np.sqrt(found.variance)),
        additive=float(found.first.estimate.sum()),
        r2=np.nan,
        table=_table([group.label for group in groups], {"first": found.first, "total": found.total}),
    )


def scattering(components: Mapping[str, Array]) -> dict[str, Array]:
    """Those of the components (`sampling.components`) that vary over the joints."""
    return {name: own for name, own in components.items() if np.ptp(own) > 0}


def _check_positive(name: str, values: NDArray[np.float64]) -> None:
    if values.min(initial=np.inf) <= 0:
        remedy = "decompose the variance of the load itself, not of its logarithm"
        raise InputError([Fault(name, "is not positive in all joints", remedy)])


def _tail_level(load: Sample) -> float:
    return load.quantile(TAIL_STARTS_AT).estimate if load.limit is None else load.limit


def _table(names: list[str], parts: dict[str, NamedTuple]) -> pd.DataFrame:
    """Table of `Causes`, from the estimates by name of the column."""
    table = pd.DataFrame({"error": names})
    for kind in ("first", "total", "srrc", "direction", "size"):
        found = parts[kind]._asdict() if kind in parts else {}
        for end in ("estimate", "lower", "upper"):
            table[kind if end == "estimate" else f"{kind}_{end}"] = found.get(end, np.nan)
        if kind in ("direction", "size"):
            table[f"{kind}_p"] = found.get("p", np.nan)
    return table.sort_values("first", ascending=False, ignore_index=True)
