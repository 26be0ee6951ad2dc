"""Drive shafts of two joints: which share of them exceeds a limit, and how evenly their output turns."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import binomial
from tolstat.analysis.design import Independent
from tolstat.analysis.sensitivity import FEWEST, MOST, first_order
from tolstat.common.load_kinds import ORDERS
from tolstat.common.loads import ANY_LIMIT
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Part, Row, Rows, Sentence, Table
from tolstat.joint import nominal_errors, perturb
from tolstat.joint.orders import output_motion
from tolstat.questions.shares import inapplicable, limit, share, shares, unusable, word
from tolstat.store.recorded import joint_of
from tolstat.store.view import View

QUANTILES = (0.5, 0.95)
"""Shares of the shafts below whose values the unevenness of the output is given."""

LIMITS = (
    Column("load", word("load")),
    Column("limit", limit),
    Column("first joint", share("first"), rank=2),
    Column("second joint", share("second"), rank=1),
    Column("shafts above", lambda row: f"{row['count']} of {row['n']}"),
    Column("share", share("estimate")),
    Column("95 % interval", shares("lower", "upper")),
)
"""Columns of the table ``shafts``."""
CAUSES = (
    Column("line of the drawing", word("line"), words=True),
    Column("as first joint", share("first"), rank=2),
    Column("as second", share("second"), rank=1),
    Column("both", share("estimate")),
    Column("95 % interval", shares("lower", "upper")),
)
"""Columns of the table ``causes``."""
OUTPUT = (
    Column("output", lambda row: str(row["quantity"])),
    Column("ideal joints", lambda row: _value(row, "ideal")),
    Column("50 % below", lambda row: _value(row, "at_most_50")),
    Column("95 % below", lambda row: _value(row, "at_most_95")),
)
"""Columns of the table ``output``."""


class Shafts(NamedTuple):
    """The joints at both places of a drive shaft: joint i first and joint i + 1 second, the last with joint 0."""

    first: View
    second: View

    def sum_of(self, name: str) -> NDArray[np.float64]:
        """Sum of a load of both joints, of the shafts with two valid joints."""
        total = self.first.load(name).values + np.roll(self.second.load(name).values, -1)
        return total[~np.isnan(total)]


def shafts(view: View) -> Answer:
    """Estimate which share of drive shafts exceeds limits.

    The study has two operating points for the joints of one drawing: the first joint of a drive shaft, with a partner
    after it, and the second one, with a partner before it. A shaft is made of joint i as the first and joint i + 1 as
    the second. Gives the share of shafts in which either joint exceeds a limit, and how unevenly the output turns.

    Example: tolstat shafts drive_shaft.h5

    Parameters
    ----------
    view : View
        A campaign at the operating points of both joints.

    Returns
    -------
    Answer
        Table ``shafts``, one row per limit and one for all of them: ``load``, ``unit``, ``limit`` (of the first joint,
        where it has one), ``first`` and ``second`` (share of the joints above it there), ``n``, ``count``,
        ``estimate``, ``lower``, ``upper`` (95 %, shafts without a valid load counted both ways). A joint is in two
        shafts: the interval counts n shafts as n/2 independent ones, which it is too wide for by at most 41 %. Table
        ``causes``, see `_causes`, where the file has `FEWEST` joints and more, none of them correlated. Table
        ``output``: ``quantity``, ``unit``, ``ideal`` (two ideal joints), ``at_most_50`` and ``at_most_95`` (upper
        bounds for shares of the shafts, from the speed errors of both joints): unevenness (largest less smallest
        speed, relative to its mean) and largest angular acceleration.

    Raises
    ------
    NotApplicable
        When the study has no drive shaft.
    StoreError
        When the joints are no sample of a production.
    """
    pair = _places(view)
    view.check()
    parts: list[Part] = []
    if names := list(dict.fromkeys((*pair.first.limits, *pair.second.limits))):
        rows = [_limit(pair, name) for name in (*names, ANY_LIMIT)]
        parts.append(Table("shafts", "Drive shafts with a joint above a limit", LIMITS, rows))
        if causes := _causes(pair):
            title = "Shafts with a joint above any limit: share of the variance that each line causes by itself"
            parts.append(Table("causes", title, CAUSES, causes))
            parts.append(Sentence("lines by themselves, corrected for chance; the rest is by errors that act together"))
    parts.append(Table("output", "How unevenly the output of the shaft turns", OUTPUT, _output(pair)))
    errors = pair.sum_of("psi")
    speed_error = float(np.quantile(errors, QUANTILES[-1])) if errors.size else np.nan
    partner = pair.first.store.operation.partner
    torsion = partner.torsion(pair.first.store.operation.speed, 2) if partner else np.nan
    change = "not known without partner.stiffness" if np.isnan(torsion) else text.percent(torsion)
    parts += [
        Sentence("a shaft: joint i first, joint i + 1 second; intervals count n shafts as n/2 independent ones"),
        Sentence(
            "each joint sees the other as ideal: speed errors Psi of both together, "
            f"{text.percent(speed_error)} at 95 % of the shafts, are left out of the loads"
        ),
        Sentence(f"torsion of the intermediate shaft is left out: change of order 2 by it {change}"),
        Sentence("the intermediate shaft carries output.* of the first and input.* of the second joint, not their sum"),
    ]
    return Answer("shafts", "The drive shaft", parts)


def _places(view: View) -> Shafts:
    """The views of the first and of the second joint."""
    joints = [(partner.position, part) for part in view.parts if (partner := part.store.operation.partner)]
    at = dict(joints)
    if len(joints) > len(at) == 2:
        remedy = "give those of one shaft: --point FIRST+SECOND"
        raise unusable(view, f"has {len(joints)} operating points with a partner", remedy)
    if len(at) < 2 or not view.sampled:
        remedy = 'give the file of a study with two operating points, with partner.position "after" and "before"'
        if view.mechanism.is_shaft:
            remedy = f"its rows are shafts: tolstat report {view.store.path}"
        raise inapplicable(view, "holds no two joints that stand for a drive shaft", remedy)
    return Shafts(at["after"], at["before"])


def _limit(pair: Shafts, name: str) -> Row:
    """Row of the table ``shafts`` for a limit: shafts with a joint surely above it, and with one that may be."""
    loads = {
        place: view.load(name) for place, view in pair._asdict().items() if name == ANY_LIMIT or name in view.limits
    }
    sure, possible, known = [], [], []
    row: dict[str, Any] = dict.fromkeys(("load", "unit", "limit", "first", "second"), np.nan)
    for place, load in loads.items():
        level, shift = load.limit or 0.0, -1 if place == "second" else 0
        sure.append(np.roll(load.lower.values > level, shift))
        possible.append(np.roll(load.upper.values > level, shift))
        known.append(np.roll(~np.isnan(load.upper.values), shift))
        row[place] = load.above(level).estimate
    some, done = next(iter(loads.values())), np.logical_and.reduce(known)
    n, count, most = (int(x[done].sum()) for x in (done, np.logical_or.reduce(sure), np.logical_or.reduce(possible)))
    row |= {"load": name, "unit": some.unit, "limit": some.limit, "n": n, "count": count}
    lower = upper = np.nan
    if isinstance(pair.first.design, Independent) and n:
        lower, upper = interval(count, most, n)
    return row | {"estimate": count / n if n else np.nan, "lower": lower, "upper": upper}


def _causes(pair: Shafts) -> Rows:
    """Share of the variance of the indicator "a joint of the shaft is above any limit" by line of the drawing.

    The first-order index of an error of either joint is its index for that joint's own indicator times the joint's
    share of the variance, see `shares_of_variance`.

    Returns
    -------
    sequence of mapping
        One row per entry of ``[tolerances]``, the largest first: ``line``, ``first``, ``second`` (at either place),
        ``estimate`` (their sum), ``lower``, ``upper`` (95 %, those of the errors taken as independent).
    """
    study = pair.first.study
    loads = [view.load(ANY_LIMIT) for view in pair]
    samples = [np.flatnonzero(load.is_valid)[:MOST] for load in loads]
    above = [load.values[rows] > (load.limit or 0.0) for load, rows in zip(loads, samples, strict=True)]
    if study.copula.names or min(map(len, samples)) < FEWEST:
        return []
    portions = shares_of_variance(*(float(flags.mean()) for flags in above))
    if not sum(portions) > 0:
        return []
    parts: dict[str, tuple[float, ...]] = {}
    wide: dict[str, float] = {}
    for place, view in enumerate(pair):
        portion, independent = portions[place], isinstance(view.design, Independent)
        errors = sampling.components(study, view.errors(samples[place], sampling.columns(study)))
        errors = {name: column for name, column in errors.items() if np.ptp(column) > 0}
        index = first_order(np.column_stack(list(errors.values())), above[place].astype(float), iid=independent)
        for entry in study.entries:
            of_entry = [name in entry.quantities or name[:-2] in entry.quantities for name in errors]
            caused = portion * np.nan_to_num(index.estimate[of_entry])
            half = portion * (index.upper - index.estimate)[of_entry] if portion else np.zeros(1)
            parts[entry.pattern] = (*parts.get(entry.pattern, ()), float(caused.sum()))
            wide[entry.pattern] = wide.get(entry.pattern, 0.0) + float((half**2).sum())
    rows = []
    for line, (first, second) in parts.items():
        both, half_width = first + second, wide[line] ** 0.5
        row = {"line": line, "first": first, "second": second, "estimate": both}
        rows.append(row | {"lower": max(0.0, both - half_width), "upper": min(1.0, both + half_width)})
    return sorted(rows, key=lambda row: -float(row["estimate"]))


def shares_of_variance(p: float, q: float) -> tuple[float, float]:
    """Shares of the variance of "either is above" that two independent joints explain by themselves.

    (1 - q)^2 p (1 - p) / (s (1 - s)) of the first, with the shares p and q of the joints above a limit and that of the
    shafts, s = p + q - p q; 0 where no shaft has a joint above, or each has one.
    """
    below = (1.0 - p) * (1.0 - q)
    if not 0.0 < below < 1.0:
        return 0.0, 0.0
    first, second = ((1.0 - y) ** 2 * x * (1.0 - x) / (below * (1.0 - below)) for x, y in ((p, q), (q, p)))
    return first, second


def interval(count: int, most: int, n: int, confidence: float = 0.95) -> tuple[float, float]:
    """Interval of the share of shafts above a limit, if `count` to `most` of n are: n/2 of them are independent."""
    low, _ = binomial.clopper_pearson(count / 2, n / 2, confidence)
    _, high = binomial.clopper_pearson(most / 2, n / 2, confidence)
    return float(low), float(high)


def _output(pair: Shafts) -> Rows:
    store = pair.first.store
    assert store.operation.partner is not None
    alone = store.operation.model_copy(update={"partner": None})
    params = perturb(joint_of(store, 0), alone, nominal_errors(1, store.mechanism))
    ratio, acceleration = output_motion(store.operation.partner, params)
    bound = 2.0 * pair.sum_of("psi")
    faster = [n * store.operation.speed**2 * pair.sum_of(f"psi_{n}x") for n in ORDERS]
    unevenness, largest = float(np.ptp(ratio) / ratio.mean()), float(np.abs(acceleration).max())
    return [
        _bounded("unevenness of the speed", "1", unevenness, bound),
        _bounded("angular acceleration", "rad/s^2", largest, np.sum(faster, axis=0)),
    ]


def _bounded(quantity: str, unit: str, ideal: float, added: NDArray[np.float64]) -> Row:
    row = {"quantity": quantity, "unit": unit, "ideal": ideal}
    quantiles = np.quantile(added, QUANTILES) if added.size else (np.nan,) * len(QUANTILES)
    return row | {f"at_most_{100 * part:g}": ideal + float(q) for part, q in zip(QUANTILES, quantiles, strict=True)}


def _value(row: Row, key: str) -> str:
    return text.percent(row[key]) if row["unit"] == "1" else text.value(row[key], row["unit"])
