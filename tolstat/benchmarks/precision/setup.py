"""A comparison, as its file says: which joints, which settings of tolstat, which other integrators."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from tolstat import study
from tolstat.benchmarks.integrators import EQUAL_STEPS, Code, has_cvode
from tolstat.common import strict
from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import Strict
from tolstat.study import Study

Tolerance = Annotated[float, Field(ge=1e-12, le=0.1)]
Count = Annotated[int, Field(strict=True, ge=1, le=1000)]
Steps = Annotated[int, Field(strict=True, ge=12, le=20_000)]


class Own(Strict):
    """``[tolstat]``: settings of tolstat. `block`: number of joints simulated together for the curve "at once"."""

    fidelities: Annotated[tuple[Literal["dynamic", "quasistatic", "ideal"], ...], Field(min_length=1)]
    methods: Annotated[tuple[Literal["bdf2", "generalized_alpha", "tr_bdf2"], ...], Field(min_length=1)]
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
        base = study.load(path.parent / setup.study).at("")
        first = base.first_sample
        if base.variants:
            raise InputError([Fault(f"{path}: study", f"{setup.study} lists its joints", "name one that draws them")])
        if setup.joints > base.rows - first:
            found = f"{setup.joints} of the {base.rows - first} joints of {setup.study}"
            raise InputError([Fault(f"{path}: joints", found, "give fewer joints, or another study")])
        if "CVODE" in setup.others.codes and not has_cvode():
            hint = 'pip install "tolstat[bench]", or leave CVODE out'
            raise InputError([Fault(f"{path}: others.codes", "CVODE needs scikit-sundae", hint)])
        if set(EQUAL_STEPS) & set(setup.others.codes) and not setup.others.steps_per_rev:
            hint = "give them, such as [180, 360], or leave Exudyn out"
            raise InputError([Fault(f"{path}: others.steps_per_rev", "Exudyn needs steps a revolution", hint)])
    return setup.quick() if quick else setup, base
