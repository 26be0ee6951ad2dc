"""Is the result of `tolstat allocate` cheap? A grid over some lines of a drawing, simulated with other joints.

    python -m tests.measure.allocation FILE.h5 --target "P(any limit) < 0.05" --line "pin*.diameter"

FILE is a campaign with a finished `allocate` for this target and these `--keep`. All other lines stay as proposed. Each
design of the grid is simulated with joints of another seed, a quarter of them where these show that it misses; those
whose 95 % interval lies below the target are feasible. Prints their shares and costs, and how far the proposal is from
the cheapest of them.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
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
TILTS = ("pin*.tilt_[tz]", "hole*.tilt_[tz]")
"""Lines of the main job."""


def measure(
    path: Path, target: str, keep: Sequence[str], labels: Sequence[str], steps: int, joints: int, work: Work
) -> None:
    """Simulate the grid, the cheapest designs first, until the cheapest feasible one is known."""
    with Writer.open(path) as store, kept_workers():
        view = View(store)
        request = question._read_request(view, [target], None, keep, question.MOST)
        found = question._Run(view, request, view.altered)
        (statement,), ladders, design = request.statements, request.ladders, found.search.design
        lines = [[own.line.label for own in ladders].index(label) for label in labels]
        simulation = Simulation(store, view, work, statement.limit.loads)
        print(f"proposal: {found.words(design)}; cost {found.problem.cost(design):.4g}; {found.state}")
        grid = []
        for moves in product(range(-steps, steps + 1), repeat=len(lines)):
            other = list(design)
            for i, move in zip(lines, moves, strict=True):
                other[i] += move
            if all(0 <= k < len(own.rungs) for k, own in zip(other, ladders, strict=True)):
                grid.append(tuple(other))
        best = float("inf")
        for other in sorted(grid, key=found.problem.cost):
            cost = found.problem.cost(other)
            if cost > best:
                break
            text = ladder.text_of(view.study, list(zip(ladders, other, strict=True)), SEED)
            changed = changes.read(view.study, text)
            for n in (joints // 4, joints):
                change = sets.with_study(view.study, changed, found.words(other), range(n))
                simulation.run([change], "grid")
                values = ChangedJoints(view, statement.limit, simulation.altered).of(change.about)
                assert values is not None
                n = min(len(values), joints)
                above = int((~(values[:n] <= statement.limit.level)).sum())
                low, high = clopper_pearson(above, n)
                if low > statement.bound:
                    break
            words = ", ".join(ladders[i].rungs[other[i]].words for i in lines)
            feasible = float(high) < statement.bound
            best = min(best, cost) if feasible else best
            print(
                f"{words:32} cost {cost:6.4g}  {above / n:6.2%} of {n} ({low:.2%} .. {high:.2%}) {'kept' * feasible}",
                flush=True,
            )
        print(f"cheapest of the grid {best:.4g}; the proposal costs {found.problem.cost(design) / best - 1.0:+.1%}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--target", default="P(any limit) < 0.05")
    parser.add_argument("--keep", action="append", default=[], metavar="PATTERN", help="as given to allocate")
    parser.add_argument("--line", action="append", metavar="LINE", help="of the grid; repeatable; default: tilts")
    parser.add_argument("--steps", type=int, default=3, help="of each line to either side of the proposal")
    parser.add_argument("--joints", type=int, default=4096, help="of each design")
    parser.add_argument("--workers", type=int, help="processes; default: one per core")
    given = parser.parse_args()
    lines, work = given.line or TILTS, Work(workers=given.workers)
    measure(given.file, given.target, given.keep, lines, given.steps, given.joints, work)
