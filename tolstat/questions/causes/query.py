"""Causes of a load: errors that contribute to its variance, and errors over-represented in its tail."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import exceedance, overrepresentation, pick_freeze, quantile, regression, sensitivity
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import LOAD_FIELDS, UNIT_OF_LOAD
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import VALID
from tolstat.store import ResultStore, view
from tolstat.store.recall import recall
from tolstat.study import Study
from tolstat.study.selection import columns_of
from tolstat.study.tolerances.distributions import score

TAIL = 0.9
"""Share of the joints below the tail, for a load without a limit."""
MOST = sensitivity.MOST
"""Maximum number of joints (the first ones) for shares and ranks, and on either side of the tail: more add little, and
a million joints with fifty errors do not fit into a gigabyte."""
JOINTS = 200
"""Minimum number of valid joints."""


class Causes(NamedTuple):
    """Causes of one load.

    Attributes
    ----------
    load : str
        Its name.
    joints, used, lost : int
        Number of valid joints; of those used for shares and ranks, at most `MOST`; of joints without a valid load,
        which are left out.
    level, above : float, int
        Level at which the tail begins, SI (the study's limit or, without one, the 90 % quantile), and number of joints
        above it.
    unit : str
        SI unit of the load.
    std : float
        Standard deviation of the load, or of its logarithm.
    additive, r2 : float
        Sum of the first-order indices; R^2 of the rank regression, NaN for a pick-freeze design.
    table : DataFrame
        One row per error that scatters, the largest first-order index first: ``error``; with ``_lower`` and ``_upper``:
        ``first``, ``total`` (NaN for correlated errors), ``srrc``, ``direction`` and ``size``; the last two also with
        ``_p``, and NaN if too few joints are on either side of the level. For a pick-freeze design, one row per group
        of errors, with ``first`` and ``total`` only.
    """

    load: str
    joints: int
    used: int
    lost: int
    level: float
    above: int
    unit: str
    std: float
    additive: float
    r2: float
    table: pd.DataFrame


def of_store(
    store: ResultStore, by: str, study_path: Path | None = None, confidence: float = 0.95, log: bool = False
) -> Causes:
    """Find the causes of a load.

    Parameters
    ----------
    store : ResultStore
        The result file.
    by : str
        A load that can have a limit (``cross1.F``, ``pin2.contact``, ``psi``).
    study_path : Path, optional
        Study file to read if the text in the result file can no longer be read.
    confidence : float
        Confidence level of all intervals.
    log : bool
        Decompose the variance of the load's logarithm: for a load whose variance a few joints dominate.

    Returns
    -------
    Causes
        Indices of every error that scatters.

    Raises
    ------
    InputError
        When there is no such load, or `log` is set and a value is not positive.
    StoreError
        When the file has too few valid joints, or joints that are not drawn from tolerances.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     found = tolstat.causes_of(store, "cross1.F")
    >>> found.table["error"][:2].sort_values().tolist()
    ['pin1.offset_t', 'pin2.offset_z']
    """
    if by not in UNIT_OF_LOAD:
        raise InputError([Fault("--by", f"{by!r} is not a load", did_you_mean(by, list(UNIT_OF_LOAD)))])
    study = recall(store, path=study_path)
    if not study.tolerances:
        remedy = 'give the file of a study with sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(store.path), "holds joints that are not drawn from tolerances", remedy)))
    if study.groups:
        return _frozen(store, study, by, confidence, log)
    campaign = view.read(store, LOAD_FIELDS, ())
    columns = [column for name in study.tolerances for column in columns_of(name)]
    errors = partial(view.errors_at, store, columns)
    return _of_joints(campaign, study, by, confidence, log, str(store.path), errors)


def of_campaign(
    campaign: view.Campaign,
    study: Study,
    by: str,
    confidence: float = 0.95,
    log: bool = False,
    place: str = "the campaign",
) -> Causes:
    """Find the causes of a load from joints in memory; other parameters and exceptions as for `of_store`.

    Parameters
    ----------
    campaign : Campaign
        All or some of the joints, all of the same weight.
    study : Study
        Their study.
    place : str
        Name of the joints in error messages.
    """
    return _of_joints(campaign, study, by, confidence, log, place, lambda rows: campaign.errors[rows])


def _of_joints(
    campaign: view.Campaign,
    study: Study,
    by: str,
    confidence: float,
    log: bool,
    place: str,
    errors: Callable[[NDArray[np.intp]], NDArray[np.void]],
) -> Causes:
    """Causes of a load; `errors` returns the errors of the joints at given indices of the campaign."""
    values, unit = view.load(campaign.results, by)
    status = campaign.results["status"]
    rows = np.flatnonzero(np.isin(status, VALID) & np.isfinite(values))
    needed = max(JOINTS, len(study.tolerances) + 2 * regression.GROUPS)
    if rows.size < needed or np.ptp(values[rows]) == 0:
        found = f"has {rows.size} joints with a valid load that scatters"
        raise StoreError(str(Fault(place, found, f"run {needed} joints or more")))
    if log and values[rows].min() <= 0:
        raise InputError([Fault("--log", f"{by} is not positive in all joints", "leave it out")])
    level = campaign.limits.get(by, quantile.at(values[rows], status[rows], TAIL).estimate)
    above = values[rows] > level
    body, tail = rows[:MOST], np.sort(np.concatenate([rows[above][:MOST], rows[~above][:MOST]]))
    table = errors(body)
    names = scattering(study, table)
    x = np.column_stack([sampling.values(table, name) for name in names])
    y = np.log(values[body]) if log else values[body]
    first = sensitivity.first_order(x, y, confidence, campaign.iid)
    ranks = regression.ranks(x, values[body], confidence, campaign.iid)
    parts: dict[str, NamedTuple] = {"first": first, "srrc": ranks}
    if not study.copula.names:
        parts["total"] = sensitivity.total(x, y, confidence, campaign.iid)
    if overrepresentation.FEWEST <= above.sum() <= above.size - overrepresentation.FEWEST:
        table = errors(tail) if rows.size > MOST else table
        z = np.column_stack([score(study.tolerances[name], sampling.values(table, name)) for name in names])
        parts |= overrepresentation.tail(z, values[tail] > level, confidence, campaign.iid)._asdict()
    found_causes = _table(names, parts).sort_values("first", ascending=False, ignore_index=True)
    lost = exceedance.sort_out(values, status).n_unresolved
    std = float(np.sqrt(first.variance))
    counts = (level, int(above.sum()), unit, std, float(first.estimate.sum()), ranks.r2)
    return Causes(by, rows.size, body.size, lost, *counts, found_causes)


def _frozen(store: ResultStore, study: Study, by: str, confidence: float, log: bool) -> Causes:
    """Causes from a pick-freeze design: Sobol' indices of groups of errors."""
    if not store.whole:
        raise StoreError(
            str(Fault(str(store.path), "holds a slice of a design", "merge all slices first: tolstat merge"))
        )
    campaign = view.read(store, LOAD_FIELDS, ())
    values, unit = view.load(campaign.results, by)
    status = campaign.results["status"]
    valid = np.isin(status, VALID) & np.isfinite(values)
    if log and values[valid].min(initial=np.inf) <= 0:
        raise InputError([Fault("--log", f"{by} is not positive in all joints", "leave it out")])
    load = np.full(len(values), np.nan)
    load[valid] = np.log(values[valid]) if log else values[valid]
    points = load.reshape(-1, len(study.groups) + 2)
    try:
        found = pick_freeze.indices(points[:, 0], points[:, 1], points[:, 2:], confidence)
    except ValueError as error:
        raise StoreError(str(Fault(str(store.path), str(error), f"run {pick_freeze.FEWEST} points or more"))) from error
    parts: dict[str, NamedTuple] = {"first": found.first, "total": found.total}
    names = [group.label for group in study.groups]
    table = _table(names, parts).sort_values("first", ascending=False, ignore_index=True)
    level = campaign.limits.get(by, quantile.at(values, status, TAIL).estimate)
    lost = exceedance.sort_out(values, status).n_unresolved
    counts = (level, int((values[valid] > level).sum()), unit, float(np.sqrt(found.variance)))
    return Causes(
        by, int(valid.sum()), int(valid.sum()), lost, *counts, float(found.first.estimate.sum()), np.nan, table
    )


def scattering(study: Study, errors: NDArray[np.void]) -> list[str]:
    """Names of the tolerances of a study whose errors vary over the joints of a table ERROR."""
    return [name for name in study.tolerances if np.ptp(sampling.values(errors, name)) > 0]


def _table(names: list[str], parts: dict[str, NamedTuple]) -> pd.DataFrame:
    table = pd.DataFrame({"error": names})
    for kind in ("first", "total", "srrc", "direction", "size"):
        found = parts[kind]._asdict() if kind in parts else {}
        for end in ("estimate", "lower", "upper"):
            table[kind if end == "estimate" else f"{kind}_{end}"] = found.get(end, np.nan)
        if kind in ("direction", "size"):
            table[f"{kind}_p"] = found.get("p", np.nan)
    return table
