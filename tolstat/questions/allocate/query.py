"""The cheapest tolerances with which a campaign keeps its limits, estimated from its own joints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat.analysis import allocation, prediction, reweight
from tolstat.analysis.design import Design
from tolstat.analysis.prediction import DELIVERY
from tolstat.analysis.reweight import Ratios
from tolstat.analysis.sample import Sample
from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.shown import shown
from tolstat.common.tables import Status
from tolstat.questions.allocate.ratios import DensityRatios, Entries
from tolstat.store import error_budget
from tolstat.store.view import View
from tolstat.study import Study, axes, costs, rule, scaling, selection
from tolstat.study.costs import Cost
from tolstat.study.rule import Statement
from tolstat.study.scaling import Tolerance
from tolstat.study.tolerances.density_ratio import Exact

EXAMPLE = 'write --target "P(cross1.F > 700 N) < 0.001"'
DIGITS = 3
"""Significant digits of the tolerances proposed."""
SEARCH_CONFIDENCE = 0.999
"""Confidence level of the search: higher than the 0.95 of the final check, so that the check mostly confirms it."""
MAX_SEARCHED = 50_000
"""Maximum number of joints used in the search; all others are used in the final check."""
MIN_CHANGE = 5e-3
"""Smallest relative change of a tolerance that is proposed."""


@shown
class Allocation(NamedTuple):
    """Tolerances proposed for a study.

    Attributes
    ----------
    study : Study
        The study as it is.
    tolerances : DataFrame
        One row per tolerance that may change: ``tolerance`` (pattern), ``errors`` (how many), ``unit``, ``mark`` (what
        widths are: ``±`` half the band, ``⌀`` or ``wide`` size of the zone), ``before`` and ``proposed`` (widths, SI),
        ``factor``, ``cost_before``, ``cost``.
    limits : DataFrame
        One row per limit, and `ANY_LIMIT` for a joint above any of several (its target is NaN), from joints that the
        search did not use: ``limit``, ``target``, ``before`` (share of all joints as drawn), ``estimate``, ``lower``,
        ``upper`` (with the numerical error near the limit where ``numerical``, that is, where it is known),
        ``next_lower``, ``next_upper`` (prediction interval for the joints above in the next delivery), ``ess``,
        ``usable``. Numbers are NaN if not ``usable``.
    entries : dict
        Keys of the changed entries of ``[tolerances]`` by pattern.
    ratios : Ratios
        Density ratios of the joints of the final check.
    aim : str
        See `analysis.allocation.Choice`.
    joints_needed : float
        Number of joints of the proposed study that would show that it holds; inf if it is not expected to hold.
    """

    study: Study
    tolerances: pd.DataFrame
    limits: pd.DataFrame
    entries: Entries
    ratios: Ratios
    aim: str
    joints_needed: float

    @property
    def holds(self) -> bool:
        """Whether the final check confirms the proposal: usable shares, and all upper ends below the targets."""
        own = self.limits[self.limits["target"].notna()]
        return bool((own["usable"] & (own["upper"] < own["target"])).all())

    @property
    def verdict(self) -> str:
        """Sentence on whether the proposal holds, or why it needs new runs."""
        figures = f"{len(self.ratios.values)} joints in the check count as {self.ratios.effective:.0f}"
        if self.holds:
            return f"holds: the upper ends of the intervals are below the targets ({figures})"
        own = self.limits[self.limits["target"].notna()]
        if not own["usable"].all():
            return f"needs new runs: the weights of the joints are unreliable ({figures})"
        if (own["estimate"] < own["target"]).all():
            joints = f"about {self.joints_needed:.0f} joints of the proposed study would show it"
            return f"needs new runs: expected to hold, {joints} ({figures})"
        return f"needs new runs: a step towards the targets; run the proposed study and allocate again ({figures})"

    @property
    def text(self) -> str:
        """The study with the proposal, TOML, with another seed: a check must not use the joints of the search."""
        return scaling.rewritten(self.study, self.entries, self.study.sampling.seed + 1)


class _Request(NamedTuple):
    """What is asked for: statements to be kept; tolerances that may change, and their costs."""

    statements: list[Statement]
    tolerances: list[Tolerance]
    costs: list[Cost]

    @property
    def targets(self) -> NDArray[np.float64]:
        return np.array([statement.bound for statement in self.statements])

    @property
    def columns(self) -> list[str]:
        """Columns of the errors that the tolerances are for."""
        return [column for t in self.tolerances for name in t.names for column in axes.columns_of(name)]

    def cost(self, factors: NDArray[np.float64]) -> float:
        return sum(cost.at(float(f)) for cost, f in zip(self.costs, factors, strict=True))


def allocated(
    view: View,
    limits: Sequence[str],
    cost_file: Path | None = None,
    keep: Sequence[str] = (),
    confidence: float = 0.95,
    delivery: int = DELIVERY,
) -> Allocation:
    """Propose the cheapest tolerances that keep the limits.

    Parameters
    ----------
    view : View
        A campaign of joints drawn from tolerances.
    limits : sequence of str
        ``"P(cross*.F > 700 N) < 0.001"``: share of the joints with any of these loads above the level. Joints without a
        valid load count as above.
    cost_file : Path, optional
        See `study.costs.of`.
    keep : sequence of str
        Names or patterns of errors whose tolerances stay as they are.
    confidence : float
        Confidence level of the intervals.
    delivery : int
        Number of joints of the next delivery.

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
    ...     found = tolstat.allocated(store.view(), ["P(cross1.F > 700 N) < 0.08"])
    >>> found.tolerances.set_index("tolerance")["factor"].round(1).to_dict()
    {'pin4.tilt_t': 1.0, 'pin[12].offset_t': 0.8}
    """
    _check_joints(view)
    request = _read_request(view, limits, cost_file, keep)
    done = np.flatnonzero(view.status != Status.PENDING)
    above = np.column_stack([_above(view, statement) for statement in request.statements])[done]
    searched, checked = allocation.halves(view.design.units(view.n)[done], MAX_SEARCHED)
    if len(checked) < 4 * reweight.LEAST_ESS:
        found = f"has {len(done)} joints simulated"
        raise StoreError(str(Fault(str(view.path), found, f"run {8 * reweight.LEAST_ESS} joints or more")))
    choice = _search(view, request, above[searched], done[searched])
    entries = {
        t.pattern: t.scaled(float(f), DIGITS)
        for t, f in zip(request.tolerances, choice.factors, strict=True)
        if abs(f - 1) > MIN_CHANGE
    }
    ratios = _check_ratios(view, request, entries, done[checked])
    ends = [_ends_above(view, statement, done[checked]) for statement in request.statements]
    table = _limits(request.statements, above, above[checked], ends, ratios, view.design, confidence, delivery)
    growth = [
        allocation.joints_needed(share, ess, target, confidence)
        for share, ess, target in table[["estimate", "ess", "target"]].to_numpy(float)[: len(request.statements)]
    ]
    needed = max(growth) * ratios.effective
    table.loc[~table["usable"], ["estimate", "lower", "upper", "next_lower", "next_upper"]] = np.nan
    return Allocation(view.study, _tolerances(request, entries), table, entries, ratios, choice.aim, needed)


def _check_ratios(view: View, request: _Request, entries: Entries, samples: NDArray[np.intp]) -> Ratios:
    """Density ratios of the joints of the check, for changed entries."""
    logs = []
    for errors in view.error_blocks(request.columns):
        block = DensityRatios(view.study, request.tolerances, errors)
        logs.append(block.of_entries(entries))
    return _ratios(np.concatenate(logs)[samples], block.exact_of_entries(entries))


def _ratios(logs: NDArray[np.float64], exact: Exact) -> Ratios:
    return Ratios(np.exp(logs), exact.mean_square, exact.unbounded, float(np.exp(exact.largest)))


def _check_joints(view: View) -> None:
    """Refuse joints that are not drawn from tolerances, all with the same weight and independently of each other."""
    view.check_drawn()
    view.check("mean")
    if view.study.groups:
        remedy = 'give the file of a study with sampling.method = "random"'
        found = "holds joints that share errors with others, so that one half of them is no check of the other"
        raise StoreError(str(Fault(str(view.path), found, remedy)))


def _read_request(view: View, limits: Sequence[str], cost_file: Path | None, keep: Sequence[str]) -> _Request:
    """Read limits, costs and names, and report their faults together."""
    study = view.study
    faults: list[Fault] = []
    statements: list[Statement] = []
    for text in limits:
        with gather(faults):
            statements.append(rule.parse(text, "", "--target", EXAMPLE, view.limits))
            lacking = [name for name in statements[-1].limit.loads if not selected_results.holds(view.columns, name)]
            if lacking:
                kept = f"give one of: {', '.join(view.kept_loads)}"
                faults.append(Fault("--target", f"the file does not keep {', '.join(lacking)}", kept))
    kept_names: set[str] = set()
    for pattern in keep:
        names = selection.select(pattern, study.tolerances)
        if not names:
            faults.append(Fault("--keep", f"{pattern!r} selects no error that the study scatters", "see [tolerances]"))
        kept_names |= set(names)
    every = scaling.tolerances(study)
    prices: list[Cost] = []
    with gather(faults):
        prices = costs.of(every, cost_file)
    if faults:
        raise InputError(faults)
    free = [
        (t, cost)
        for t, cost in zip(every, prices, strict=True)
        if not kept_names & set(t.names) and cost.reach[0] < cost.reach[1]
    ]
    if not free:
        remedy = "name some in --costs, or leave --keep out; measured, lognormal and correlated errors stay as they are"
        raise InputError([Fault("--costs", "leaves no tolerance that may change", remedy)])
    return _Request(statements, [t for t, _ in free], [cost for _, cost in free])


def _above(view: View, statement: Statement) -> NDArray[np.bool_]:
    """Which joints are above the level in any load of a statement, or have no valid load, (n,)."""
    load = view.load_of(statement.limit)
    return np.asarray(~load.is_valid | (load.values > statement.limit.level))


def _ends_above(view: View, statement: Statement, samples: NDArray[np.intp]) -> list[NDArray[np.bool_]]:
    """As `_above` with both ends of the numerical error near the limit, for some samples; empty if it is not known."""
    ends = error_budget.near(view, view.load_of(statement.limit)) or ()
    return [(~load.is_valid | (load.values > statement.limit.level))[samples] for load in ends]


def _search(view: View, request: _Request, above: NDArray[np.bool_], samples: NDArray[np.intp]) -> allocation.Choice:
    """Choose the factors by some of the samples; `above` tells which of these are above each limit."""
    ratios = DensityRatios(view.study, request.tolerances, view.errors(samples, request.columns))
    reach = np.array([cost.reach for cost in request.costs])
    problem = allocation.Problem(
        log_ratios=ratios.log_ratios,
        log_spread=ratios.log_mean_square,
        usable=lambda factors: _ratios(ratios.log_ratios(factors), ratios.exact(factors)).usable,
        above=above,
        targets=request.targets,
        cost=request.cost,
        lower=reach[:, 0],
        upper=np.where([t.widens for t in request.tolerances], reach[:, 1], 1.0),
        iid=view.design.has_interval("reweighting"),
        confidence=SEARCH_CONFIDENCE,
    )
    return allocation.search(problem)


def _limits(
    statements: Sequence[Statement],
    above: NDArray[np.bool_],
    above_checked: NDArray[np.bool_],
    ends: Sequence[Sequence[NDArray[np.bool_]]],
    ratios: Ratios,
    design: Design,
    confidence: float,
    delivery: int,
) -> pd.DataFrame:
    """Table `Allocation.limits`.

    `above`, `above_checked` and `ends` tell which joints are above each limit: all of them, those of the check, and
    these with both ends of the numerical error.
    """

    def share(own: NDArray[np.bool_], confidence: float) -> reweight.Share:
        return reweight.share_above(Sample.of(own, np.full(own.size, Status.OK), design), ratios, 0.5, confidence)

    columns: list[tuple[str, float, Any, list[Any], bool]] = [
        (s.text, s.bound, above[:, i], [above_checked[:, i], *ends[i]], bool(ends[i])) for i, s in enumerate(statements)
    ]
    if len(statements) > 1:
        known = all(ends)
        worst = [np.any(parts, axis=0) for parts in zip(*ends, strict=True)] if known else []
        columns.append((ANY_LIMIT, np.nan, np.any(above, 1), [np.any(above_checked, 1), *worst], known))
    rows = []
    for name, target, own, checked, known in columns:
        found = [share(one, confidence) for one in checked]
        wide = [share(one, prediction.half(confidence)) for one in checked]
        row = {"limit": name, "target": target, "before": float(own.mean()), "estimate": found[0].estimate}
        row |= {"lower": min(one.lower for one in found), "upper": max(one.upper for one in found)}
        least, most = min(one.lower for one in wide), max(one.upper for one in wide)
        following = prediction.of_share(least, most, delivery, confidence)
        row |= prediction.columns(following, delivery)
        rows.append(row | {"ess": found[0].ess, "usable": found[0].support.usable, "numerical": known})
    return pd.DataFrame(rows)


def _tolerances(request: _Request, entries: Entries) -> pd.DataFrame:
    """Table `Allocation.tolerances`."""
    rows = []
    for t, cost in zip(request.tolerances, request.costs, strict=True):
        width = scaling.width(entries.get(t.pattern, t.entry), t.site)
        factor = width / t.width
        row = {
            "tolerance": t.pattern,
            "errors": len(t.names),
            "unit": t.site.unit,
            "mark": t.mark,
            "before": t.width,
            "proposed": width,
        }
        rows.append({**row, "factor": factor, "cost_before": cost.at(1.0), "cost": cost.at(factor)})
    return pd.DataFrame(rows)
