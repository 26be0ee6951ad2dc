"""The file of a work-precision study: which joints, which settings, which competitors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tolstat import joint, sampling, study
from tolstat.benchmarks.work_precision.competitors import Code, check_installed
from tolstat.common import strict
from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import Strict
from tolstat.study import Study

Tolerance = Annotated[float, Field(ge=1e-12, le=0.1)]
Count = Annotated[int, Field(strict=True, ge=1, le=1000)]
Steps = Annotated[int, Field(strict=True, ge=12, le=20_000)]


class Own(Strict):
    """``[tolstat]``: settings of the solver. `block`: number of joints simulated together for the curve "at once"."""

    fidelities: Annotated[tuple[Literal["dynamic", "quasistatic", "ideal"], ...], Field(min_length=1)]
    methods: Annotated[tuple[Literal["bdf2", "generalized_alpha", "tr_bdf2"], ...], Field(min_length=1)]
    steps_per_rev: Annotated[tuple[Steps, ...], Field(min_length=1)]
    block: Count


class Others(Strict):
    """``[others]``: the competitors and their tolerances, loosest first. `limit`: largest CPU time of a run, s."""

    codes: tuple[Code, ...]
    rtol: Annotated[tuple[Tolerance, ...], Field(min_length=1)]
    revolutions: Annotated[int, Field(strict=True, ge=1, le=100)]
    limit: Annotated[float, Field(gt=0, le=3600)]


class Truth(Strict):
    """``[truth]``: relative tolerance of the reference, and the looser one that it is compared with."""

    rtol: tuple[Tolerance, Tolerance]


class Setup(Strict):
    """A work-precision study.

    Attributes
    ----------
    study : str
        Study that the joints are drawn from; relative to the setup's folder.
    joints : int
        Random joints, beside the nominal one if the study has it.
    seed : int
        Seed of the choice of these joints.
    repeats : int
        Timings of tolstat; the median counts.
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
        """Reduced setup: to check that the study runs, not for the numbers."""
        own = self.tolstat.model_copy(update={"steps_per_rev": self.tolstat.steps_per_rev[1::3]})
        others = self.others.model_copy(update={"rtol": self.others.rtol[:3:2], "limit": min(self.others.limit, 2.0)})
        truth = Truth(rtol=(1e-6, 1e-5))
        return self.model_copy(update={"joints": 1, "repeats": 3, "tolstat": own, "others": others, "truth": truth})


def load(path: Path, quick: bool = False) -> tuple[Setup, Study]:
    """Read a setup and the study that it names.

    Raises
    ------
    InputError
        With every fault of the setup, or of the study.
    """
    setup = strict.validate(Setup, strict.read_toml(path), str(path))
    base = study.load(path.parent / setup.study)
    first = int(base.sampling.nominal_first)
    if base.listed is not None:
        raise InputError([Fault(f"{path}: study", f"{setup.study} lists its joints", "name one that draws them")])
    if setup.joints > base.rows - first:
        found = f"{setup.joints} of the {base.rows - first} joints of {setup.study}"
        raise InputError([Fault(f"{path}: joints", found, "give fewer joints, or another study")])
    check_installed(setup.others.codes)
    return setup.quick() if quick else setup, base


def parameters(setup: Setup, base: Study) -> NDArray[np.void]:
    """Parameters, PARAM, of the joints with measured errors, then of further joints of the study to fill the block."""
    first = int(base.sampling.nominal_first)
    drawn = first + np.random.default_rng(setup.seed).permutation(base.rows - first)
    rows = np.concatenate([np.arange(first), drawn])[: max(setup.tolstat.block, first + setup.joints)]
    return joint.perturb(base.joint, sampling.draw(base)[rows])


def measured(setup: Setup, base: Study) -> int:
    """Number of joints with measured errors: the first ones of `parameters`."""
    return setup.joints + int(base.sampling.nominal_first)
