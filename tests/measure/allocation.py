"""Is the result of `tolstat allocate` cheap? A grid over the tilts of the main job, simulated with other joints.

    python -m tests.measure.allocation FILE.h5 --target "P(any limit) < 0.05"

FILE is a campaign of studies/iso2768_f.toml with a finished `allocate` for this target. All lines but the tilts stay as
proposed. Each design of the grid is simulated with joints of another seed; those whose 95 % interval lies below the
target are feasible. Prints their shares and costs, and how far the proposal is from the cheapest of them.
"""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path

from tolstat.analysis.binomial import clopper_pearson
from tolstat.campaign import what_if as sets
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.work import Work
from tolstat.questions import allocate as question
from tolstat.questions.shares import ChangedJoints, Simulation
from tolstat.store import Writer
from tolstat.store.view import View
from tolstat.study import changes, ladder

SEED = 77
STEPS = range(-3, 4)
"""Steps of the grid from the proposal."""


def measure(path: Path, target: str, joints: int) -> None:
    """Simulate the grid, the cheapest designs first, until the cheapest feasible one is known."""
    with Writer.open(path) as store, kept_workers():
        view = View(store)
        request = question._read_request(view, [target], None, (), question.MOST)
        found = question._Run(view, request, view.altered)
        (statement,), ladders, design = request.statements, request.ladders, found.search.design
        tilts = [i for i, own in enumerate(ladders) if ".tilt_" in own.line.label]
        simulation = Simulation(store, view, Work(), statement.limit.loads)
        print(f"proposal: {found.words(design)}; cost {found.problem.cost(design):.4g}; {found.state}")
        grid = []
        for moves in product(STEPS, repeat=len(tilts)):
            other = list(design)
            for i, move in zip(tilts, moves, strict=True):
                other[i] += move
            if all(0 <= k < len(own.rungs) for k, own in zip(other, ladders, strict=True)):
                grid.append(tuple(other))
        best = float("inf")
        for other in sorted(grid, key=found.problem.cost):
            cost = found.problem.cost(other)
            if cost > best:
                break
            text = ladder.text_of(view.study, list(zip(ladders, other, strict=True)), SEED)
            change = sets.with_study(view.study, changes.read(view.study, text), found.words(other), range(joints))
            simulation.run([change], "grid")
            values = ChangedJoints(view, statement.limit, simulation.altered).of(change.about)
            assert values is not None
            above = int((~(values[:joints] <= statement.limit.level)).sum())
            low, high = clopper_pearson(above, joints)
            words = ", ".join(ladders[i].rungs[other[i]].words for i in tilts)
            feasible = float(high) < statement.bound
            best = min(best, cost) if feasible else best
            print(
                f"{words:24} cost {cost:6.4g}  {above / joints:6.2%} ({low:.2%} .. {high:.2%}) {'kept' * feasible}",
                flush=True,
            )
        print(f"cheapest of the grid {best:.4g}; the proposal costs {found.problem.cost(design) / best - 1.0:+.1%}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--target", default="P(any limit) < 0.05")
    parser.add_argument("--joints", type=int, default=4096)
    given = parser.parse_args()
    measure(given.file, given.target, given.joints)
