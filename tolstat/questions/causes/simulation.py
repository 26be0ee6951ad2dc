"""Simulate what tells causes: joints with each line of the drawing changed.

The lines are compared on the latter, more and more of them, until their order is settled.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from tolstat.campaign import what_if as sets
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.work import Work
from tolstat.common.loads import ANY_LIMIT
from tolstat.display import text
from tolstat.display.options import Costs, Load, Opt
from tolstat.questions.causes import shares
from tolstat.questions.shares import Simulation, check_sample, own_joints
from tolstat.store import Writer
from tolstat.store.hdf5 import store_error
from tolstat.store.view import View
from tolstat.study import scaling, widths
from tolstat.study.costs import of as prices_of
from tolstat.study.tolerances.correlation import Group

FIRST, LEAST, MOST = 1024, 128, 16_384
"""Number of joints of each change at the first look, the smallest if time is short, and by default the largest."""
RELIABLE = 2000
"""Number of simulated joints whose time, with the start of the workers, says more than the pilot's."""
BUDGET_S = 300.0
"""Default time limit, s."""

Each = Literal["entry", "feature", "error"]
"""What a line is."""
LINES = {"entry": widths.lines, "feature": widths.features, "error": widths.errors}
"""Lines of a study by what they are."""


def simulate(
    path: Path,
    work: Work,
    by: Load = None,
    each: Each = "entry",
    group: Annotated[list[str] | None, Opt("NAME=PATTERN,...")] = None,
    budget: Annotated[float, Opt("TIME", unit="s")] = BUDGET_S,
    most: Annotated[int, Opt("N", least=LEAST)] = MOST,
    costs: Costs = None,
) -> list[Path]:
    """Simulate joints of a campaign with other widths of each line, and keep their loads in the file.

    Of a file with several operating points those that `by` or a limit of the study is about. Ends when the order of the
    lines is settled, the time is up, or each change has `most` joints. What is done by then stays in the file; the same
    call goes on.

    Parameters
    ----------
    path : Path
        Result file of a campaign whose joints are drawn from tolerances.
    work : Work
        Workers, folder, progress and messages.
    by : str, optional
        Load whose limit orders the lines; by default all limits together, or the only one.
    each : {"entry", "feature", "error"}
        With --run: a line is an entry of [tolerances], a pin with its hole, or an error.
    group : list of str, optional
        With --run: also change these errors together; repeatable.
    budget : float
        With --run: time limit, with unit s, min or h; 5 min unless given.
    most : int
        With --run: largest number of joints of each change.
    costs : Path, optional
        As in `errors.causes`; a fault of the table is told before anything is simulated.

    Returns
    -------
    list of Path
        The file.

    Raises
    ------
    InputError
        With every fault of `group`, or when there is no such load.
    StoreError
        When the file cannot be used, was made by other code, or has too few valid joints for causes by error.
    """
    with Writer.open(path) as store, kept_workers():
        view = View(store)
        check_sample(view)
        load = by or view.decisive
        shares.check_scatter(view, view.load(load))
        if costs is not None:
            prices_of(scaling.tolerances(view.study), view.mechanism, costs)
        sets.check_code(store)
        lines = [*LINES[each](view.study), *widths.named(view.study, group or ())]
        if not lines:
            remedy = 'name what a study can change: --group "tilts = pin*.tilt_*, hole*.tilt_*"'
            raise store_error(path, "has no line that can be changed", remedy)
        work.tell("each change is one line of the drawing; all else of the joint stays as drawn")
        # at the points that the load, a limit or joints in the file are about; at all of them if there is no limit
        loads = [*(() if load == ANY_LIMIT else (load,)), *(view.limits or ("",))]
        loads += [name for change in view.altered.values() for name in change.names]
        simulation = Simulation(store, view, work, loads)
        work.tell(_Looks(simulation, view, lines, load, budget, most).run())
    return [path]


class _Looks:
    """Looks at the order of the lines, each with more joints of the changes than the one before."""

    def __init__(
        self, simulation: Simulation, view: View, lines: Sequence[Group], load: str, budget: float, most: int
    ) -> None:
        self._simulation, self._budget, self._end, self._most = simulation, budget, time.monotonic() + budget, most
        self._view, self._lines, self._load, self._own = view, lines, load, own_joints(view)
        self._looks, self._is_cut = 0, False

    @property
    def _left(self) -> float:
        return self._end - time.monotonic()

    def run(self) -> str:
        """Look until the order is settled, then bring the other steps to as many joints; returns what was done."""
        # those of the campaign at first, fewer if half of the budget does not suffice for them
        changes = sum(len(widths.steps(self._view.study, line)) + 0.5 for line in self._lines) + 1.0
        affordable = int(0.5 * self._budget / (self._simulation.seconds * changes))
        n = max(LEAST, min(self._own if LEAST < self._own < FIRST else FIRST, affordable, self._most))
        confidence = 1.0 - 0.05 / (1 + math.ceil(math.log2(max(self._most / n, 1.0))))
        is_settled = self._look(n, confidence)
        while not is_settled:
            affordable = n + int(0.9 * self._left / (self._simulation.seconds * (len(self._lines) + 1.0)))
            more = min(2 * n, affordable, self._most)
            if more <= 1.1 * n:
                break
            n, is_settled = more, self._look(more, confidence, decisive=True)
        if self._simulation.simulated and self._left > 0.0:
            is_settled = self._look(n, confidence)
        more_of = "a larger --most" if n >= self._most else "a longer --budget"
        order = "settled" if is_settled else f"not settled: {more_of} goes on"
        done = f"simulated {text.several(self._simulation.simulated, 'joint')} in {self._budget - self._left:.0f} s"
        return f"{done}, {'up to ' if self._is_cut else ''}{n} of each change; order of lines {order}"

    def _look(self, n: int, confidence: float, decisive: bool = False) -> bool:
        """Simulate what is missing of `n` joints of each line after all its steps, or after its `decisive` one.

        Returns
        -------
        bool
            Whether the order of the lines is settled then.
        """
        self._looks += 1
        before, left, wanted = self._simulation.simulated, self._left, self._wanted(n, decisive)
        about = f"{len(self._lines)} lines, {n} joints of each change: "
        self._is_cut = self._simulation.run(wanted, f"look {self._looks}", about, self._end) > 0
        if (done := self._simulation.simulated - before) > RELIABLE:
            self._simulation.seconds = (left - self._left) / done
        return shares.Joints(self._view, self._load, self._simulation.altered).settled(self._lines, confidence)

    def _wanted(self, n: int, decisive: bool) -> list[sets.Change]:
        """Sets of a look, what the order needs first."""
        study, lines = self._view.study, self._lines
        wanted = [sets.as_drawn(study, range(self._own, n))] if n > self._own else []
        if decisive:
            joints = shares.Joints(self._view, self._load, self._simulation.altered)
            return wanted + [sets.stepped(study, line, joints.decisive(line)[0], range(n)) for line in lines]
        changes = [(line, step) for line in lines for step in widths.steps(study, line)]
        changes.sort(key=lambda change: widths.STEPS.index(change[1]) if change[1] in widths.STEPS else 0)
        wanted += [sets.stepped(study, line, step, range(n)) for line, step in changes]
        for line in lines:
            inside = np.array([name in line.names for name in study.copula.names], bool)
            if not study.copula.matrix[inside][:, ~inside].any():  # else an exchange would break the correlation
                wanted.append(sets.exchanged(study, line, range(n // 2)))
        return wanted
