"""A comparison, as its file says, and its jobs: which joints, which settings of tolstat, which other integrators."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from studies.precision.integrators import EQUAL_STEPS, Code, both_ways, installed
from studies.precision.measuring import choose
from studies.precision.runs import TRUTH, Job, OtherJob, OwnJob, TruthJob
from tolstat import study
from tolstat.common import strict
from tolstat.common.strict import Strict
from tolstat.common.tables import Fidelity, Method, Options
from tolstat.study import Study

METHOD_NAMES = {"bdf2": "BDF2", "tr_bdf2": "TR-BDF2"}
IDEAL_STEPS = 90
"""Steps a revolution of the ideal joint, whose error does not depend on them: the nearest setting is taken."""

Tolerance = Annotated[float, Field(ge=1e-12, le=0.1)]
Count = Annotated[int, Field(strict=True, ge=1, le=1000)]
Steps = Annotated[int, Field(strict=True, ge=12, le=20_000)]


class Own(Strict):
    """``[tolstat]``: settings of the solver. `block`: number of joints simulated together for the curve "at once"."""

    fidelities: Annotated[tuple[Literal["dynamic", "quasistatic", "ideal"], ...], Field(min_length=1)]
    methods: Annotated[tuple[Literal["bdf2", "tr_bdf2"], ...], Field(min_length=1)]
    steps_per_rev: Annotated[tuple[Steps, ...], Field(min_length=1)]
    block: Count


class Others(Strict):
    """``[others]``: other integrators and their settings, loosest first. `limit`: largest CPU time of a run, s.

    `rtol`: tolerances; `steps_per_rev`: for codes with equal steps (Exudyn) instead.
    """

    codes: tuple[Code, ...]
    rtol: Annotated[tuple[Tolerance, ...], Field(min_length=1)]
    steps_per_rev: tuple[Steps, ...] = ()
    revolutions: Annotated[int, Field(strict=True, ge=1, le=100)]
    limit: Annotated[float, Field(gt=0, le=3600)]


class Truth(Strict):
    """``[truth]``: relative tolerance of the reference solution, and a looser one; their difference is its error."""

    rtol: tuple[Tolerance, Tolerance]


class Setup(Strict):
    """A comparison of tolstat with other integrators.

    Attributes
    ----------
    study : str
        Study that the joints are drawn from; path relative to the folder of the file.
    joints : int
        Number of random joints, beside the nominal one if the study has it.
    seed : int
        Seed of the choice of these joints.
    repeats : int
        Number of timings of tolstat; the median counts.
    tolstat, others, truth
        Tables of their own.
    """

    study: str
    joints: Count
    seed: Annotated[int, Field(strict=True, ge=0)]
    repeats: Count
    tolstat: Own
    others: Others
    truth: Truth

    def quick(self) -> Setup:
        """Two joints and few settings: to check that everything runs, not for the numbers."""
        own = self.tolstat.model_copy(update={"steps_per_rev": self.tolstat.steps_per_rev[1::3]})
        fewer = {"rtol": self.others.rtol[:3:2], "steps_per_rev": self.others.steps_per_rev[:3:2]}
        others = self.others.model_copy(update={**fewer, "limit": min(self.others.limit, 2.0)})
        truth = Truth(rtol=(1e-6, 1e-5))
        return self.model_copy(update={"joints": 1, "repeats": 3, "tolstat": own, "others": others, "truth": truth})


def load(path: Path, quick: bool = False) -> tuple[Setup, Study]:
    """Read a comparison and the study that it names; with `quick`, the comparison is reduced (`Setup.quick`).

    Raises
    ------
    InputError
        With every fault of the comparison, or of the study.
    """
    data = strict.read_toml(path)
    with strict.lines_of(path):
        setup = strict.validate(Setup, data, str(path))
    return setup.quick() if quick else setup, study.load(path.parent / setup.study).at("")


def jobs(setup: Setup, base: Study, say: Callable[[str], None]) -> Iterator[Job]:
    """All jobs of a comparison, those that take longest first.

    Parameters
    ----------
    setup : Setup
        The comparison.
    base : Study
        Study that the joints are drawn from.
    say : callable
        Called with a message where integrators are left out because they are not installed.
    """
    options = base.solver.options()
    params, count = choose(base, setup.joints, setup.seed, setup.tolstat.block)
    rows = [(i, params[i : i + 1]) for i in range(count)]
    yield from (TruthJob(TRUTH, setup.truth.rtol, row, options, i) for i, row in rows)
    others = setup.others
    codes = [code for code in others.codes if installed(code)]
    if len(codes) < len(others.codes):
        say(f'{", ".join(set(others.codes) - set(codes))} left out: not installed (pip install ".[bench]")')
    for one in both_ways(codes):
        ladder = others.steps_per_rev if one.code in EQUAL_STEPS else others.rtol
        for i, row in rows:
            yield OtherJob(str(one), one, tuple(map(float, ladder)), row, options, i, others.revolutions, others.limit)
    own = own_settings(setup, options)
    for name, levels in own.items():
        yield from (OwnJob(name, levels, row, i, setup.repeats, 1) for i, row in rows)
    name, levels = next(iter(own.items()))
    alone = tuple(level._replace(peak_substeps=1, max_refinements=0) for level in levels)
    for block, settings in ((name, levels), (f"{name} uniform", alone)):
        yield OwnJob(f"{block}, {len(params)} joints at once", settings, params, 0, setup.repeats, count)


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
