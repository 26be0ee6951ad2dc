"""``python -m tests.measure.other_tools [PART ...]``: OpenTURNS and SALib beside our own methods, on the main job.

Printed are tables of docs/functions.md: a rare load with equilibria at 36 angles, Sobol' indices of the lines of the
drawing, the processor time of ``f(x)`` beside that of a campaign of the same joints, and of joints one by one. Needs
the extra ``oracles``.
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import tolstat
import tolstat.campaign.function
from tests.support.environment import ROOT
from tolstat.analysis import binomial
from tolstat.campaign.work import Work
from tolstat.display.progress import silent
from tolstat.questions import rare
from tolstat.questions.causes import errors as causes
from tolstat.study import Study, load

MAIN = ROOT / "studies" / "iso2768_f.toml"
EQUILIBRIA = '\n[solver]\nfidelity = "quasistatic"\nsteps_per_rev = 36\n'
LOAD, LIMIT, PER_LEVEL, SEEDS = "cross1.F", 3000.0, 1000, 4
POINTS, JOINTS, ROUNDS, FORM_SAMPLE, FEW = 1024, 10_000, 3, 30_000, 240


def main(*parts: str) -> None:
    """Print the tables of these parts, by default of all: rare, form, sobol, cost, alone."""
    parts = parts or ("rare", "form", "sobol", "cost", "alone")
    equilibria, main_job = load(MAIN, text=MAIN.read_text("utf-8") + EQUILIBRIA), load(MAIN)
    if {"rare", "form"} & set(parts):
        print("| method | P | 95 % interval | joints |\n|---|---|---|---|")
    if "rare" in parts:
        ours_rare(equilibria)
        subset_simulation(equilibria)
    if "form" in parts:
        form(equilibria)
    if "sobol" in parts:
        print("\n| line | ours, alone | in all | SALib, alone | in all |\n|---|---|---|---|---|")
        sobol(main_job)
    if "cost" in parts:
        print(f"\nprocessor time of f(x) over that of a campaign, {JOINTS} joints: {cost(main_job)}")
    if "alone" in parts:
        print(f"\nprocessor time of {FEW} joints one by one over that of one call: {alone(main_job)}")


def line(name: str, p: float, lower: float, upper: float, joints: int) -> None:
    """Print a row of the table of methods."""
    print(f"| {name} | {1e6 * p:.0f} ppm | {1e6 * lower:.0f} .. {1e6 * upper:.0f} | {joints} |", flush=True)


def ours_rare(study: Study) -> None:
    """Subset simulation of ``tolstat rare``: each seed, and all of them."""
    with TemporaryDirectory() as folder:
        work = Work(workers=1, folder=Path(folder), tell=silent)
        paths = rare.simulate(study, work, f"{LOAD} > {LIMIT} N", PER_LEVEL, repeats=SEEDS)
        views = [tolstat.open(path).view() for path in paths]
        for own in (*([view] for view in views), views):
            facts = tolstat.rare(*own).facts
            joints = sum(view.store.n for view in own)
            line(f"tolstat rare, {len(own)} seeds", facts["probability"], facts["lower"], facts["upper"], joints)


def event(study: Study) -> tuple[tolstat.campaign.function.Function, Any]:
    """Function, and event of OpenTURNS."""
    import openturns as ot

    ot.Log.Show(ot.Log.NONE)
    f = tolstat.function(study, [LOAD], workers=1)
    function, errors = f.openturns()
    return f, ot.ThresholdEvent(ot.CompositeRandomVector(function, ot.RandomVector(errors)), ot.Greater(), LIMIT)


def subset_simulation(study: Study) -> None:
    """OpenTURNS' subset simulation, with levels as large as ours."""
    import openturns as ot

    found, joints = [], 0
    for seed in range(SEEDS):
        f, above = event(study)
        ot.RandomGenerator.SetSeed(seed)
        simulation = ot.SubsetSampling(above)
        simulation.setConditionalProbability(0.1)
        simulation.setBlockSize(100)
        simulation.setMaximumOuterSampling(PER_LEVEL // 100)
        simulation.run()
        result = simulation.getResult()
        p, half = result.getProbabilityEstimate(), 0.5 * result.getConfidenceLength(0.95)
        found.append((p, half))
        joints += f.simulated
        line("OpenTURNS, subset simulation", p, p - half, p + half, f.simulated)
    p, half = np.mean([p for p, _ in found]), np.sqrt(np.sum([half**2 for _, half in found])) / SEEDS
    line(f"OpenTURNS, subset simulation, {SEEDS} seeds", p, p - half, p + half, joints)


def form(study: Study) -> None:
    """FORM of OpenTURNS from the middle of the tolerances and from the most probable of some joints above."""
    import openturns as ot

    f = tolstat.function(study, [LOAD])
    _, errors = f.openturns()
    ot.RandomGenerator.SetSeed(0)
    sample = errors.getSample(FORM_SAMPLE)
    loads = f(np.array(sample))[:, 0]
    here = np.flatnonzero(loads > LIMIT)
    lower, upper = binomial.clopper_pearson(len(here), FORM_SAMPLE)
    line("random joints", len(here) / FORM_SAMPLE, float(lower), float(upper), FORM_SAMPLE)
    best = sample[int(here[np.argmax([errors.computeLogPDF(sample[int(i)]) for i in here])])]
    for start, first in (("the middle", errors.getMean()), ("a joint above", best)):
        for solver in (ot.AbdoRackwitz(), ot.SQP(), ot.Cobyla()):
            form_of(*event(study), solver, start, first)


def form_of(f: tolstat.campaign.function.Function, above: Any, solver: Any, start: str, first: Any) -> None:
    """Print the row of one optimiser and start."""
    import openturns as ot

    solver.setStartingPoint(first)
    solver.setMaximumIterationNumber(50)
    solver.setMaximumCallsNumber(5000)
    solver.setMaximumConstraintError(1e-3 * LIMIT)
    solver.setCheckStatus(False)
    name = f"OpenTURNS, FORM, {solver.getClassName()} from {start}"
    algorithm = ot.FORM(solver, above)
    try:
        algorithm.run()
    except RuntimeError as error:
        reason = str(error).partition(" at point")[0].partition("xception : ")[2]
        print(f"| {name} | none: {reason[:120]} | - | {f.simulated} |", flush=True)
        return
    result, joints = algorithm.getResult(), f.simulated
    at = f([list(result.getPhysicalSpaceDesignPoint())])[0, 0]
    beta, p = result.getHasoferReliabilityIndex(), result.getEventProbability()
    print(f"| {name} | {1e6 * p:.3g} ppm | beta {beta:.2f}, {at:.0f} N at the design point | {joints} |", flush=True)


def sobol(study: Study) -> None:
    """Pick-freeze design of ``tolstat causes``, and SALib's, of the logarithm of the load by lines of the drawing."""
    from SALib.analyze import sobol as analysis
    from SALib.sample import sobol as sample

    with TemporaryDirectory() as folder:
        (path,) = causes.simulate(study, Work(folder=Path(folder), tell=silent), points=POINTS)
        with tolstat.open(path) as store:
            ours = {
                row["error"]: row for row in tolstat.causes(store.view(), LOAD, logarithm=True).tables["errors"].rows
            }
    f = tolstat.function(study, [LOAD])
    entries = {name: entry.pattern for entry in study.entries for name in entry.quantities}
    problem = f.salib() | {"groups": [entries[name] for name in f.cube_names]}
    loads = np.log(f(f.uniform(sample.sample(problem, POINTS, calc_second_order=False, seed=1)))[:, 0])
    found = analysis.analyze(problem, loads, calc_second_order=False, seed=1)
    for i, name in enumerate(dict.fromkeys(problem["groups"])):
        row = ours[name]
        own = [
            f"{100 * row[key]:.1f} ({100 * row[f'{key}_lower']:.1f} .. {100 * row[f'{key}_upper']:.1f})"
            for key in ("first", "total")
        ]
        theirs = [f"{100 * found[key][i]:.1f} ± {100 * found[f'{key}_conf'][i]:.1f}" for key in ("S1", "ST")]
        print(f"| {' | '.join([name, *own, *theirs])} |")
    print(f"\n{len(loads)} joints each, {int(np.isnan(loads).sum())} of SALib's without a load")


def cost(study: Study) -> str:
    """Ratios of processor times, the two in turn, same joints and workers."""
    f = tolstat.function(study, workers=2)
    x = f.uniform(np.random.default_rng(1).random((JOINTS, len(f.cube_names))))
    whole = load(MAIN, n=JOINTS)
    ratios = []
    with TemporaryDirectory() as folder:
        for number in range(ROUNDS):
            path = Path(folder) / f"{number}.h5"
            campaign = seconds(lambda path=path: tolstat.run(whole, path, workers=2, check=False, tell=silent))
            ratios.append(seconds(lambda: f(x)) / campaign)
    return ", ".join(f"{ratio:.2f}" for ratio in ratios)


def alone(study: Study) -> str:
    """Ratios of processor times, the two in turn, in this process."""
    f = tolstat.function(study, workers=1)
    x = f.uniform(np.random.default_rng(2).random((FEW, len(f.cube_names))))
    f(x[:1])  # which loads the kernels
    ratios = [seconds(lambda: [f(row[None]) for row in x]) / seconds(lambda: f(x)) for _ in range(ROUNDS)]
    return ", ".join(f"{ratio:.1f}" for ratio in ratios)


def seconds(job: Callable[[], Any]) -> float:
    """Processor time of a job and of the processes that it starts, s."""

    def spent() -> float:
        each = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        return sum(own.ru_utime + own.ru_stime for own in each)

    begin = spent()
    job()
    return spent() - begin


if __name__ == "__main__":
    main(*sys.argv[1:])
