"""Simulate the joints that the question needs: what the file lacks, until the order of the lines is settled."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from tolstat.campaign import what_if as sets
from tolstat.campaign.checks import no_progress
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.what_if import Asked, Change
from tolstat.common.cores import available_cores
from tolstat.common.counts import Counts
from tolstat.common.errors import Fault, StoreError
from tolstat.common.loads import ANY_LIMIT, split
from tolstat.display.progress import clock, silent
from tolstat.questions.what_if import query
from tolstat.solver.compilation import warm_up
from tolstat.store import Writer, what_if
from tolstat.store.provenance import versions
from tolstat.store.view import View
from tolstat.study import widths
from tolstat.study.points import names_of
from tolstat.study.widths import HALF, Line

FIRST, LEAST, MOST = 1024, 128, 16_384
"""Number of joints of each change at the first look, the smallest if time is short, and the largest of all looks."""
LOOKS = 5
"""Largest number of looks at the order: each doubles the joints of the one before."""
PILOT = 64
"""Number of joints whose time is measured."""
RELIABLE = 2000
"""Number of simulated joints whose time, with the start of the workers, says more than the pilot's."""
BUDGET_S = 300.0
"""Default time limit, s."""


class Outcome(NamedTuple):
    """What `simulate` did.

    Attributes
    ----------
    simulated : int
        Number of joints.
    each : int
        Number of joints of each change that the last look compared.
    settled : bool
        Whether the order of the lines is settled.
    seconds : float
        Time that it took, s.
    """

    simulated: int
    each: int
    settled: bool
    seconds: float


class _Time:
    """Budget of time."""

    def __init__(self, seconds: float) -> None:
        self._begin, self._seconds = time.monotonic(), seconds

    @property
    def spent(self) -> float:
        return time.monotonic() - self._begin

    @property
    def left(self) -> float:
        return self._seconds - self.spent

    def over(self) -> bool:
        return self.left <= 0.0


def simulate(
    path: Path,
    by: str | None = None,
    each: str = "entry",
    groups: Sequence[str] = (),
    budget: float = BUDGET_S,
    workers: int | None = None,
    tell: Callable[[str], None] = silent,
    progress: Callable[[Counts], None] = no_progress,
) -> Outcome:
    """Simulate joints with other widths of each line, and keep their loads in the file.

    Of several operating points those that `by` or a limit of the study is about.

    Parameters
    ----------
    path : Path
        Result file of a campaign whose joints are drawn from tolerances.
    by : str, optional
        Load whose limit orders the lines; by default ``"any limit"`` together if there are several.
    each : {"entry", "feature", "error"}
        What a line is: an entry of ``[tolerances]``, a pin with its hole, or an error.
    groups : sequence of str
        Groups beside these, ``"tilts = pin*.tilt_*, hole*.tilt_*"``.
    budget : float
        Time limit, s. What is done by then stays in the file; the same call goes on.
    workers : int, optional
        Number of processes; by default one per core. Does not affect results.
    tell, progress : callable
        Receive messages, and the counts of the joints.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        With every fault of `groups`, or when there is no such load.
    StoreError
        When the file cannot be used, or was made by other code.
    """
    workers = workers or available_cores()
    with Writer.open(path) as store, kept_workers():
        view = View(store)
        load = _checked(view, by)
        lines = query.find_lines(view, each, list(groups))
        if not lines:
            remedy = 'name what a study can change: --group "tilts = pin*.tilt_*"'
            raise StoreError(str(Fault(str(path), "has no line whose width can be changed", remedy)))
        warm_up()
        run = _Run(store, view, lines, load, workers, budget, tell, progress)
        run.look(run.first(), widths.STEPS)
        for _ in range(LOOKS - 1):
            if run.settled or (more := run.next()) <= run.each:
                break
            run.look(more, (HALF,))
        if run.simulated and not run.limit.over():
            run.look(run.each, widths.STEPS)
        return Outcome(run.simulated, run.each, run.settled, run.limit.spent)


class _Run:
    """Looks at the order of the lines, each with more joints of the changes than the one before.

    Attributes
    ----------
    each, simulated : int
        Number of joints of each change at the last look; of all joints simulated.
    settled : bool
        Whether the order of the lines is settled.
    limit : _Time
        Budget of time.
    """

    def __init__(
        self,
        store: Writer,
        view: View,
        lines: Sequence[Line],
        load: str,
        workers: int,
        budget: float,
        tell: Callable[[str], None],
        progress: Callable[[Counts], None],
    ) -> None:
        self._store, self._view, self._lines, self._load = store, view, lines, load
        self._workers, self._tell, self._progress = workers, tell, progress
        self.limit, self._budget = _Time(budget), budget
        self._held, self._asked = what_if.read(store), Asked(view.kept_loads, points_of(view, load))
        self._names = self._asked.names(view.study)
        options = sets.options_of(view.study, store)
        self._seconds = sets.seconds_per_joint(view.study, options, PILOT, self._asked.points) / workers
        self.each, self.simulated, self.settled = 0, 0, False

    def first(self) -> int:
        """Joints at the first look: those of the campaign, fewer if half of the budget does not suffice for them."""
        own = query.own_joints(self._view)
        affordable = int(0.5 * self._budget / (self._seconds * ((len(widths.STEPS) + 0.5) * len(self._lines) + 1.0)))
        return max(LEAST, min(own if LEAST < own < FIRST else FIRST, affordable))

    def next(self) -> int:
        """Joints at the next look: twice as many, or what the time suffices for if that is a tenth more."""
        affordable = self.each + int(0.9 * self.limit.left / (self._seconds * (len(self._lines) + 1.0)))
        more = min(2 * self.each, affordable, MOST)
        return more if more > 1.1 * self.each else self.each

    def look(self, n: int, steps: Sequence[str]) -> None:
        """Simulate what is missing of `n` joints of each line after these steps, and compare the lines half as wide."""
        wanted = self._wanted(n, steps)
        lacking = self._lacking(wanted)
        if lacking:
            cost = f"about {clock(self._seconds * lacking)} on {self._workers} processes"
            where = f" at {', '.join(self._asked.points)}" if all(self._asked.points) else ""
            lines = f"{len(self._lines)} lines, {n} joints of each change"
            self._tell(f"{lines}: {lacking} joints to simulate{where}, {cost}")
            begin = self.limit.spent
            self._held = sets.simulate(
                self._view.study,
                self._store,
                wanted,
                self._asked,
                self._workers,
                self.limit.over,
                self._progress,
            )
            done = lacking - self._lacking(wanted)
            if done > RELIABLE:
                self._seconds = (self.limit.spent - begin) / done
            self.simulated += done
        self.each, self.settled = n, self._is_settled()

    def _lacking(self, wanted: Sequence[Change]) -> int:
        return sum(len(sets.missing(self._held, one, self._names)) for one in wanted)

    def _wanted(self, n: int, steps: Sequence[str]) -> list[Change]:
        """Sets of a look, what the order needs first."""
        study, own = self._view.study, query.own_joints(self._view)
        found = [sets.as_drawn(study, range(own, n))] if n > own else []
        for step in steps:
            found += [sets.narrowed(study, line, step, range(n)) for line in self._lines]
        if len(steps) == 1:
            return found
        apart = [line for line in self._lines if query.independent(self._view, line)]
        return found + [sets.exchanged(study, line, range(n // 2)) for line in apart]

    def _is_settled(self) -> bool:
        values = query.halves(self._held, list(self._lines), query.measure(self._view, self._load))
        if len(values) < len(self._lines):
            return False
        base = query.as_drawn(self._view, self._load, self._held)
        return query.is_settled(values, base, query.level_of(self._view.load(self._load)), 1.0 - 0.05 / LOOKS)


def points_of(view: View, by: str) -> tuple[str, ...]:
    """Operating points that a load, a limit or joints in the file are about; all of them if there is no limit."""
    every = tuple(view.store.points)
    asked = () if by == ANY_LIMIT else (by,)
    names = [*asked, *(view.limits or ("",)), *(name for one in view.altered.values() for name in one.names)]
    chosen = {point for name in names for point in names_of(split(name)[1], every, name)}
    return tuple(point for point in every if point in chosen)


def _checked(view: View, by: str | None) -> str:
    """Load that orders the lines; refuse a file that the code cannot continue."""
    query.check(view)
    load = by or view.decisive
    view.load(load)
    store = view.store
    if any(store.versions.get(name) != value for name, value in versions().items() if name in ("tolstat", "sources")):
        remedy = "use that version, or run the campaign again: tolstat run STUDY --out OTHER.h5"
        raise StoreError(str(Fault(str(view.path), "was made by another version of the code", remedy)))
    return load
