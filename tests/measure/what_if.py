"""Fresh joints against the tornado: ``python -m tests.measure.what_if FILE JOINTS COUNTS``.

FILE is a campaign whose joints with one line changed are simulated (``tolstat causes FILE --run``). For each line and
each change of it, JOINTS joints are drawn with another seed and simulated. A value of FILE misses if the interval of
its difference from these excludes zero, recovered from the intervals of both (Zou and Donner 2008). COUNTS, a JSON
file, keeps the counts after each batch of all changes; the same command goes on, also with more JOINTS.
"""

from __future__ import annotations

import json
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.stats
from numpy.typing import NDArray

import tolstat
from tolstat.analysis.binomial import clopper_pearson
from tolstat.campaign import what_if as sets
from tolstat.common.loads import ANY_LIMIT, LOADS
from tolstat.common.tables import VALID
from tolstat.joint import perturb
from tolstat.questions.causes.shares import evaluate
from tolstat.solver.compilation import warm_up
from tolstat.solver.simulation import simulate_rows
from tolstat.study import widths

BLOCK, BATCH = 500, 2000
"""Joints of a task, and joints of each change after which the counts are saved."""
SEED = 90_000
"""Seed of the first change; each has its own, none that of a study."""


class Job(NamedTuple):
    """Joints of a line after a step."""

    line: str
    step: str
    seed: int
    numbers: range


@cache
def _campaign(path: Path) -> tuple[Any, Any, dict[str, float]]:
    with tolstat.open(path) as store:
        view = store.view()
        return view.study, sets.options_of(view.study, store), dict(view.limits)


def simulate(path: Path, job: Job) -> NDArray[np.int64]:
    """Joints above each limit, above at least one, and without a valid load; (limits + 2,)."""
    study, options, limits = _campaign(path)
    fresh = replace(study, sampling=study.sampling.model_copy(update={"seed": job.seed}))
    line = next(one for one in widths.lines(study) if one.label == job.line)
    change = sets.stepped(fresh, line, job.step, job.numbers)
    results = simulate_rows(perturb(change.study.joint, study.operation, change.draw(job.numbers)), options).results
    valid = np.isin(results["status"], VALID)
    above = np.column_stack([LOADS[name].of(results) > level for name, level in limits.items()]) & valid[:, None]
    return np.array([*above.sum(axis=0), above.any(axis=1).sum(), (~valid).sum()])


def count(path: Path, joints: int, kept: Path) -> dict[str, list[int]]:
    """Counts of each change, ``line|step``: those of `simulate`, then the number of joints."""
    study, _, limits = _campaign(path)
    changes = [(line.label, step) for line in widths.lines(study) for step in widths.steps(study, line)]
    found: dict[str, list[int]] = json.loads(kept.read_text()) if kept.exists() else {}
    found = {f"{line}|{step}": found.get(f"{line}|{step}", [0] * (len(limits) + 3)) for line, step in changes}
    warm_up()
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        for end in range(BATCH, joints + 1, BATCH):
            jobs = [
                Job(line, step, SEED + place, range(first, min(first + BLOCK, end)))
                for place, (line, step) in enumerate(changes)
                for first in range(found[f"{line}|{step}"][-1], end, BLOCK)
            ]
            for job, counts in zip(jobs, pool.map(partial(simulate, path), jobs), strict=True):
                old = found[f"{job.line}|{job.step}"]
                found[f"{job.line}|{job.step}"] = (np.array(old) + np.array([*counts, len(job.numbers)])).tolist()
            kept.write_text(json.dumps(found))
            print(f"{end} joints of each of {len(changes)} changes", file=sys.stderr, flush=True)
    return found


def compare(path: Path, found: dict[str, list[int]]) -> None:
    """Print each value of all limits beside that of the fresh joints, and the misses of each load."""
    with tolstat.open(path) as store:
        view = store.view()
        names = [*view.limits, ANY_LIMIT]
        tornados = {name: evaluate(view, name) for name in names}
    misses = dict.fromkeys(names, 0)
    values = 0
    print("| line | step | joints of the file | from the file, % | fresh joints | of these, % | |\n" + "|---" * 7 + "|")
    for place, name in enumerate(names):
        tornado = tornados[name]
        assert tornado is not None, f"{path} holds no joints with a line changed"
        for row in tornado.rows:
            above, failed, n = (found[f"{row['line']}|{row['step']}"][k] for k in (place, -2, -1))
            share = above / (n - failed)
            low, high = float(clopper_pearson(above, n)[0]), float(clopper_pearson(above + failed, n)[1])
            below = np.hypot(row["share"] - row["share_lower"], high - share)
            beyond = np.hypot(row["share_upper"] - row["share"], share - low)
            missed = not row["share"] - below <= share <= row["share"] + beyond
            misses[name] += missed
            if name == ANY_LIMIT:
                values += 1
                own = f"{100 * row['share']:.1f} ({100 * row['share_lower']:.1f} .. {100 * row['share_upper']:.1f})"
                line = f"| `{row['line']}` | {row['words']} | {row['n']} | {own} | {n} | {100 * share:.2f} |"
                print(f"{line} {'misses' if missed else ''} |")
    one, every = (int(scipy.stats.binom.ppf(0.999, n, 0.05)) for n in (values, values * len(names)))
    print(f"\nvalues that miss, of {values} for each load; 99.9 % of binomial counts with 5 % are at most {one}:")
    print(", ".join(f"{name} {missed}" for name, missed in misses.items()))
    print(f"together {sum(misses.values())} of {values * len(names)}, {every} if they were independent")


def main() -> None:
    """Simulate what COUNTS lacks, and compare."""
    path, joints, kept = Path(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    compare(path, count(path, joints, kept))


if __name__ == "__main__":
    main()
