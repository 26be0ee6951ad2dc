"""Jobs of a comparison: every contender on every joint."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from tolstat.benchmarks.integrators import EQUAL_STEPS, both_ways, has_exudyn
from tolstat.benchmarks.joints import choose
from tolstat.benchmarks.precision.setup import Setup
from tolstat.benchmarks.runs import TRUTH, Job, OtherJob, OwnJob, TruthJob
from tolstat.common.tables import Fidelity, Method, Options
from tolstat.study import Study

METHOD_NAMES = {"bdf2": "BDF2", "generalized_alpha": "generalised-α", "tr_bdf2": "TR-BDF2"}
IDEAL_STEPS = 90
"""Steps a revolution of the ideal joint, whose error does not depend on them: the nearest setting is taken."""


def jobs(setup: Setup, base: Study, say: Callable[[str], None]) -> Iterator[Job]:
    """All jobs of a comparison, those that take longest first.

    Parameters
    ----------
    setup : Setup
        The comparison.
    base : Study
        Study that the joints are drawn from.
    say : callable
        Called with a message where Exudyn is asked for and not installed: it is left out.
    """
    options = base.solver.options()
    params, count = choose(base, setup.joints, setup.seed, setup.tolstat.block)
    rows = [(i, params[i : i + 1]) for i in range(count)]
    yield from (TruthJob(TRUTH, setup.truth.rtol, row, options, i) for i, row in rows)
    others = setup.others
    codes = [code for code in others.codes if code != "Exudyn" or has_exudyn()]
    if len(codes) < len(others.codes):
        say('Exudyn is left out: it is not installed (pip install "tolstat[bench]")')
    for one in both_ways(codes):
        ladder = others.steps_per_rev if one.code in EQUAL_STEPS else others.rtol
        for i, row in rows:
            yield OtherJob(str(one), one, tuple(map(float, ladder)), row, options, i, others.revolutions, others.limit)
    own = own_settings(setup, options)
    for name, levels in own.items():
        yield from (OwnJob(name, levels, row, i, setup.repeats, 1) for i, row in rows)
    name, levels = next(iter(own.items()))
    yield OwnJob(f"{name}, {len(params)} joints at once", levels, params, 0, setup.repeats, count)


def own_settings(setup: Setup, options: Options) -> dict[str, tuple[Options, ...]]:
    """Settings of each curve of tolstat, by its name."""
    own = setup.tolstat
    ladders: dict[str, tuple[Options, ...]] = {}
    steps = [options._replace(steps_per_rev=n) for n in own.steps_per_rev]
    for fidelity in own.fidelities:
        level = [o._replace(fidelity=int(Fidelity[fidelity.upper()])) for o in steps]
        if fidelity == "dynamic":
            for method in own.methods:
                ladders[METHOD_NAMES[method]] = tuple(o._replace(method=int(Method[method.upper()])) for o in level)
        elif fidelity == "quasistatic":
            ladders["quasistatic"] = tuple(level)
        else:
            ladders["ideal joint"] = (min(level, key=lambda o: abs(o.steps_per_rev - IDEAL_STEPS)),)
    return ladders
