"""The cheapest tolerances with which a campaign keeps its limits, from its own joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import allocation, exceedance, reweight
from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.reweight import Weights
from tolstat.campaign.recall import recall
from tolstat.common import selected_results as kept
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.tables import VALID, Status
from tolstat.store import ResultStore
from tolstat.store import view as source
from tolstat.study import Study, costs, rule, scaling, selection
from tolstat.study.costs import Cost
from tolstat.study.rule import Statement
from tolstat.study.scaling import Tolerance
from tolstat.study.tolerances.distributions import Distribution, Normal, Rayleigh

EXAMPLE = 'write --limit "P(cross1.F > 700 N) < 0.001"'
DIGITS = 3
"""Of the tolerances proposed."""
CHOOSING = 0.999
"""Confidence of the intervals that are aimed at: so far from the limit that the judges, who have 0.95, mostly agree."""
MOST = 50_000
"""Joints that choose; more are for judging."""


class Allocation(NamedTuple):
    """Tolerances proposed for a study.

    Attributes
    ----------
    study : Study
        The study as it is.
    tolerances : DataFrame
        One row a tolerance that may change: ``tolerance`` (pattern), ``errors`` (how many), ``unit``, ``before`` and
        ``proposed`` (half band, SI), ``factor``, ``cost_before``, ``cost``.
    limits : DataFrame
        One row a limit, judged by joints that had no part in the choice: ``limit``, ``target``, ``before`` (share of
        all joints as drawn), ``estimate``, ``lower``, ``upper``, ``ess``.
    entries : dict
        Keys of the changed entries of ``[tolerances]`` by pattern.
    weights : Weights
        Of the joints that judged.
    aim : str
        See `analysis.allocation.Choice`.
    more : float
        How many times as many joints, made to the proposal, would show that it holds; inf where it is not expected to.
    """

    study: Study
    tolerances: pd.DataFrame
    limits: pd.DataFrame
    entries: dict[str, dict[str, Any]]
    weights: Weights
    aim: str
    more: float

    @property
    def holds(self) -> bool:
        """Whether the joints show it: upper ends below the targets, by weights that can be trusted."""
        return self.weights.usable and bool((self.limits["upper"] < self.limits["target"]).all())

    @property
    def verdict(self) -> str:
        """Sentence on what the proposal is worth."""
        w = self.weights
        figures = (
            f"{len(w.values)} joints judged, they count as {w.ess:.0f}; Pareto k {w.k:.2f}, {w.allowed:.2f} allowed"
        )
        if self.holds:
            return f"holds: the upper ends are below the limits ({figures})"
        if not w.usable:
            return f"needs new runs: these joints do not tell ({figures})"
        if (self.limits["estimate"] < self.limits["target"]).all():
            n = self.more * self.weights.ess
            return f"needs new runs: expected to hold, some {n:.0f} joints made to it would show it ({figures})"
        return f"needs new runs: a step, as far as these joints can tell; run it and allocate again ({figures})"

    @property
    def text(self) -> str:
        """The study with the proposal, TOML. Its seed is another one: joints that chose have no part in the check."""
        return scaling.rewritten(self.study, self.entries, self.study.sampling.seed + 1)


def of_store(
    store: ResultStore,
    limits: Sequence[str],
    cost_file: Path | None = None,
    keep: Sequence[str] = (),
    study_path: Path | None = None,
    confidence: float = 0.95,
) -> Allocation:
    """Propose the cheapest tolerances with which limits are kept.

    Parameters
    ----------
    store : ResultStore
        The result file, of joints drawn from tolerances.
    limits : sequence of str
        ``"P(cross*.F > 700 N) < 0.001"``: the share of joints of which any of these loads is above the level. Joints
        without a valid load count as above.
    cost_file : Path, optional
        See `study.costs.of`.
    keep : sequence of str
        Names or patterns of errors whose tolerances stay as they are.
    study_path : Path, optional
        The study file, where the text in the result file does not do any more.
    confidence : float
        Of the intervals.

    Returns
    -------
    Allocation
        One factor an entry of the study's ``[tolerances]``; those of operating point and material, of measured parts
        and of correlated errors stay as they are.

    Raises
    ------
    InputError
        With every fault of limits, costs and names.
    StoreError
        When the file's joints are not drawn from tolerances, or too few.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     found = tolstat.allocated(store, ["P(cross1.F > 700 N) < 0.08"])
    >>> found.tolerances.set_index("tolerance")["factor"].round(1).to_dict()
    {'pin4.tilt_t': 1.0, 'pin[12].offset_t': 0.8}
    """
    study = recall(store, path=study_path)
    if not study.tolerances:
        remedy = 'give the file of a study with sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(store.path), "holds joints that are not drawn from tolerances", remedy)))
    if study.groups:
        remedy = 'give the file of a study with sampling.method = "random"'
        found = "holds joints that share their errors with others: no half of them can judge the other"
        raise StoreError(str(Fault(str(store.path), found, remedy)))
    statements, free, prices = _asked(store, study, limits, cost_file, keep)
    names = [name for t in free for name in t.names]
    columns = [column for name in names for column in selection.columns_of(name)]
    campaign = source.read(store, source.LOAD_FIELDS, ())
    done = np.flatnonzero(campaign.results["status"] != Status.PENDING)
    above = np.column_stack([_above(campaign.results, s) for s in statements])[done]
    chosen, judges = allocation.halves(len(above), MOST)
    if len(judges) < 4 * reweight.LEAST_ESS:
        found = f"has {len(above)} joints simulated"
        raise StoreError(str(Fault(str(store.path), found, f"run {8 * reweight.LEAST_ESS} joints or more")))
    price = np.array([cost.reach for cost in prices])
    ratios = _Ratios(free, source.errors_at(store, columns, done[chosen]))
    problem = allocation.Problem(
        ratios.at,
        ratios.log_spread,
        above[chosen],
        np.array([s.bound for s in statements]),
        lambda factors: sum(cost.at(float(f)) for cost, f in zip(prices, factors, strict=True)),
        price[:, 0],
        np.where([t.widens for t in free], price[:, 1], 1.0),
        campaign.iid,
        CHOOSING,
    )
    choice = allocation.search(problem)
    entries = {
        t.pattern: t.scaled(float(f), DIGITS) for t, f in zip(free, choice.factors, strict=True) if abs(f - 1) > 5e-3
    }
    logs = np.concatenate([_Ratios(free, errors).of(entries) for errors in source.error_blocks(store, columns)])
    weights = reweight.smooth(logs[done[judges]])
    table = _judged(statements, above, above[judges], weights, campaign.iid, confidence)
    more = [
        allocation.joints_needed(share, ess, target, confidence)
        for share, ess, target in table[["estimate", "ess", "target"]].to_numpy(float)
    ]
    return Allocation(study, _tolerances(free, prices, entries), table, entries, weights, choice.aim, max(more))


class _Ratios:
    """Logarithms of new over old density of joints, by factors on their tolerances; the last ones are remembered."""

    def __init__(self, free: Sequence[Tolerance], errors: NDArray[np.void]) -> None:
        self._free = free
        self._values = [[sampling.values(errors, name) for name in t.names] for t in free]
        self._old = [t.distribution(t.entry) for t in free]
        self._before = [self._density(i, t.entry) for i, t in enumerate(free)]
        self._one = lru_cache(maxsize=4 * len(free))(self._scaled)

    def at(self, factors: FloatArray) -> FloatArray:
        """Of tolerances scaled by factors, (n,)."""
        return np.asarray(sum(self._one(i, float(f)) for i, f in enumerate(factors)))

    def log_spread(self, factors: FloatArray) -> float:
        """See `analysis.allocation.Problem`; inf where the ratio has no mean square."""
        return float(sum(len(t.names) * self._spread(i, float(factors[i])) for i, t in enumerate(self._free)))

    def of(self, entries: dict[str, dict[str, Any]]) -> FloatArray:
        """Of other entries, by pattern, (n,)."""
        parts = [self._density(i, entries.get(t.pattern, t.entry)) for i, t in enumerate(self._free)]
        return np.asarray(sum(parts) - sum(self._before))

    def _scaled(self, i: int, factor: float) -> FloatArray:
        old, t = self._old[i], self._free[i]
        if isinstance(old, (Normal, Rayleigh)) and scaling.unbounded(old) and "mean" not in t.entry:
            # what the entry would give, without reading it anew; the judges go by the entry
            return self._logpdf(i, replace(old, sigma=factor * old.sigma)) - self._before[i]
        return self._density(i, t.scaled(factor)) - self._before[i]

    def _density(self, i: int, entry: dict[str, Any]) -> FloatArray:
        return self._logpdf(i, self._free[i].distribution(entry))

    def _logpdf(self, i: int, found: Distribution) -> FloatArray:
        return np.asarray(sum(found.logpdf(values) for values in self._values[i]))

    def _spread(self, i: int, factor: float) -> float:
        """Logarithm of the mean square of new over old density of one error."""
        old = self._old[i]
        if scaling.unbounded(old):  # 1 / (r sqrt(2 - r^2)) for r times the deviation, twice for a radius
            square = 2.0 - factor**2
            coordinates = 2 if isinstance(old, Rayleigh) else 1
            return -coordinates * math.log(factor * math.sqrt(square)) if square > 0 else math.inf
        new = self._free[i].distribution(self._free[i].scaled(factor))
        x = new.ppf((np.arange(1000) + 0.5) / 1000)
        return float(np.log(np.mean(np.exp(new.logpdf(x) - old.logpdf(x)))))


def _asked(
    store: ResultStore, study: Study, limits: Sequence[str], cost_file: Path | None, keep: Sequence[str]
) -> tuple[list[Statement], list[Tolerance], list[Cost]]:
    """Limits, and tolerances that may change with their costs."""
    faults: list[Fault] = []
    statements: list[Statement] = []
    for text in limits:
        with gather(faults):
            statements.append(rule.parse(text, "", "--limit", EXAMPLE))
            lacking = [name for name in statements[-1].loads if not kept.holds(store.columns, name)]
            if lacking:
                faults.append(Fault("--limit", f"the file does not keep {', '.join(lacking)}", "ask for what it keeps"))
    every = scaling.tolerances(study)
    for pattern in keep:
        if not selection.select(pattern, study.tolerances):
            faults.append(Fault("--keep", f"{pattern!r} selects no error that the study scatters", "see [tolerances]"))
    prices: list[Cost] = []
    with gather(faults):
        prices = costs.of(every, cost_file)
    if faults:
        raise InputError(faults)
    kept_names = {name for pattern in keep for name in selection.select(pattern, study.tolerances)}
    free = [
        (t, cost)
        for t, cost in zip(every, prices, strict=True)
        if not kept_names & set(t.names) and cost.reach[0] < cost.reach[1]
    ]
    if not free:
        remedy = "name some in --costs, or leave --keep out; measured, lognormal and correlated errors stay as they are"
        raise InputError([Fault("--costs", "leaves no tolerance that may change", remedy)])
    return statements, [t for t, _ in free], [cost for _, cost in free]


def _above(results: NDArray[np.void], said: Statement) -> NDArray[np.bool_]:
    """Which joints are above a limit in any load, or have no valid load."""
    largest = np.max([source.load(results, name)[0] for name in said.loads], axis=0)
    valid = np.isin(results["status"], VALID) & np.isfinite(largest)
    return np.asarray(~valid | (largest > said.level))


def _judged(
    statements: Sequence[Statement],
    above: NDArray[np.bool_],
    judges: NDArray[np.bool_],
    weights: Weights,
    iid: bool,
    confidence: float,
) -> pd.DataFrame:
    rows = []
    for i, said in enumerate(statements):
        found = reweight.share_above(judges[:, i], weights, 0.5, confidence, iid)
        before = exceedance.at(above[:, i], np.ones(len(above), int), 0.5).estimate
        rows.append({"limit": said.text, "target": said.bound, "before": before, **found._asdict()})
    return pd.DataFrame(rows)


def _tolerances(free: Sequence[Tolerance], prices: Sequence[Cost], entries: dict[str, dict[str, Any]]) -> pd.DataFrame:
    rows = []
    for t, cost in zip(free, prices, strict=True):
        width = scaling.width(entries.get(t.pattern, t.entry), t.site)
        factor = width / t.width
        row = {
            "tolerance": t.pattern,
            "errors": len(t.names),
            "unit": t.site.unit,
            "before": t.width,
            "proposed": width,
        }
        rows.append({**row, "factor": factor, "cost_before": cost.at(1.0), "cost": cost.at(factor)})
    return pd.DataFrame(rows)
