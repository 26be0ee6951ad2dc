"""Statistics of a campaign under other tolerances, by likelihood-ratio reweighting of its own joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from tolstat import sampling
from tolstat.analysis import reweight
from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.reweight import Weights
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import BUSHING_LOADS, LOAD_FIELDS
from tolstat.common.tables import VALID, Status
from tolstat.store import ResultStore, view
from tolstat.store.recall import recall
from tolstat.study import Study
from tolstat.study.change import changed
from tolstat.study.selection import columns_of
from tolstat.study.tolerances.distributions import Distribution, score

OUTSIDE = 1e-4
"""Maximum probability of the new distribution outside the range of the old one; no estimate covers that part."""
_ENDS = np.array([1e-12, 1 - 1e-12])


class Reweighted(NamedTuple):
    """Statistics of a campaign reweighted to other tolerances.

    Attributes
    ----------
    weights : Weights
        Weights of the joints that have been simulated.
    changed : list of str
        Errors whose distribution changes.
    table : DataFrame
        One row per limit: ``load``, ``unit``, ``level``, ``before`` (share of the joints as drawn), ``estimate``,
        ``lower``, ``upper``, ``bound_lower`` and ``bound_upper`` (joints without a valid load counted below and above),
        ``ess``. For a study without limits, quantiles: ``share`` instead of ``level``, loads as estimates, no bounds.
    """

    weights: Weights
    changed: list[str]
    table: pd.DataFrame

    @property
    def verdict(self) -> str:
        """Sentence on whether the table is reliable."""
        w = self.weights
        figures = f"{len(w.values)} joints count as {w.ess:.0f}; Pareto k {w.k:.2f}, {w.allowed:.2f} allowed"
        return figures if w.usable else f"needs new runs: {figures}, {reweight.LEAST_ESS} joints needed"


def of_store(
    store: ResultStore, settings: Sequence[str], study_path: Path | None = None, confidence: float = 0.95
) -> Reweighted:
    """Estimate a campaign's statistics for other tolerances.

    Parameters
    ----------
    store : ResultStore
        The result file.
    settings : sequence of str
        See `study.change.changed`.
    study_path : Path, optional
        Study file to read if the text in the result file can no longer be read.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    Reweighted
        Table and verdict.

    Raises
    ------
    InputError
        With the faults of the settings, and every error whose new distribution exceeds the range of the old one.
    StoreError
        When the joints of the file are not drawn from tolerances.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     found = tolstat.reweighted(store, ["pin1.offset_t.plus_minus=0.09 mm"])
    >>> row = found.table.iloc[0]
    >>> found.weights.usable, row["load"], bool(row["estimate"] < row["before"])
    (True, 'cross1.F', True)
    """
    study = recall(store, path=study_path)
    if not study.tolerances:
        remedy = 'give the file of a study with sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(store.path), "holds joints that are not drawn from tolerances", remedy)))
    new = changed(study, settings)
    names = [name for name, d in new.items() if d.describe() != study.tolerances[name].describe()]
    faults = [f for name in names for f in _unreachable(name, study.tolerances[name], new[name])]
    if faults:
        raise InputError(faults)
    columns = [column for name in dict.fromkeys((*names, *study.copula.names)) for column in columns_of(name)]
    campaign = view.read(store, LOAD_FIELDS, (), weighted=True)
    blocks = view.error_blocks(store, columns)  # the errors of a million joints would be half a gigabyte
    logs = np.concatenate([_log_ratios(study, new, names, errors) for errors in blocks])
    logs, campaign = logs[campaign.results["status"] != Status.PENDING], campaign.done()
    weights = reweight.smooth(logs if campaign.weights is None else logs + np.log(campaign.weights))
    rows = [_row(campaign, weights, name, level, confidence) for name, level in campaign.limits.items()]
    table = pd.DataFrame(rows) if rows else _quantiles(campaign, weights, confidence)
    return Reweighted(weights, names, table)


def _unreachable(name: str, old: Distribution, new: Distribution) -> list[Fault]:
    """Faults of a new distribution that has values where the old one has none."""
    place, remedy = f"tolerances.{name}", "run a study with these tolerances"
    if old.discrete or new.discrete:
        if not (old.discrete and new.discrete):
            return [
                Fault(place, "is measured in one of the two cases: the joints do not have the other's values", remedy)
            ]
        middle = (np.arange(10_000) + 0.5) / 10_000
        outside = float(np.mean(np.isneginf(old.logpdf(new.ppf(middle)))))
    else:
        low, high = old.ppf(_ENDS)
        u = np.concatenate([np.geomspace(1e-12, 0.5, 2000), 1 - np.geomspace(1e-12, 0.5, 2000)[::-1]])
        x = new.ppf(u)
        outside = float(np.max(u[x < low], initial=0.0) + np.max(1 - u[x > high], initial=0.0))
    if outside > OUTSIDE:
        found = f"{outside:.2g} of the new errors lie where the study draws none"
        return [Fault(place, found, remedy)]
    return []


def _log_ratios(
    study: Study,
    new: Mapping[str, Distribution],
    names: Sequence[str],
    errors: np.ndarray[tuple[int], np.dtype[np.void]],
) -> FloatArray:
    """Log likelihood ratio (new over old density) of each joint, (n,)."""
    logs = np.zeros(len(errors))
    for name in names:
        values = sampling.values(errors, name)
        logs += new[name].logpdf(values) - study.tolerances[name].logpdf(values)
    linked = study.copula.names
    if set(linked) & set(names):
        # density of the Gaussian copula: correlated over independent normal density
        form = np.linalg.inv(study.copula.matrix) - np.eye(len(linked))
        for sign, tolerances in ((-0.5, new), (0.5, study.tolerances)):
            z = np.column_stack([score(tolerances[n], sampling.values(errors, n)) for n in linked])
            logs += sign * np.einsum("ni,ij,nj->n", z, form, z)
    return logs


def _row(campaign: view.Campaign, weights: Weights, name: str, level: float, confidence: float) -> dict[str, object]:
    values, unit = view.load(campaign.results, name)
    valid = np.isin(campaign.results["status"], VALID) & np.isfinite(values)
    found = reweight.share_above(values[valid], _part(weights, valid), level, confidence, campaign.iid)
    counted = weights.values[valid & (values > level)].sum()
    before = campaign.above(values, level, confidence).estimate
    head = {"load": name, "unit": unit, "level": level, "before": before}
    bounds = {"bound_lower": counted, "bound_upper": counted + weights.values[~valid].sum()}
    return {**head, **found._asdict(), **bounds}


def _quantiles(campaign: view.Campaign, weights: Weights, confidence: float) -> pd.DataFrame:
    rows = []
    for name in BUSHING_LOADS:
        values, unit = view.load(campaign.results, name)
        valid = np.isin(campaign.results["status"], VALID) & np.isfinite(values)
        part = _part(weights, valid)
        for share in (0.5, 0.9, 0.99):
            found = reweight.quantile(values[valid], part, share, confidence, campaign.iid)
            before = campaign.quantile(values, share, confidence).estimate
            rows.append([name, unit, share, before, *found, part.ess])
    return pd.DataFrame(rows, columns=["load", "unit", "share", "before", "estimate", "lower", "upper", "ess"])


def _part(weights: Weights, rows: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Weights:
    values = weights.values[rows] / weights.values[rows].sum()
    return weights._replace(values=values, ess=float(1.0 / (values**2).sum()))
