"""The cheapest tolerances with which a campaign keeps its limits, estimated from its own joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from shlex import quote
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import allocation, reweight
from tolstat.analysis.prediction import DELIVERY
from tolstat.analysis.reweight import Ratios
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.campaign import stop_rule
from tolstat.campaign.stop_rule import Statement
from tolstat.common.columns import holds
from tolstat.common.errors import Fault, InputError, gather, raise_all
from tolstat.common.loads import ANY_LIMIT, FloatArray, split, unit_text
from tolstat.common.tables import Status
from tolstat.common.units import DISPLAY_UNITS
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Document, Listing, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Costs, Delivery, Opt
from tolstat.questions import shares
from tolstat.store import error_budget
from tolstat.store.view import View
from tolstat.study import Study, axes, scaling, selection
from tolstat.study import costs as prices
from tolstat.study.costs import Cost
from tolstat.study.scaling import Tolerance
from tolstat.study.tolerances.density_ratio import Exact, exact, log_ratios, of_error
from tolstat.study.tolerances.distributions import Distribution, Normal
from tolstat.study.tolerances.zone_laws import Rayleigh

EXAMPLE = 'write --target "P(cross1.F > 700 N) < 0.001"'
DIGITS = 3
"""Significant digits of the tolerances proposed."""
SEARCH_CONFIDENCE = 0.999
"""Confidence level of the search: higher than the 0.95 of the final check, so that the check mostly confirms it."""
MAX_SEARCHED = 50_000
"""Maximum number of joints used in the search; all others are used in the final check."""
MIN_CHANGE = 5e-3
"""Smallest relative change of a tolerance that is proposed."""
WITHHELD = ("estimate", "lower", "upper", "next_lower", "next_upper")
"""Keys of the table ``limits`` that are NaN where the weights of the joints are unreliable."""


def _width(row: Row, key: str) -> str:
    unit, factor = DISPLAY_UNITS.get(row["unit"], (row["unit"], 1.0))
    return scaling.marked(row["mark"], f"{factor * row[key]:.4g} {unit}".rstrip())


TOLERANCES = (
    Column("tolerance", shares.word("tolerance")),
    Column("errors", shares.word("errors"), rank=1),
    Column("before", lambda row: _width(row, "before")),
    Column("proposed", lambda row: _width(row, "proposed")),
    Column("factor", lambda row: f"{row['factor']:.3g}"),
    Column("cost before", lambda row: f"{row['cost_before']:.4g}"),
    Column("cost", lambda row: f"{row['cost']:.4g}"),
)
"""Columns of the table ``tolerances``."""
LIMITS = (
    Column("target", lambda row: row["limit"].replace("N*m", unit_text("N*m"))),
    Column("before", shares.share("before")),
    Column("proposed", shares.share("estimate")),
    Column("95 % interval", shares.shares("lower", "upper")),
    Column("ppm", lambda row: text.ppm(row["estimate"]), rank=2),
    Column("above in delivery", text.delivery, rank=3),
    Column("counts as joints", lambda row: f"{row['ess']:.0f}" if row["usable"] else "-", rank=1),
)
"""Columns of the table ``limits``."""


Entries = dict[str, dict[str, Any]]
"""Keys of entries of ``[tolerances]`` by pattern."""
_Judged = tuple[str, float, Sequence[NDArray[np.bool_]]]
"""A statement or `ANY_LIMIT`, its target, and which joints are above, see `_above`."""


class _Request(NamedTuple):
    """What is asked for: statements to be kept; tolerances that may change, and their costs."""

    statements: list[Statement]
    tolerances: list[Tolerance]
    costs: list[Cost]

    @property
    def columns(self) -> list[str]:
        """Columns of the errors that the tolerances are for."""
        return [column for t in self.tolerances for name in t.names for column in axes.columns_of(name)]


def allocate(
    view: View,
    targets: Annotated[list[str], Opt("RULE", name="target")],
    costs: Costs = None,
    keep: Annotated[list[str] | None, Opt("PATTERN")] = None,
    delivery: Delivery = DELIVERY,
) -> Answer:
    """Propose the cheapest tolerances that meet the targets.

    Each entry of [tolerances] is multiplied by one factor. One half of the joints in FILE, reweighted to other
    tolerances, selects the factors; the other half checks them. A joint without a valid load counts as above the level.

    Gives factor and cost of each tolerance, the share of joints above each level with its 95 % interval, the changed
    entries as TOML, and a verdict: "holds", or "needs new runs" if the joints in FILE do not suffice. With --out DIR,
    writes also a study with the proposed tolerances and another seed, STEM_allocate.toml, to be run next.

    Example: tolstat allocate iso2768_f.h5 --target "P(any limit) < 0.1"

    Parameters
    ----------
    view : View
        A campaign of joints drawn from tolerances.
    targets : list of str
        Largest share of joints above a level: "P(cross*.F > 700 N) < 0.001"; repeatable.
    costs : Path, optional
        Cost of each tolerance, TOML or CSV (see tolstat docs allocate); default: cost inversely proportional to the
        tolerance.
    keep : list of str, optional
        Errors whose tolerances do not change, such as "pin*.diameter"; repeatable; default: none.
    delivery : int
        Number of joints of the next delivery, for the prediction interval of those above a limit.

    Returns
    -------
    Answer
        Table ``tolerances``, one row per tolerance that may change: ``tolerance`` (pattern), ``errors`` (how many),
        ``unit``, ``mark`` (what widths are: ``±`` half the band, ``⌀`` or ``wide`` size of the zone), ``before`` and
        ``proposed`` (widths, SI), ``factor``, ``cost_before``, ``cost``. Those of the operating point, the material,
        measured parts and correlated errors are not changed.

        Table ``limits``, one row per target, and `ANY_LIMIT` for a joint above any of several (its target is NaN),
        from joints that the search did not use: ``limit``, ``target``, ``before`` (share of all joints as drawn),
        ``estimate``, ``lower``, ``upper`` (with the numerical error near the limit where ``numerical``, that is, where
        it is known), ``next_lower``, ``next_upper`` (prediction interval for the joints above in the next delivery),
        ``ess``, ``usable``. Numbers are NaN if not ``usable``.

        Facts: ``holds`` (the check confirms the proposal), ``verdict``, ``aim`` (see `analysis.allocation.Choice`),
        ``effective`` (joints that those of the check count as), ``joints_needed`` (joints of the proposed study that
        would show that it holds; inf if it is not expected to), ``entries`` (keys of the changed entries by pattern).

    Raises
    ------
    InputError
        With every fault of limits, costs and names.
    StoreError
        When the file's joints are not drawn from tolerances, are drawn in groups, or are too few.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     answer = tolstat.allocate(store.view(), ["P(cross1.F > 700 N) < 0.08"])
    >>> {row["tolerance"]: round(row["factor"], 1) for row in answer.tables["tolerances"].rows}
    {'pin4.tilt_t': 1.0, 'pin[12].offset_t': 0.8}
    """
    view.check_drawn()
    view.check("mean")
    if view.study.groups:
        remedy = 'give the file of a study with sampling.method = "random"'
        reason = "holds joints that share errors with others, so that one half of them is no check of the other"
        raise shares.unusable(view, reason, remedy)
    request = _read_request(view, targets, costs, keep or ())
    done = np.flatnonzero(view.status != Status.PENDING)
    events = [_above(view, statement, done) for statement in request.statements]
    searched, checked = allocation.halves(view.design.units(view.n)[done], MAX_SEARCHED)
    if len(checked) < 4 * reweight.LEAST_ESS:
        remedy = f"run {8 * reweight.LEAST_ESS} joints or more"
        raise shares.unusable(view, f"has {len(done)} joints simulated", remedy)
    choice = _search(view, request, np.column_stack([event[0][searched] for event in events]), done[searched])
    entries = {
        t.pattern: t.scaled(float(f), DIGITS)
        for t, f in zip(request.tolerances, choice.factors, strict=True)
        if abs(f - 1) > MIN_CHANGE
    }
    study, changed = (
        view.study,
        [(t, t.distribution(entries[t.pattern])) for t in request.tolerances if t.pattern in entries],
    )
    new = {name: law for t, law in changed for name in t.names}
    logs = [
        log_ratios(new, study.tolerances, study.copula, partial(sampling.values, study, errors), len(errors))
        for errors in view.error_blocks(request.columns)
    ]
    exact_ratio = exact((law, study.tolerances[name]) for name, law in new.items())
    ratios = _ratios(np.concatenate(logs)[done[checked]], exact_ratio)
    judged: list[_Judged] = [(s.text, s.bound, event) for s, event in zip(request.statements, events, strict=True)]
    if len(events) > 1:  # with both ends of the numerical error where it is known of all
        judged.append((ANY_LIMIT, np.nan, [np.any(ends, axis=0) for ends in zip(*events, strict=False)]))
    limits = [_limit(view, statement, checked, ratios, delivery) for statement in judged]
    figures = [(row["estimate"], row["ess"], row["target"]) for row in limits[: len(events)]]
    needed = ratios.effective * max(allocation.joints_needed(*figure, CONFIDENCE) for figure in figures)
    limits = [row if row["usable"] else row | dict.fromkeys(WITHHELD, np.nan) for row in limits]
    holds, verdict = _verdict(limits[: len(events)], ratios, needed)
    facts = {"holds": holds, "verdict": verdict, "aim": choice.aim, "effective": ratios.effective}
    facts |= {"joints_needed": needed, "entries": entries}
    return Answer("allocate", "Tolerances proposed", _parts(view, _tolerances(request, entries), limits, facts), facts)


class DensityRatios:
    """Logarithms of new over old density of joints; terms of the factors used last are kept.

    Parameters
    ----------
    study : Study
        Study that the joints were drawn for.
    tolerances : sequence of Tolerance
        Tolerances that the factors scale.
    errors : ndarray, shape (n,)
        Errors of the joints, a table with the columns that the tolerances are for.
    """

    def __init__(self, study: Study, tolerances: Sequence[Tolerance], errors: NDArray[np.void]) -> None:
        self._tolerances = tolerances
        self._values = [[sampling.values(study, errors, name) for name in t.names] for t in tolerances]
        self._old = [t.distribution(t.entry) for t in tolerances]
        self._old_density = [self._log_density(i, old) for i, old in enumerate(self._old)]
        keep = lru_cache(maxsize=4 * len(tolerances))
        self._log_ratio = keep(lambda i, f: self._log_density(i, self._scaled(i, f)) - self._old_density[i])
        self._exact = keep(lambda i, f: of_error(self._scaled(i, f), self._old[i]))

    def log_ratios(self, factors: FloatArray) -> FloatArray:
        """Logarithms of the ratios for tolerances scaled by factors, (n,)."""
        return np.asarray(sum(self._log_ratio(i, float(f)) for i, f in enumerate(factors)))

    def exact(self, factors: FloatArray) -> Exact:
        """Exact numbers of the ratio for tolerances scaled by factors; a tolerance may have several errors."""
        each = [self._exact(i, float(f)) for i, f in enumerate(factors)]
        terms = [len(t.names) * np.array(exact) for t, exact in zip(self._tolerances, each, strict=True)]
        return Exact(*np.sum(terms, axis=0).tolist())

    def _scaled(self, i: int, factor: float) -> Distribution:
        old, t = self._old[i], self._tolerances[i]
        # as the scaled entry gives it, but without parsing
        if isinstance(old, Normal):
            mean = old.mean if t.fixed is None else t.fixed + factor * (old.mean - t.fixed)
            return replace(old, mean=mean, sigma=factor * old.sigma)
        if isinstance(old, Rayleigh) and old.upper is None:
            return replace(old, sigma=factor * old.sigma)
        return t.distribution(t.scaled(factor))

    def _log_density(self, i: int, distribution: Distribution) -> FloatArray:
        return np.asarray(sum(distribution.logpdf(values) for values in self._values[i]))


def _parts(view: View, tolerances: Rows, limits: Rows, facts: Row) -> list[Part]:
    """Tables, the changed entries, and sentences."""
    entries = facts["entries"]
    parts: list[Part] = [
        Table("tolerances", "Tolerances and their costs", TOLERANCES, tolerances),
        Table("limits", "Shares of the joints above the levels, before and as proposed", LIMITS, limits),
    ]
    if entries:
        parts.append(Listing("[tolerances]", "\n".join(scaling.line(*item) for item in entries.items())))
    before, after = (sum(row[key] for row in tolerances) for key in ("cost_before", "cost"))
    parts.append(Sentence(f"total cost {before:.4g} -> {after:.4g} ({100 * (after / before - 1):+.1f} %)"))
    parts.append(Sentence(facts["verdict"]))
    if not all(row["numerical"] for row in limits):
        parts.append(Sentence(error_budget.command(view.path)))
    parts.append(Sentence(f"next, with --out DIR: tolstat run {quote(f'DIR/{view.path.stem}_allocate.toml')}"))
    # with another seed: a check must not use the joints of the search
    study = scaling.rewritten(view.study, entries, view.study.sampling.seed + 1)
    return [*parts, Document(".toml", lambda _: study)]


def _verdict(limits: Rows, ratios: Ratios, needed: float) -> tuple[bool, str]:
    """Whether the final check confirms the proposal, and a sentence on it, or on why it needs new runs."""
    figures = f"{ratios.values.size} joints in the check count as {ratios.effective:.0f}"
    usable = all(row["usable"] for row in limits)
    if usable and all(row["upper"] < row["target"] for row in limits):
        return True, f"holds: the upper ends of the intervals are below the targets ({figures})"
    if not usable:
        return False, f"needs new runs: the weights of the joints are unreliable ({figures})"
    if all(row["estimate"] < row["target"] for row in limits):
        joints = f"about {needed:.0f} joints of the proposed study would show it"
        return False, f"needs new runs: expected to hold, {joints} ({figures})"
    step = "a step towards the targets; run the proposed study and allocate again"
    return False, f"needs new runs: {step} ({figures})"


def _ratios(logs: NDArray[np.float64], exact: Exact) -> Ratios:
    return Ratios(np.exp(logs), exact.mean_square, exact.unbounded, float(np.exp(exact.largest)))


def _read_request(view: View, targets: Sequence[str], costs: Path | None, keep: Sequence[str]) -> _Request:
    """Read targets, costs and names, and report their faults together."""
    study = view.study
    faults: list[Fault] = []
    statements: list[Statement] = []
    for target in targets:
        with gather(faults):
            statements.append(stop_rule.parse(target, view.limits, "", "--target", EXAMPLE))
            loads = statements[-1].limit.loads
            lacking = [name for name in loads if not holds(view.columns, split(name)[0])]
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
    each: list[Cost] = []
    with gather(faults):
        each = prices.of(every, costs)
    raise_all(faults)
    pairs = zip(every, each, strict=True)
    free = [(t, cost) for t, cost in pairs if cost.reach[0] < cost.reach[1] and not kept_names & set(t.names)]
    if not free:
        remedy = "name some in --costs, or leave --keep out; measured, lognormal and correlated errors stay as they are"
        raise InputError([Fault("--costs", "leaves no tolerance that may change", remedy)])
    return _Request(statements, [t for t, _ in free], [cost for _, cost in free])


def _above(view: View, statement: Statement, done: NDArray[np.intp]) -> list[NDArray[np.bool_]]:
    """Which joints are above the level in any load of a statement, or have no valid load, (n,).

    Where the numerical error near the limit is known, also with both of its ends.
    """
    load, level = view.load_of(statement.limit), statement.limit.level
    loads = (load, *(error_budget.near(view, load) or ()))
    return [(~end.is_valid | (end.values > level))[done] for end in loads]


def _search(view: View, request: _Request, above: NDArray[np.bool_], samples: NDArray[np.intp]) -> allocation.Choice:
    """Choose the factors by some of the samples; `above` tells which of these are above each limit."""
    ratios = DensityRatios(view.study, request.tolerances, view.errors(samples, request.columns))
    reach = np.array([cost.reach for cost in request.costs])
    problem = allocation.Problem(
        log_ratios=ratios.log_ratios,
        log_spread=lambda factors: ratios.exact(factors).mean_square,
        usable=lambda factors: _ratios(ratios.log_ratios(factors), ratios.exact(factors)).usable,
        above=above,
        targets=np.array([statement.bound for statement in request.statements]),
        cost=lambda factors: sum(cost.at(float(f)) for cost, f in zip(request.costs, factors, strict=True)),
        lower=reach[:, 0],
        upper=np.where([t.widens for t in request.tolerances], reach[:, 1], 1.0),
        iid=view.design.has_interval("reweighting"),
        confidence=SEARCH_CONFIDENCE,
    )
    return allocation.search(problem)


def _limit(view: View, judged: _Judged, checked: NDArray[np.intp], ratios: Ratios, delivery: int) -> dict[str, Any]:
    """One row of the table ``limits``; `checked` are the joints of the check."""
    name, target, above = judged
    samples = [Sample.of(end[checked], np.full(checked.size, Status.OK), view.design) for end in above]
    share, (lower, upper), predicted = shares.reweighted(samples, ratios, 0.5, delivery)
    row = {"limit": name, "target": target, "before": float(above[0].mean()), "estimate": share.estimate}
    row |= {"lower": lower, "upper": upper} | predicted
    return row | {"ess": share.support.ess, "usable": share.support.usable, "numerical": len(above) > 1}


def _tolerances(request: _Request, entries: Entries) -> list[dict[str, Any]]:
    """Rows of the table ``tolerances``."""
    rows = []
    for t, cost in zip(request.tolerances, request.costs, strict=True):
        width = scaling.width(entries.get(t.pattern, t.entry), t.site)
        row = {"tolerance": t.pattern, "errors": len(t.names), "unit": t.site.unit, "mark": t.mark}
        row |= {"before": t.width, "proposed": width, "factor": width / t.width}
        rows.append(row | {"cost_before": cost.at(1.0), "cost": cost.at(width / t.width)})
    return rows
