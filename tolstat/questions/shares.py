"""What several questions have in common: shares above limits, joints compared with changed ones, reasons to refuse."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.analysis import binomial, difference
from tolstat.analysis.design import Design, Independent
from tolstat.analysis.prediction import DELIVERY
from tolstat.analysis.sample import CONFIDENCE, Sample, total_interval
from tolstat.campaign import what_if as sets
from tolstat.campaign.work import Work
from tolstat.common.cores import available_cores
from tolstat.common.errors import Fault, NotApplicable, StoreError
from tolstat.common.loads import ANY_LIMIT, FloatArray, Limit
from tolstat.common.tables import Status
from tolstat.display import text
from tolstat.display.answer import Document
from tolstat.display.progress import clock
from tolstat.display.table import Column, Row, has
from tolstat.solver.compilation import warm_up
from tolstat.store import Writer, error_budget, what_if
from tolstat.store.view import View
from tolstat.study import Study
from tolstat.study.placing import joints_beside, placed
from tolstat.study.points import at
from tolstat.study.rewriting import with_keys

WIDEST = 0.5
"""Total interval of a yield, or its bounds without one, from which on it says too little for a verdict."""
TAIL_STARTS_AT = 0.9
"""Share of the joints below the tail, for a load without a limit."""
NEGLIGIBLE = 0.1
"""Difference of two shares that does not matter, relative to the share of the joints as drawn."""
PILOT = 64
"""Number of joints whose time is measured before others are simulated."""
ORIGIN = {
    "stored": "from the histories in the file",
    "harmonics": "restored from the harmonics in the file",
    "simulated again": "simulated again, since the file holds no histories",
}
"""Where `revolutions.Revolutions` have their loads from, in words."""
NO_INTERVALS = "no intervals: they hold for independent samples only"
JOINT_FILES = {"joint": "_joint.toml", "joint2": "_joint2.toml"}
"""End of the name of a joint file that is written beside a study."""
Cell = Callable[[Row], str]
Estimate = tuple[float, float, float]
"""An estimate, and the ends of its interval."""


def word(key: str) -> Cell:
    """Make a `Column.cell` of a value that is text, or a whole number."""
    return lambda row: str(row[key])


def share(key: str) -> Cell:
    """Make a `Column.cell` of a share, in per cent."""
    return lambda row: text.percent(row[key])


def shares(lower: str, upper: str) -> Cell:
    """Make a `Column.cell` of an interval of shares, in per cent."""
    return lambda row: text.span(row[lower], row[upper])


def value(key: str) -> Cell:
    """Make a `Column.cell` of a load, in the row's ``unit``."""
    return lambda row: text.value(row[key], row["unit"])


def values(lower: str, upper: str) -> Cell:
    """Make a `Column.cell` of an interval of loads, in the row's ``unit``."""
    return lambda row: text.span_of(row[lower], row[upper], row["unit"])


def estimated(
    head: str, name: str, rank: int = 0, form: str = ".1f", ends: tuple[float, float] | None = None
) -> Column:
    """Column of an estimate between two `ends`, in per cent unless `form` has two digits, with its interval."""
    factor = 1.0 if form.endswith("2f") else 100.0

    def cell(row: Row) -> str:
        if math.isnan(value := row.get(name, math.nan)):
            return "-"
        low, high = (factor * row[f"{name}{end}"] for end in ("_lower", "_upper"))
        value = factor * (value if ends is None else min(max(value, ends[0]), ends[1])) + 0.0  # no -0
        return f"{value:{form}}" + ("" if math.isnan(low) else f" ({text.ends(low, high, form)})")

    return Column(head, cell, shown=has(name), rank=rank)


def above(row: Row) -> str:
    """Cell of the joints above a limit, and of how many with a valid load."""
    scrap = row.get("scrap", 0)
    return f"{row['count'] - scrap} of {row['n'] - row['n_failed'] - row['n_unsettled'] - scrap}"


def limit(row: Row) -> str:
    """Cell of the ``limit`` of a row; a dash for all limits together."""
    return "-" if row["load"] == ANY_LIMIT else text.value(row["limit"], row["unit"])


def with_ends(name: str, estimate: Iterable[float]) -> dict[str, float]:
    """Keys and values of an estimate and the ends of its interval: ``NAME``, ``NAME_lower``, ``NAME_upper``."""
    return {f"{name}{end}": float(value) for end, value in zip(("", "_lower", "_upper"), estimate, strict=True)}


def rows_of(columns: Mapping[str, Iterable[Any]]) -> list[dict[str, Any]]:
    """Rows of a table from its columns, which are of one length."""
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def inapplicable(view: View, reason: str, remedy: str) -> NotApplicable:
    """Make the error of a question that does not apply to a file."""
    return NotApplicable(str(Fault(str(view.path), reason, remedy)))


def unusable(view: View, reason: str, remedy: str) -> StoreError:
    """Make the error of a file that cannot be used for a question."""
    return StoreError(str(Fault(str(view.path), reason, remedy)))


def study_documents(study: Study, changed: str) -> list[Document]:
    """Study of a changed text, and files of its joints where these have to be written, as they run where they lie."""
    joints = {path: (JOINT_FILES[str(path[-1])], text) for path, text in joints_beside(study).items()}

    def of(path: Path) -> str:
        here = placed(changed, study.path, path)
        bases = {at: {"base": f"{path.stem}{end}"} for at, (end, _) in joints.items()}
        return with_keys(here, bases, path.name) if bases else here

    return [Document(".toml", of), *(Document(end, partial(_given, text)) for end, text in joints.values())]


def _given(text: str, _: Path) -> str:
    return text


def check_sample(view: View) -> None:
    """Refuse joints that are no sample of a production, or cannot be compared with changed ones.

    Raises
    ------
    StoreError
        Joints are not drawn from tolerances, or are a part of the campaign's. The hint names what can be used.
    """
    view.check_drawn()
    view.check()
    if not view.store.whole:
        remedy = "merge all slices first: tolstat merge SLICE... --out FILE"
        raise unusable(view, "holds a part of the campaign only", remedy)


def check_one_joint(view: View) -> None:
    """Refuse what `check_sample` refuses, and a sample of several joints: StoreError."""
    check_sample(view)
    if view.store.variants:
        raise unusable(view, "holds several joints", "give the file of a study with tolerances and one joint")


def grouped(reasons: Iterable[tuple[str, str]]) -> str:
    """Words on loads and the reason of each: ``cross1.F, cross2.F: reason; fork1.T: other reason``."""
    loads: dict[str, list[str]] = {}
    for name, reason in dict.fromkeys(reasons):
        loads.setdefault(reason, []).append(name)
    return "; ".join(f"{', '.join(names)}: {reason}" for reason, names in loads.items())


def good(view: View, name: str = ANY_LIMIT, delivery: int = DELIVERY) -> Mapping[str, Any]:
    """Yield, joints above, or scrap, in a million and in a delivery: keys of `capability.limit_rows` but indices."""
    return view.kept(("good", name, delivery), lambda: _good(view, name, delivery))


def _good(view: View, name: str, delivery: int) -> Mapping[str, Any]:
    load = view.load(name)
    assert load.limit is not None
    loads, scrap = error_budget.with_error(view, load), view.misfits
    loads = tuple(each.with_scrap(scrap) for each in loads) if scrap.any() else loads
    above = loads[0].above(load.limit)
    row: dict[str, Any] = {"load": load.name, "unit": load.unit, "limit": load.limit}
    row |= {"n": above.n, "n_failed": above.n_failed, "n_unsettled": above.n_unsettled, "count": above.count}
    row |= {"scrap": int(scrap.sum())}
    share, low, high = above.estimate, *total_interval(loads, load.limit, CONFIDENCE)
    row |= with_ends("good", (1.0 - share, 1.0 - high, 1.0 - low))
    row |= with_ends("ppm", (1e6 * share, 1e6 * low, 1e6 * high))
    return row | error_budget.delivery(loads, load.limit, delivery, CONFIDENCE)


class Yield(NamedTuple):
    """Yield of all limits together, in words.

    Attributes
    ----------
    value : str
        The estimate, or the interval where joints without a valid load matter.
    words : str
        What it is the share of, number of joints, total interval.
    decides : bool
        Whether the interval is narrower than `WIDEST`.
    """

    value: str
    words: str
    decides: bool


def together(row: Row, limits: int) -> Yield:
    """Share of the joints that keep all of some limits, from `good`."""
    n, above, unresolved = int(row["n"]), int(row["count"]), int(row["n_failed"] + row["n_unsettled"])
    valid, low, high = n - unresolved, row["good_lower"], row["good_upper"]
    kind = "bounds" if math.isnan(low) else "total interval"
    if kind == "bounds":
        low, high = ((valid - above) / n, 1.0 - above / n) if n else (0.0, 1.0)
    span, counted = text.span(low, high), f"{valid - above} of {valid}{' with a valid load' if unresolved else ''}"
    counted += f", {row['scrap']} cannot be assembled" if row["scrap"] else ""
    figure = text.percent(row["good"])
    if unresolved_matter(row):
        figure, interval = span, kind
    else:
        interval = "no interval" if kind == "bounds" else f"{kind} {span}"
    keep = f"keep all {limits} limits" if limits > 1 else "keep the limit"
    return Yield(figure, f"of the joints {keep} ({counted}; {interval})", high - low < WIDEST)


def unresolved_matter(row: Row) -> bool:
    """Whether joints without a valid load make the share above a limit as uncertain as sampling does."""
    return binomial.unresolved_matter(row["count"], row["n"], row["n_failed"] + row["n_unsettled"])


class ChangedJoints:
    """Load of joints as drawn and with each change, to be compared.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    by : str or Limit
        A load, ``"any limit"``, or a limit of one's own.
    altered : mapping
        Changes by their digest, as `View.altered`.

    Attributes
    ----------
    load : Sample
        The load in the campaign.
    level : float
        Its limit; without one, its quantile `TAIL_STARTS_AT`.
    design : Design
        How the joints were drawn.
    base : ndarray, shape (n,)
        Load of the joints as drawn, from sample 0 on, NaN without a valid one: the campaign's, then fresh ones.
    """

    def __init__(self, view: View, by: str | Limit, altered: Mapping[str, what_if.Altered]) -> None:
        self._study, self._altered = view.study, altered
        self.design = view.design if view.design.independent else Independent()  # of fresh joints, see `own_joints`
        if isinstance(by, Limit):
            self.load, self.level = view.load_of(by), by.level
            ratios = zip(by.loads, by.levels, strict=True)
            levels = {name: 1.0 if by.has_one_level else level for name, level in ratios}
        else:
            self.load = view.load(by)
            self.level, levels = tail_level(self.load), view.limits if by == ANY_LIMIT else {by: 1.0}
        self._parts = [(names_at_points(view, name), level) for name, level in levels.items()]
        n = own_joints(view)
        self.base, more = self.load.values[:n], altered.get(what_if.key(sets.as_drawn(view.study, range(0)).about))
        if more is not None and more.first <= n < more.end and (loads := self._of(more)) is not None:
            self.base = np.concatenate([self.base, loads[n - more.first :]])

    def of(self, about: Mapping[str, Any]) -> FloatArray | None:
        """Load of the joints of a change, as `changes` yields it; None where the file holds none of them."""
        change = self._altered.get(what_if.key(about))
        return None if change is None or change.first else self._of(change)

    def _of(self, altered: what_if.Altered) -> FloatArray | None:
        if not all(altered.holds(names) for names, _ in self._parts):
            return None
        return np.asarray(np.maximum.reduce([altered.valid(names) / level for names, level in self._parts]))

    def changes(self, *kinds: str) -> Iterator[tuple[Mapping[str, Any], FloatArray]]:
        """Yield changes of some kinds that have the load from the first joint on, `Altered.about`, and these loads.

        The load of each joint, or its largest ratio to all limits; NaN without a valid one, (n,).
        """
        for change in self._altered.values():
            if change.about["kind"] in kinds and not change.first and (loads := self._of(change)) is not None:
                yield change.about, loads

    def share(self, values: FloatArray, confidence: float = 0.95) -> Estimate:
        """Share of joints above the level."""
        above = sample_of(values, self.design).above(self.level, confidence)
        return above.estimate, above.outer_lower, above.outer_upper

    def difference(self, a: FloatArray, b: FloatArray, confidence: float = 0.95) -> Estimate:
        """Share of B above the level less that of A, joint by joint; A may have more joints.

        Raises
        ------
        ValueError
            No joint has a load in both.
        """
        one, other = (sample_of(values, self.design) for values in (a[: len(b)], b))
        change = difference.shares(one, other, [self.level], paired=True, confidence=confidence)
        return float(change.estimate[0]), float(change.outer_lower[0]), float(change.outer_upper[0])

    def tells(self, values: FloatArray, confidence: float = 0.95) -> bool:
        """Whether it is known what a change does: its difference excludes zero, or is less than `NEGLIGIBLE`."""
        _, low, high = self.difference(self.base, values, confidence)
        return not low <= 0.0 <= high or max(-low, high) <= NEGLIGIBLE * self.share(self.base)[0]


class Simulation:
    """Simulation of joints of a campaign with changes, whose loads its file keeps.

    Parameters
    ----------
    store, view : Writer, View
        The file.
    work : Work
        Workers, progress and messages.
    loads : sequence of str
        Loads whose operating points the joints are simulated at; empty for those without a point: all of the view.

    Attributes
    ----------
    altered : dict of str to Altered
        What the file holds.
    simulated : int
        Number of joints simulated so far, each at every point.
    """

    def __init__(self, store: Writer, view: View, work: Work, loads: Iterable[str]) -> None:
        every = tuple(view.store.points)
        chosen = {point for name in loads for point in view.narrowed(name)[0].points}
        self._asked = sets.Asked(view.kept_loads, [point for point in every if point in chosen])
        self._store, self._study, self._work = store, view.study, work
        self._workers = work.workers or available_cores()
        self.altered, self.simulated = what_if.read(store), 0

    @cached_property
    def seconds(self) -> float:
        """Time of a joint at all points, s, divided among the processes; changes as joints are simulated."""
        warm_up(mechanism=self._study.mechanism)
        options = sets.options_of(self._study, self._store)
        return sets.seconds_per_joint(self._study, options, PILOT, self._asked.points) / self._workers

    def run(self, wanted: Sequence[sets.Change], stage: str, about: str = "", end: float = math.inf) -> int:
        """Simulate what the file lacks of some changes until `end` of `time.monotonic`, s; `about` begins the message.

        Returns the number of joints that are still missing.
        """
        names = self._asked.names(self._study)

        def lacking() -> int:
            return sum(len(sets.missing(self.altered, change, names)) for change in wanted)

        if not (missing := lacking()):
            return 0
        sets.check_code(self._store)
        needed, left, points = self.seconds * missing, end - time.monotonic(), ", ".join(self._asked.points)
        cost = f"about {clock(needed)} on {self._workers} processes"
        cost += f", of which {clock(max(left, 0.0))} are left" if needed > left else ""
        self._work.tell(f"{about}{missing} joints to simulate{f' at {points}' if points else ''}, {cost}")
        self._work.display.stage(stage, left)
        stop, progress = (lambda: time.monotonic() >= end), self._work.display
        self.altered = sets.simulate(self._study, self._store, wanted, self._asked, self._workers, stop, progress)
        still = lacking()
        self.simulated += missing - still
        return still


def sample_of(values: FloatArray, design: Design | None = None) -> Sample:
    """Sample of loads, by default of independent joints; joints without one have failed."""
    return Sample.of(values, np.full(values.size, Status.OK), design)


def tail_level(load: Sample) -> float:
    """Limit of a load; without one, its quantile `TAIL_STARTS_AT`."""
    return load.quantile(TAIL_STARTS_AT).estimate if load.limit is None else load.limit


def own_joints(view: View) -> int:
    """Number of samples of the campaign, from the first, that serve as joints as drawn: none of them pending."""
    if not view.design.independent:
        return 0
    waiting = np.flatnonzero(view.status == Status.PENDING)
    return int(waiting[0]) if waiting.size else view.n


def names_at_points(view: View, load: str) -> tuple[str, ...]:
    """Names that the file keeps of a load, one for each operating point: that of the load unless it has several."""
    narrowed, plain = view.narrowed(load)
    return tuple(at(plain, [point], list(view.store.points)) for point in narrowed.points)
