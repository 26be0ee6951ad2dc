"""Simulate the joints that the question needs: what the file lacks, until the order of the lines is settled."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from tolstat.campaign import what_if as sets
from tolstat.campaign.executors import available_workers
from tolstat.campaign.progress import clock, silent
from tolstat.campaign.verify import no_progress
from tolstat.campaign.what_if import Wanted
from tolstat.common.errors import Fault, StoreError
from tolstat.questions.what_if import query
from tolstat.solver.simulation import warm_up
from tolstat.store import Counts, ResultStore, what_if
from tolstat.store.provenance import versions
from tolstat.store.view import View
from tolstat.study import Study, widths
from tolstat.study.widths import Line

FIRST, LEAST, MOST = 1024, 128, 16_384
"""Number of joints of each change at the first look, the smallest if time is short, and the largest of all looks."""
LOOKS = 5
"""Largest number of looks at the order: each doubles the joints of the one before."""
PILOT = 32
"""Number of joints whose time is measured."""
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

    Parameters
    ----------
    path : Path
        Result file of a campaign whose joints are drawn from tolerances.
    by : str, optional
        Load whose limit orders the lines; by default that with the limit exceeded most.
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
    workers = workers or available_workers()
    with ResultStore.open_to_write(path) as store:
        view = store.view()
        load = _checked(view, by)
        lines = query.find_lines(view, each, list(groups))
        if not lines:
            remedy = "name what a study can change: --group \"tilts = pin*.tilt_*\""
            raise StoreError(str(Fault(str(path), "has no line whose width can be changed", remedy)))
        warm_up()
        study, limit = view.study, _Time(budget)
        pilot = sets.seconds_per_joint(study, sets.options_of(study, store), PILOT)
        n, simulated, held, looks = _first(view, lines, pilot * 1.3 / workers, budget), 0, what_if.read(store), 0
        while True:
            wanted = _wanted(view, lines, n)
            lacking = sum(len(sets.missing(held, one)) for one in wanted)
            if lacking:
                cost = f"about {clock(pilot * lacking / workers)} on {workers} processes"
                tell(f"{len(lines)} lines, {n} joints of each change: {lacking} joints, {cost}")
            held = sets.simulate(study, store, wanted, view.kept_loads, workers, limit.over, progress)
            simulated += lacking - sum(len(sets.missing(held, one)) for one in wanted)
            looks += 1
            settled = _settled(view, lines, load, held)
            per_joint = limit.spent / max(simulated, 1)
            more = _next(n, per_joint * _changes(lines), limit.left) if looks < LOOKS and not settled else n
            if more <= n:
                return Outcome(simulated, n, settled, limit.spent)
            n = more


def _checked(view: View, by: str | None) -> str:
    """Load that orders the lines; refuse a file that the code cannot continue."""
    query.check(view)
    load = by or default_load(view)
    view.load(load)
    store = view.store
    if any(store.versions.get(name) != value for name, value in versions().items() if name in ("tolstat", "sources")):
        remedy = "use that version, or run the campaign again: tolstat run STUDY --out OTHER.h5"
        raise StoreError(str(Fault(str(view.path), "was made by another version of the code", remedy)))
    return load


def default_load(view: View) -> str:
    """Load with the limit exceeded most; without limits, the leading force."""
    loads = [load for load in view.loads(list(view.limits)) if load.valid.size and load.limit is not None]
    if loads:
        return max(loads, key=lambda load: load.above(load.limit or 0.0).estimate).name
    return (view.leading or view.kept_loads)[0]


def _changes(lines: Sequence[Line]) -> float:
    """Number of changed joints for each joint as drawn."""
    return (len(widths.STEPS) + 0.5) * len(lines) + 1.0


def _first(view: View, lines: Sequence[Line], seconds: float, budget: float) -> int:
    """Joints at the first look: those of the campaign, fewer if half of the budget does not suffice for them."""
    own = query.own_joints(view)
    affordable = int(0.5 * budget / (seconds * _changes(lines)))
    return max(LEAST, min(own if LEAST < own < FIRST else FIRST, affordable))


def _next(n: int, seconds: float, left: float) -> int:
    """Joints at the next look: twice as many, or what the rest of the time suffices for if that is a tenth more."""
    affordable = n + int(0.9 * left / max(seconds, 1e-9))
    more = min(2 * n, affordable, MOST)
    return more if more > 1.1 * n else n


def _wanted(view: View, lines: Sequence[Line], n: int) -> list[Wanted]:
    """Sets of a look, what the order needs first."""
    study: Study = view.study
    own = query.own_joints(view)
    found = [Wanted(sets.as_drawn(study), range(own, n))] if n > own else []
    for step in widths.STEPS:
        found += [Wanted(sets.narrowed(study, line, step), range(n)) for line in lines]
    return found + [
        Wanted(sets.exchanged(study, line), range(n // 2)) for line in lines if query.independent(view, line)
    ]


def _settled(view: View, lines: Sequence[Line], load: str, held: dict[str, what_if.Altered]) -> bool:
    values = query.halves(held, list(lines), load)
    if len(values) < len(lines):
        return False
    base = query.as_drawn(view, load, held)
    return query.is_settled(values, base, query.level_of(view.load(load)), 1.0 - 0.05 / LOOKS)
