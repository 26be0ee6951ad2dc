"""The cheapest tolerances with which a campaign keeps its limits, estimated from its own joints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import allocation, prediction, reweight
from tolstat.analysis.prediction import DELIVERY
from tolstat.analysis.reweight import Ratios
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.loads import ANY_LIMIT, unit_text
from tolstat.common.tables import Status
from tolstat.common.units import DISPLAY_UNITS
from tolstat.display import text
from tolstat.display.answer import Answer, Document, Part, Sentence, Table
from tolstat.display.blocks import Listing
from tolstat.display.options import Costs, Delivery, Opt
from tolstat.display.table import Column, Row, Rows
from tolstat.questions.allocate.ratios import DensityRatios, Entries
from tolstat.store import error_budget
from tolstat.store.view import View
from tolstat.study import axes, rule, scaling, selection
from tolstat.study import costs as prices
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
WITHHELD = ("estimate", "lower", "upper", "next_lower", "next_upper")
"""Keys of the table ``limits`` that are NaN where the weights of the joints are unreliable."""


def _width(row: Row, key: str) -> str:
    unit, factor = DISPLAY_UNITS.get(row["unit"], (row["unit"], 1.0))
    return scaling.marked(row["mark"], f"{factor * row[key]:.4g} {unit}".rstrip())


TOLERANCES = (
    Column("tolerance", lambda row: str(row["tolerance"])),
    Column("errors", lambda row: str(row["errors"]), rank=1),
    Column("before", lambda row: _width(row, "before")),
    Column("proposed", lambda row: _width(row, "proposed")),
    Column("factor", lambda row: f"{row['factor']:.3g}"),
    Column("cost before", lambda row: f"{row['cost_before']:.4g}"),
    Column("cost", lambda row: f"{row['cost']:.4g}"),
)
"""Columns of the table ``tolerances``."""
LIMITS = (
    Column("target", lambda row: row["limit"].replace("N*m", unit_text("N*m"))),
    Column("before", lambda row: text.percent(row["before"])),
    Column("proposed", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
    Column("ppm", lambda row: text.ppm(row["estimate"]), rank=2),
    Column("above in delivery", text.delivery, rank=3),
    Column("counts as joints", lambda row: text.formed(row["ess"], ".0f"), rank=1),
)
"""Columns of the table ``limits``."""


class _Request(NamedTuple):
    """What is asked for: statements to be kept; tolerances that may change, and their costs."""

    statements: list[Statement]
    tolerances: list[Tolerance]
    costs: list[Cost]

    @property
    def columns(self) -> list[str]:
        """Columns of the errors that the tolerances are for."""
        return [column for t in self.tolerances for name in t.names for column in axes.columns_of(name)]

    def cost(self, factors: NDArray[np.float64]) -> float:
        return sum(cost.at(float(f)) for cost, f in zip(self.costs, factors, strict=True))


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
    _check_joints(view)
    request = _read_request(view, targets, costs, keep or ())
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
    limits = _limits(view, request.statements, above, above[checked], ends, ratios, delivery)
    own = limits[: len(request.statements)]
    needed = ratios.effective * max(
        allocation.joints_needed(row["estimate"], row["ess"], row["target"], CONFIDENCE) for row in own
    )
    limits = [row if row["usable"] else row | dict.fromkeys(WITHHELD, np.nan) for row in limits]
    holds, verdict = _verdict(limits[: len(own)], ratios, needed)
    facts = {"holds": holds, "verdict": verdict, "aim": choice.aim, "effective": ratios.effective}
    facts |= {"joints_needed": needed, "entries": entries}
    return Answer("allocate", "Tolerances proposed", _parts(view, _tolerances(request, entries), limits, facts), facts)


def _parts(view: View, tolerances: Rows, limits: Rows, facts: Row) -> list[Part]:
    """Tables, the changed entries, and sentences."""
    entries = facts["entries"]
    parts: list[Part] = [
        Table("tolerances", "Tolerances and their costs", TOLERANCES, tolerances),
        Table(
            "limits",
            "Shares of the joints above the levels, before and as proposed",
            LIMITS,
            limits,
        ),
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
    return [*parts, Document(".toml", study)]


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


def _read_request(view: View, targets: Sequence[str], costs: Path | None, keep: Sequence[str]) -> _Request:
    """Read targets, costs and names, and report their faults together."""
    study = view.study
    faults: list[Fault] = []
    statements: list[Statement] = []
    for target in targets:
        with gather(faults):
            statements.append(rule.parse(target, "", "--target", EXAMPLE, view.limits))
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
    own_costs: list[Cost] = []
    with gather(faults):
        own_costs = prices.of(every, costs)
    if faults:
        raise InputError(faults)
    free = [
        (t, cost)
        for t, cost in zip(every, own_costs, strict=True)
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
        targets=np.array([statement.bound for statement in request.statements]),
        cost=request.cost,
        lower=reach[:, 0],
        upper=np.where([t.widens for t in request.tolerances], reach[:, 1], 1.0),
        iid=view.design.has_interval("reweighting"),
        confidence=SEARCH_CONFIDENCE,
    )
    return allocation.search(problem)


def _limits(
    view: View,
    statements: Sequence[Statement],
    above: NDArray[np.bool_],
    above_checked: NDArray[np.bool_],
    ends: Sequence[Sequence[NDArray[np.bool_]]],
    ratios: Ratios,
    delivery: int,
) -> list[dict[str, Any]]:
    """Rows of the table ``limits``.

    `above`, `above_checked` and `ends` tell which joints are above each limit: all of them, those of the check, and
    these with both ends of the numerical error.
    """
    rows = [
        _limit(view, (s.text, s.bound), above[:, i], [above_checked[:, i], *ends[i]], ratios, delivery)
        for i, s in enumerate(statements)
    ]
    if len(statements) > 1:
        worst = [np.any(parts, axis=0) for parts in zip(*ends, strict=True)] if all(ends) else []
        checked = [np.any(above_checked, axis=1), *worst]
        rows.append(_limit(view, (ANY_LIMIT, np.nan), np.any(above, axis=1), checked, ratios, delivery))
    return rows


def _limit(
    view: View,
    target: tuple[str, float],
    above: NDArray[np.bool_],
    checked: Sequence[NDArray[np.bool_]],
    ratios: Ratios,
    delivery: int,
) -> dict[str, Any]:
    """One row of the table ``limits``."""

    def shares(confidence: float) -> list[reweight.Share]:
        samples = [Sample.of(own, np.full(own.size, Status.OK), view.design) for own in checked]
        return [reweight.share_above(sample, ratios, 0.5, confidence) for sample in samples]

    def widest(shares: Sequence[reweight.Share]) -> tuple[float, float]:
        return min(share.lower for share in shares), max(share.upper for share in shares)

    found = shares(CONFIDENCE)
    row = {"limit": target[0], "target": target[1], "before": float(above.mean()), "estimate": found[0].estimate}
    row["lower"], row["upper"] = widest(found)
    following = prediction.of_share(*widest(shares(prediction.half(CONFIDENCE))), delivery, CONFIDENCE)
    row |= prediction.columns(following, delivery)
    return row | {"ess": found[0].ess, "usable": found[0].support.usable, "numerical": len(checked) > 1}


def _tolerances(request: _Request, entries: Entries) -> list[dict[str, Any]]:
    """Rows of the table ``tolerances``."""
    rows = []
    for t, cost in zip(request.tolerances, request.costs, strict=True):
        width = scaling.width(entries.get(t.pattern, t.entry), t.site)
        row = {"tolerance": t.pattern, "errors": len(t.names), "unit": t.site.unit, "mark": t.mark}
        row |= {"before": t.width, "proposed": width, "factor": width / t.width}
        rows.append(row | {"cost_before": cost.at(1.0), "cost": cost.at(width / t.width)})
    return rows
