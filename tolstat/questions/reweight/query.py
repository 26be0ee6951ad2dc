"""Statistics of a campaign under other tolerances, by likelihood-ratio reweighting of its own joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import reweight
from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.reweight import Weights
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.shown import shown
from tolstat.common.tables import Status
from tolstat.store.sample_load import SampleLoad
from tolstat.store.view import View
from tolstat.study import Study
from tolstat.study.axes import columns_of
from tolstat.study.change import changed
from tolstat.study.tolerances.distributions import Distribution, score

SHARES = (0.5, 0.9, 0.99)
"""Quantiles of a study without limits."""
MAX_OUTSIDE = 1e-4
"""Maximum probability of the new distribution outside the range of the old one; no estimate covers that part."""
WITHHELD = ("estimate", "lower", "upper", "bound_lower", "bound_upper")
"""Columns that are NaN where too few joints support them."""
_ENDS = np.array([1e-12, 1 - 1e-12])


@shown
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
        Estimates, intervals and bounds are NaN where the weights, or ``ess`` joints, do not support them (`usable`).
    """

    weights: Weights
    changed: list[str]
    table: pd.DataFrame

    @property
    def verdict(self) -> str:
        """Sentence on whether the table is reliable."""
        w = self.weights
        figures = f"{len(w.values)} joints count as {w.ess:.0f}; Pareto k {w.k:.2f}, {w.allowed:.2f} allowed"
        if not w.usable:
            return f"needs new runs, no estimates: {figures}, {reweight.LEAST_ESS} joints needed"
        missing = int(self.table["estimate"].isna().sum())
        some = (
            f"; {missing} of {len(self.table)} rows need new runs: they count as fewer than {reweight.LEAST_ESS} joints"
        )
        return figures + (some if missing else "")


def reweighted(view: View, settings: Sequence[str], confidence: float = 0.95) -> Reweighted:
    """Estimate a campaign's statistics for other tolerances.

    Parameters
    ----------
    view : View
        A campaign of joints drawn from tolerances.
    settings : sequence of str
        See `study.change.changed`.
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
        When the joints of the file are not drawn from tolerances, none of them is possible under the new ones, or none
        has a valid load.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     found = tolstat.reweighted(store.view(), ["pin1.offset_t.plus_minus=0.09 mm"])
    >>> row = found.table.iloc[0]
    >>> found.weights.usable, row["load"], bool(row["estimate"] < row["before"])
    (True, 'cross1.F', True)
    """
    view.check_drawn()
    view.check_sample()
    old = view.study.tolerances
    new = changed(view.study, settings)
    names = [name for name in new if new[name].describe() != old[name].describe()]
    faults = [fault for name in names for fault in _check_range(name, old[name], new[name])]
    if faults:
        raise InputError(faults)
    done = np.flatnonzero(view.status != Status.PENDING)
    try:
        weights = reweight.smooth(_log_ratios(view, new, names)[done])
    except ValueError as error:
        raise StoreError(str(Fault(str(view.path), str(error), "run a study with these tolerances"))) from error
    loads = [view.load(name).only(done) for name in view.limits or view.shown_loads]
    if lacking := [load.name for load in loads if not load.is_valid.any()]:
        found = f"holds no joint with a valid load: {', '.join(lacking)}"
        raise StoreError(str(Fault(str(view.path), found, f"see why: tolstat status {view.path}")))
    if view.limits:
        rows = [_share_above(load, weights, view.limits[load.name], confidence) for load in loads]
    else:
        rows = [_quantile(load, weights, share, confidence) for load in loads for share in SHARES]
    return Reweighted(weights, names, pd.DataFrame([_supported(row, weights) for row in rows]))


def _supported(row: dict[str, Any], weights: Weights) -> dict[str, Any]:
    """Row of the table, without its estimate where too few joints support it."""
    if weights.usable and row["ess"] >= reweight.LEAST_ESS:
        return row
    return row | {key: np.nan for key in WITHHELD if key in row}


def _check_range(name: str, old: Distribution, new: Distribution) -> list[Fault]:
    """Faults of a new distribution that has values where the old one has none."""
    place, remedy = f"tolerances.{name}", "run a study with these tolerances"
    if old.discrete or new.discrete:
        if not (old.discrete and new.discrete):
            found = "is of measured parts before or after the change, not both: the joints lack the new values"
            return [Fault(place, found, remedy)]
        middle = (np.arange(10_000) + 0.5) / 10_000
        outside = float(np.mean(np.isneginf(old.logpdf(new.ppf(middle)))))
    else:
        low, high = old.ppf(_ENDS)
        u = np.concatenate([np.geomspace(1e-12, 0.5, 2000), 1 - np.geomspace(1e-12, 0.5, 2000)[::-1]])
        x = new.ppf(u)
        outside = float(np.max(u[x < low], initial=0.0) + np.max(1 - u[x > high], initial=0.0))
    if outside > MAX_OUTSIDE:
        found = f"{outside:.2g} of the new errors lie where the study draws none"
        return [Fault(place, found, remedy)]
    return []


def _log_ratios(view: View, new: Mapping[str, Distribution], names: Sequence[str]) -> FloatArray:
    """Logarithm of new density over that which each joint was drawn from, (n,), up to a constant."""
    study = view.study
    columns = [column for name in dict.fromkeys((*names, *study.copula.names)) for column in columns_of(name)]
    blocks = view.error_blocks(columns)  # the errors of a million joints would be half a gigabyte
    logs = np.concatenate([_block_log_ratios(study, new, names, errors) for errors in blocks])
    return logs if view.weights is None else logs + np.log(view.weights)


def _block_log_ratios(
    study: Study, new: Mapping[str, Distribution], names: Sequence[str], errors: NDArray[np.void]
) -> FloatArray:
    """Logarithm of new over old density of the errors of some joints, (m,)."""
    logs = np.zeros(len(errors))
    for name in names:
        values = sampling.values(study, errors, name)
        logs += new[name].logpdf(values) - study.tolerances[name].logpdf(values)
    correlated = study.copula.names
    if set(correlated) & set(names):
        # density of the Gaussian copula: correlated over independent normal density
        form = np.linalg.inv(study.copula.matrix) - np.eye(len(correlated))
        for sign, tolerances in ((-0.5, new), (0.5, study.tolerances)):
            z = np.column_stack([score(tolerances[n], sampling.values(study, errors, n)) for n in correlated])
            logs += sign * np.einsum("ni,ij,nj->n", z, form, z)
    return logs


def _share_above(load: SampleLoad, weights: Weights, level: float, confidence: float) -> dict[str, Any]:
    """Row of the table for a limit; `weights` are those of the joints of `load`."""
    valid = load.is_valid
    found = reweight.share_above(load.values[valid], _restricted(weights, valid), level, confidence, load.iid)
    above = weights.values[valid & (load.values > level)].sum()
    head = {"load": load.name, "unit": load.unit, "level": level, "before": load.above(level, confidence).estimate}
    bounds = {"bound_lower": above, "bound_upper": above + weights.values[~valid].sum()}
    return {**head, **found._asdict(), **bounds}


def _quantile(load: SampleLoad, weights: Weights, share: float, confidence: float) -> dict[str, Any]:
    """Row of the table for a quantile; `weights` are those of the joints of `load`."""
    part = _restricted(weights, load.is_valid)
    estimate, lower, upper = reweight.quantile(load.values[load.is_valid], part, share, confidence, load.iid)
    before = load.quantile(share, confidence).estimate
    head = {"load": load.name, "unit": load.unit, "share": share, "before": before}
    return {**head, "estimate": estimate, "lower": lower, "upper": upper, "ess": part.ess}


def _restricted(weights: Weights, joints: NDArray[np.bool_]) -> Weights:
    """Weights of some of the joints, with the sum 1."""
    values = weights.values[joints] / weights.values[joints].sum()
    return weights._replace(values=values, ess=float(1.0 / (values**2).sum()))
