"""The cheapest tolerances with which a campaign keeps its limits, estimated from its own joints."""

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
from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.loads import LOAD_FIELDS
from tolstat.common.tables import VALID, Status
from tolstat.store import ResultStore, view
from tolstat.store.recall import recall
from tolstat.study import Study, costs, rule, scaling, selection
from tolstat.study.costs import Cost
from tolstat.study.rule import Statement
from tolstat.study.scaling import Tolerance
from tolstat.study.tolerances.distributions import Distribution, Normal, Rayleigh

EXAMPLE = 'write --limit "P(cross1.F > 700 N) < 0.001"'
DIGITS = 3
"""Significant digits of the tolerances proposed."""
CHOOSING = 0.999
"""Confidence level of the search: higher than the 0.95 of the final check, so that the check mostly confirms it."""
MOST = 50_000
"""Maximum number of joints used in the search; all others are used in the final check."""


class Allocation(NamedTuple):
    """Tolerances proposed for a study.

    Attributes
    ----------
    study : Study
        The study as it is.
    tolerances : DataFrame
        One row per tolerance that may change: ``tolerance`` (pattern), ``errors`` (how many), ``unit``, ``before`` and
        ``proposed`` (half band, SI), ``factor``, ``cost_before``, ``cost``.
    limits : DataFrame
        One row per limit, from joints that the search did not use: ``limit``, ``target``, ``before`` (share of all
        joints as drawn), ``estimate``, ``lower``, ``upper``, ``ess``.
    entries : dict
        Keys of the changed entries of ``[tolerances]`` by pattern.
    weights : Weights
        Weights of the joints of the final check.
    aim : str
        See `analysis.allocation.Choice`.
    more : float
        Factor on ``weights.ess``: joints made to the proposal that would show that it holds; inf if not expected to.
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
        """Whether the final check confirms the proposal: reliable weights, and all upper ends below the targets."""
        return self.weights.usable and bool((self.limits["upper"] < self.limits["target"]).all())

    @property
    def verdict(self) -> str:
        """Sentence on whether the proposal holds, or why it needs new runs."""
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
        """The study with the proposal, TOML, with another seed: a check must not use the joints of the search."""
        return scaling.rewritten(self.study, self.entries, self.study.sampling.seed + 1)


def of_store(
    store: ResultStore,
    limits: Sequence[str],
    cost_file: Path | None = None,
    keep: Sequence[str] = (),
    study_path: Path | None = None,
    confidence: float = 0.95,
) -> Allocation:
    """Propose the cheapest tolerances that keep the limits.

    Parameters
    ----------
    store : ResultStore
        The result file, of joints drawn from tolerances.
    limits : sequence of str
        ``"P(cross*.F > 700 N) < 0.001"``: share of the joints with any of these loads above the level. Joints without a
        valid load count as above.
    cost_file : Path, optional
        See `study.costs.of`.
    keep : sequence of str
        Names or patterns of errors whose tolerances stay as they are.
    study_path : Path, optional
        Study file to read if the text in the result file can no longer be read.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    Allocation
        One factor per entry of the study's ``[tolerances]``; entries of the operating point, the material, measured
        parts and correlated errors are not changed.

    Raises
    ------
    InputError
        With every fault of limits, costs and names.
    StoreError
        When the file's joints are not drawn from tolerances, are drawn in groups, or are too few.

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
    campaign = view.read(store, LOAD_FIELDS, ())
    done = np.flatnonzero(campaign.results["status"] != Status.PENDING)
    above = np.column_stack([_above(campaign.results, s) for s in statements])[done]
    chosen, judges = allocation.halves(len(above), MOST)
    if len(judges) < 4 * reweight.LEAST_ESS:
        found = f"has {len(above)} joints simulated"
        raise StoreError(str(Fault(str(store.path), found, f"run {8 * reweight.LEAST_ESS} joints or more")))
    price = np.array([cost.reach for cost in prices])
    ratios = _Ratios(free, view.errors_at(store, columns, done[chosen]))
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
    logs = np.concatenate([_Ratios(free, errors).of(entries) for errors in view.error_blocks(store, columns)])
    weights = reweight.smooth(logs[done[judges]])
    table = _judged(statements, above, above[judges], weights, campaign.iid, confidence)
    more = [
        allocation.joints_needed(share, ess, target, confidence)
        for share, ess, target in table[["estimate", "ess", "target"]].to_numpy(float)
    ]
    return Allocation(study, _tolerances(free, prices, entries), table, entries, weights, choice.aim, max(more))


class _Ratios:
    """Log likelihood ratios (new over old density) of joints as a function of factors on tolerances; with a cache."""

    def __init__(self, free: Sequence[Tolerance], errors: NDArray[np.void]) -> None:
        self._free = free
        self._values = [[sampling.values(errors, name) for name in t.names] for t in free]
        self._old = [t.distribution(t.entry) for t in free]
        self._before = [self._density(i, t.entry) for i, t in enumerate(free)]
        self._one = lru_cache(maxsize=4 * len(free))(self._scaled)

    def at(self, factors: FloatArray) -> FloatArray:
        """Log ratios for tolerances scaled by factors, (n,)."""
        return np.asarray(sum(self._one(i, float(f)) for i, f in enumerate(factors)))

    def log_spread(self, factors: FloatArray) -> float:
        """See `analysis.allocation.Problem`; inf if the ratio has no finite mean square."""
        return float(sum(len(t.names) * self._spread(i, float(factors[i])) for i, t in enumerate(self._free)))

    def of(self, entries: dict[str, dict[str, Any]]) -> FloatArray:
        """Log ratios for other entries, by pattern, (n,)."""
        parts = [self._density(i, entries.get(t.pattern, t.entry)) for i, t in enumerate(self._free)]
        return np.asarray(sum(parts) - sum(self._before))

    def _scaled(self, i: int, factor: float) -> FloatArray:
        old, t = self._old[i], self._free[i]
        if isinstance(old, (Normal, Rayleigh)) and scaling.unbounded(old) and "mean" not in t.entry:
            # same as the scaled entry, but without parsing it; the final check uses the entry
            return self._logpdf(i, replace(old, sigma=factor * old.sigma)) - self._before[i]
        return self._density(i, t.scaled(factor)) - self._before[i]

    def _density(self, i: int, entry: dict[str, Any]) -> FloatArray:
        return self._logpdf(i, self._free[i].distribution(entry))

    def _logpdf(self, i: int, found: Distribution) -> FloatArray:
        return np.asarray(sum(found.logpdf(values) for values in self._values[i]))

    def _spread(self, i: int, factor: float) -> float:
        """Logarithm of the mean square of new over old density of one error."""
        old = self._old[i]
        if scaling.unbounded(old):  # 1 / (r sqrt(2 - r^2)) for r times the deviation, squared for a radius
            square = 2.0 - factor**2
            coordinates = 2 if isinstance(old, Rayleigh) else 1
            return -coordinates * math.log(factor * math.sqrt(square)) if square > 0 else math.inf
        new = self._free[i].distribution(self._free[i].scaled(factor))
        x = new.ppf((np.arange(1000) + 0.5) / 1000)
        return float(np.log(np.mean(np.exp(new.logpdf(x) - old.logpdf(x)))))


def _asked(
    store: ResultStore, study: Study, limits: Sequence[str], cost_file: Path | None, keep: Sequence[str]
) -> tuple[list[Statement], list[Tolerance], list[Cost]]:
    """Parsed limits, tolerances that may change, and the costs of these."""
    faults: list[Fault] = []
    statements: list[Statement] = []
    for text in limits:
        with gather(faults):
            statements.append(rule.parse(text, "", "--limit", EXAMPLE))
            lacking = [name for name in statements[-1].loads if not selected_results.holds(store.columns, name)]
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
    largest = np.max([view.load(results, name)[0] for name in said.loads], axis=0)
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
