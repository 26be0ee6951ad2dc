"""Share of the joints above a limit if a line of the drawing were changed, from joints with the same seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.analysis import difference, exchanged
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.campaign import what_if as sets
from tolstat.common.loads import ANY_LIMIT, FloatArray
from tolstat.common.mechanism import Mechanism
from tolstat.common.shell import quote
from tolstat.display import text
from tolstat.display.table import Row, Rows
from tolstat.questions.shares import NEGLIGIBLE, ChangedJoints, Estimate, check_sample, sample_of, unusable, with_ends
from tolstat.store.view import View
from tolstat.study import Study, scaling, widths
from tolstat.study.costs import of as prices_of
from tolstat.study.tolerances.correlation import Group

MIN_JOINTS = 200
"""Minimum number of valid joints for causes by error."""
ENDS = ("", "_lower", "_upper")
"""Ends of the keys of an estimate and its interval."""
INDICES = tuple(f"{name}{word}{end}" for name in ("", "above_") for word in ("alone", "in_all") for end in ENDS)
"""Keys of the Sobol' indices of a line, with their intervals."""


class Lines(NamedTuple):
    """Share of the joints above a limit, or above at least one of all limits, with other widths.

    Attributes
    ----------
    facts : mapping
        ``load`` (``"any limit"`` for the largest ratio of load to limit), ``unit``; ``level``, the limit or without one
        the 90 % quantile of the load; ``n``, number of joints as drawn; ``share`` of these above the level, ``lower``
        and ``upper``, its interval with failed and unsettled joints; ``logarithmic``, whether the logarithm of the load
        is decomposed; ``missing`` and ``left_out``, entries of ``[tolerances]`` without joints in the file, and those
        whose width is not changed; ``settled``, whether the order of the lines is: neighbours differ, or by less than
        `NEGLIGIBLE` of the share.
    rows : sequence of mapping
        One row per line and step, lines in the order of their share if half as wide or with the best other fit:
        ``line``, ``names``, ``size``, ``step`` (of a fit the other code), ``words``, ``factor`` (NaN if it differs
        within the line, and of a fit), ``n``, ``share`` with ``_lower`` and ``_upper``, and ``change`` from the joints
        as drawn, with ends; see `Joints.estimates`. Where costs are given, ``cost`` of the line after the step and
        ``extra_cost``, how much more that is than as drawn; NaN where it has none.
    indices : sequence of mapping
        One row per line that can be exchanged: ``line``, ``pairs``; ``alone`` and ``in_all`` with ends, the closed and
        total Sobol' index of the load, or of its logarithm; ``above_alone`` and ``above_in_all``, those of the event
        that it is above the level. NaN where they cannot be estimated.
    mechanism : Mechanism
        What is simulated.
    """

    facts: Mapping[str, Any]
    rows: Rows
    indices: Rows
    mechanism: Mechanism

    @property
    def by_line(self) -> Rows:
        """One row per line that is no fit, with the numbers of each step behind its name.

        ``half``, ``half_lower``, ``half_change``, ``half_cost``; ``by`` has the words of the steps that follow
        classes. Keys of steps that are not simulated are missing.
        """
        lines: dict[str, dict[str, Any]] = {}
        for row in self.rows:
            if (step := row["step"]) in widths.STEPS:
                line = lines.setdefault(row["line"], {"line": row["line"], "size": row["size"], "by": []})
                line |= {f"{step}{end}": row[f"share{end}"] for end in ENDS}
                line |= {f"{step}_change{end}": row[f"change{end}"] for end in ENDS}
                line |= {f"{step}_cost": row.get("extra_cost", np.nan)}
                line["by"] += [row["words"]] if step in (widths.FINER, widths.COARSER) else []
        return list(lines.values())

    @property
    def other_fits(self) -> Rows:
        """Those of `rows` that have another fit."""
        return [row for row in self.rows if row["step"] not in widths.STEPS]

    @property
    def event(self) -> str:
        """What the share is about: ``cross1.F > 1500 N``, or ``at least one limit exceeded``."""
        return "at least one limit exceeded" if self.facts["load"] == ANY_LIMIT else text.limit(self.facts)

    @property
    def limit(self) -> str:
        """What the joints of the share exceed: ``the limit``, or ``at least one limit``."""
        return "at least one limit" if self.facts["load"] == ANY_LIMIT else "the limit"

    @property
    def best(self) -> Row | None:
        """Row of the line half as wide, or of the other fit, that lowers the share most; None if none surely does."""
        rows = [row for row in self.rows if is_decisive(row["step"]) and row["change_upper"] < 0.0]
        return min(rows, key=lambda row: float(row["share"]), default=None)


def check_scatter(view: View, load: Sample) -> None:
    """Refuse a load that has no causes among the errors: of too few joints, or without scatter.

    Raises
    ------
    StoreError
    """
    if load.valid.size < MIN_JOINTS:
        what = "load on all limits" if load.name == ANY_LIMIT else load.name
        remedy = f"{MIN_JOINTS} are needed: tolstat extend {quote(str(view.path))} --n {MIN_JOINTS}"
        raise unusable(view, f"has {load.valid.size} joints with a valid {what}", remedy)
    if np.ptp(load.valid) == 0:
        same = f"has the same {load.name} in all joints: no error causes it"
        raise unusable(view, same, "name another load with --by")


def is_decisive(step: str) -> bool:
    """Whether a line has its place in the order by this step: half as wide, or another fit."""
    return step == widths.HALF or step not in widths.STEPS


def evaluate(view: View, by: str, costs: Path | None = None) -> Lines | None:
    """Evaluate the joints with other widths that a file holds.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    by : str
        A load that can have a limit (``cross1.F``, ``pin2.contact``, ``psi``), or ``"any limit"`` of the study.
    costs : Path, optional
        Table of the costs of tolerances, see `study.costs.of`.

    Returns
    -------
    Lines or None
        None where the file holds no such joints (`simulation.simulate` adds them). All intervals are 95 %.

    Raises
    ------
    InputError
        When there is no such load, or the study does not keep it; with every fault of the costs.
    StoreError
        When the joints are not drawn from tolerances.
    """
    check_sample(view)
    joints = Joints(view, by, view.altered)
    rows = joints.rows() if np.isfinite(joints.base).any() else []
    rows = rows if costs is None else _with_costs(view.study, rows, costs)
    if not rows:
        return None
    lines, entries = list(dict.fromkeys(row["line"] for row in rows)), widths.lines(view.study)
    decisive = {row["line"] for row in rows if is_decisive(row["step"])}
    facts = {"load": by, "unit": joints.load.unit, "level": joints.level, "n": len(joints.base)}
    facts |= dict(zip(("share", "lower", "upper"), joints.share(joints.base), strict=True))
    facts |= {"logarithmic": joints.load.long_tailed}
    facts |= {"settled": joints.settled([line for line in entries if line.label in decisive])}
    facts |= {"missing": [line.label for line in entries if line.label not in lines]}
    return Lines(facts | {"left_out": widths.left_out(view.study)}, rows, joints.indices(lines), view.mechanism)


class Joints(ChangedJoints):
    """Load of the joints that the lines are compared on, as drawn and with each change."""

    def settled(self, lines: Sequence[Group], confidence: float = 0.95) -> bool:
        """Whether the file has all these lines half as wide, or with other fits, and their order `is_settled`."""
        loads = [self.decisive(line) for line in lines]
        known = [values for _, values in loads if values is not None]
        return len(known) == len(loads) and is_settled(known, self.base, self.level, confidence)

    def decisive(self, line: Group) -> tuple[str, FloatArray | None]:
        """Step that a line has its place in the order by, and the load of the joints with it; None without these.

        Of a fit it is the other fit that lowers the share most.
        """
        loads = {
            about["step"]: values
            for about, values in self.changes(sets.WIDTH, sets.FIT)
            if about["label"] == line.label and is_decisive(about["step"])
        }
        if not loads:
            return widths.steps(self._study, line)[0], None
        step = min(loads, key=lambda step: self.difference(self.base, loads[step][: len(self.base)])[0])
        return step, loads[step]

    def estimates(self, values: FloatArray, half: FloatArray | None) -> tuple[Estimate, Estimate]:
        """Share of joints with one line changed above the level, and its change from the joints as drawn.

        Of fewer joints than are known as drawn, it is the share of all as drawn plus the change. Of fewer joints than
        are known with the line half as wide, `half`, it is the share of these plus the difference on the joints that
        both have, so that a line exact does not seem worse than half as wide because its joints are fewer.
        """
        change = self.difference(self.base, values)
        if len(values) == len(self.base):
            return self.share(values), change
        if half is None or len(half) <= len(values) or not np.isfinite(values + half[: len(values)]).any():
            return _sum(self.share(self.base), change, 0.0), change
        share, change = self.estimates(half, None)
        further = self.difference(half, values)
        return _sum(share, further, 0.0), _sum(change, further, -1.0)

    def rows(self) -> list[dict[str, Any]]:
        """Rows of `Lines.rows`: lines by their decisive share, then by that if exact, those without these behind."""
        by_line: dict[Group, dict[str, Any]] = {}
        for about, loads in self.changes(sets.WIDTH, sets.FIT):
            values = loads[: len(self.base)]
            if np.isfinite(values + self.base[: len(values)]).any():
                by_line.setdefault(Group(about["label"], tuple(about["tolerances"])), {})[about["step"]] = about, values
        rows, ranks = [], dict[str, tuple[int, float]]()
        for line, steps in by_line.items():
            head = {"line": line.label, "names": line.names, "size": widths.size(self._study, line)}
            for step, (about, values) in steps.items():
                half = steps[widths.HALF][1] if step in (widths.EXACT, widths.FINER) and widths.HALF in steps else None
                share, change = self.estimates(values, half)
                factors = {entry.get("factor", np.nan) for entry in about["tolerances"].values()}
                row = {**head, "step": step, "words": about["words"]}
                row |= {"factor": factors.pop() if len(factors) == 1 else np.nan, "n": len(values)}
                rows.append(row | with_ends("share", share) | with_ends("change", change))
                rank = 0 if is_decisive(step) else 1 if step == widths.EXACT else 2, share[0]
                ranks[line.label] = min(ranks.get(line.label, rank), rank)
        of_step = {step: (i, 0.0) for i, step in enumerate(widths.STEPS)}

        def order(row: Row) -> Any:
            return *ranks[row["line"]], row["line"], of_step.get(row["step"], (0, row["share"]))

        return sorted(rows, key=order)

    def indices(self, lines: Sequence[str]) -> list[dict[str, Any]]:
        """Rows of `Lines.indices`, in the order of these lines."""
        rows = []
        for about, loads in self.changes(sets.EXCHANGE):
            n = min(len(loads), len(self.base) // 2)
            if about["label"] not in lines or n < exchanged.FEWEST:
                continue
            row: dict[str, Any] = {"line": about["label"], "pairs": n} | dict.fromkeys(INDICES, np.nan)
            joints = self.base[: 2 * n : 2], self.base[1 : 2 * n : 2], loads[:n]
            response = [np.log(values) if self.load.long_tailed else values for values in joints]
            events = [np.where(np.isfinite(values), values > self.level, np.nan) for values in joints]
            pairs = (("", response, exchanged.indices), ("above_", events, exchanged.of_event))
            for name, (a, b, ab), estimate in pairs:
                with suppress(ValueError):  # too few joints with a load, or none, or all of them, above the level
                    indices = estimate(a, b, ab[:, None], self.design.level(CONFIDENCE))
                    row |= with_ends(f"{name}alone", [end[0] for end in indices.first])
                    row |= with_ends(f"{name}in_all", [end[0] for end in indices.total])
            rows.append(row)
        return sorted(rows, key=lambda row: lines.index(row["line"]))


def _with_costs(study: Study, rows: list[dict[str, Any]], table: Path) -> list[dict[str, Any]]:
    """Rows with the cost of the line after the step, and what that is more than as drawn."""
    tolerances = scaling.tolerances(study)
    costs = prices_of(tolerances, study.mechanism, table)
    tolerance_of = {name: k for k, tolerance in enumerate(tolerances) for name in tolerance.names}
    for row in rows:
        by_feature: dict[tuple[int, str], float] = {}  # several errors of a feature are one width on the drawing
        for name, factor in widths.factors(study, Group(row["line"], row["names"]), row["step"]).items():
            key = tolerance_of.get(name, -1), name.rpartition(".")[0]
            by_feature[key] = min(factor, by_feature.get(key, np.inf))
        is_known = all(
            k >= 0 and factor > 0.0 and not costs[k].entries[feature].keep
            for (k, feature), factor in by_feature.items()
        )
        cost, drawn = (
            sum(costs[k].of(feature, factor if changed else 1.0) for (k, feature), factor in by_feature.items())
            if is_known
            else np.nan
            for changed in (True, False)
        )
        row |= {"cost": cost, "extra_cost": cost - drawn}
    return rows


def is_settled(values: Sequence[FloatArray], base: FloatArray, level: float, confidence: float = 0.95) -> bool:
    """Whether the order of lines by their shares above a level is settled.

    Neighbours in the order are compared joint by joint. Their difference has an interval, at a confidence level that
    holds for all of them together (Bonferroni); it excludes zero, or lies within `NEGLIGIBLE` of the share as drawn.
    """
    if len(values) < 2:
        return True
    n = min(len(base), *map(len, values))
    ranked = sorted((loads[:n] for loads in values), key=lambda loads: float(np.mean(loads > level)))
    drawn = float(np.mean(base[:n] > level))
    of_each = 1.0 - (1.0 - confidence) / (len(values) - 1)
    for pair in pairwise(map(sample_of, ranked)):
        change = difference.shares(*pair, [level], paired=True, confidence=of_each)
        low, high = float(change.lower[0]), float(change.upper[0])
        if low <= 0.0 <= high and max(-low, high) > NEGLIGIBLE * drawn:
            return False
    return True


def _sum(share: Estimate, change: Estimate, least: float) -> Estimate:
    """Share plus a change that fewer joints tell, with the interval of both (Zou and Donner 2008); at least `least`.

    The share and its change have a negative covariance, so the interval is wide rather than narrow.
    """
    total = share[0] + change[0]
    low, high = (np.hypot(share[0] - share[k], change[0] - change[k]) for k in (1, 2))
    return tuple(float(np.clip(x, least, 1.0)) for x in (total, total - low, total + high))  # type: ignore[return-value]
