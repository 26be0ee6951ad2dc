"""Probabilities of rare loads by subset simulation: its levels are rows of a result file, stage after stage.

A stage is what can be simulated at once: all joints of level 0, or one step of all chains. Before each the file grows
by its joints, pending, and a campaign simulates them. Nothing else is kept: which joints come next follows from the
study and the loads in the file, so that a run that was stopped goes on where it was.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from tolstat import sampling
from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.subset import Candidates, Estimate, Level, Settings, Walk
from tolstat.campaign import run as campaign
from tolstat.campaign.blocks import Execution
from tolstat.campaign.extend import grow
from tolstat.campaign.progress import note
from tolstat.common.draw_records import SUBSET
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.tables import VALID
from tolstat.store import ResultStore
from tolstat.store.view import load
from tolstat.study import Study, subset_of
from tolstat.study.model import Subset
from tolstat.study.selection import limit_of

MANY = 2000
"""Joints of a stage from which on it is worth starting worker processes: some seconds of work."""
_LIMIT = re.compile(r"\s*(?P<load>[^\s>]+)\s*>\s*(?P<level>.+?)\s*")


class Found(NamedTuple):
    """What a subset simulation came to.

    Attributes
    ----------
    sampling : Subset
        The question, and how it was put.
    levels : list of Level
        See `analysis.subset.Level`; loads in SI units.
    reached : bool
        Whether the levels reached the limit.
    estimate : Estimate
        The probability.
    joints : int
        Joints simulated, the nominal one not counted.
    unresolved : int
        Joints among them without a valid load.
    unresolved_first : int
        Joints among those of level 0, which are drawn at random, without a valid load.
    """

    sampling: Subset
    levels: list[Level]
    reached: bool
    estimate: Estimate
    joints: int
    unresolved: int
    unresolved_first: int

    @property
    def as_sure_as(self) -> float:
        """Number of joints drawn at random that would be as sure of the probability; NaN where it is not known."""
        p, deviation = self.estimate.probability, self.estimate.deviation
        return (1.0 - p) / (p * deviation**2) if deviation > 0 else math.nan

    @property
    def upper_if_above(self) -> float:
        """Most that the probability can be if all joints without a valid load are above, as far as level 0 tells."""
        return min(1.0, self.estimate.upper + self.unresolved_first / self.sampling.per_level)


def parse(text: str) -> tuple[str, float]:
    """Load and level (SI) that ``"cross1.F > 900 N"`` asks about.

    Raises
    ------
    InputError
        When it is something else.
    """
    found = _LIMIT.fullmatch(text)
    if found is None:
        raise InputError([Fault("--limit", f"{text!r} is no limit", 'write --limit "cross1.F > 900 N"')])
    return found["load"], limit_of(found["load"], found["level"], "--limit")


def asked(
    study: Study,
    limit: str,
    n: int = 1000,
    p0: float = 0.1,
    seed: int | None = None,
    unresolved: Literal["above", "below"] = "below",
) -> Study:
    """Make the study of a subset simulation.

    Parameters
    ----------
    study : Study
        Its tolerances hold; its number of joints and its limits are of no account.
    limit : str
        Load and level, ``"cross1.F > 15 kN"``.
    n : int
        Joints a level.
    p0 : float
        Share of them that is carried to the next level; ``n * p0`` is a whole number.
    seed : int, optional
        Instead of the study's.
    unresolved : {"above", "below"}
        Where joints without a valid load are counted.

    Returns
    -------
    Study
        For `run`.

    Raises
    ------
    InputError
        With every fault of the question.
    """
    load, above = parse(limit)
    own = {} if seed is None else {"seed": seed}
    fields = {"load": load, "above": above, "per_level": n, "p0": p0, "unresolved": unresolved}
    return subset_of(study, fields | own)


def of_study(study: Study, limit: str, out: str | Path, workers: int | None = None, **question: Any) -> Found:
    """Estimate the probability of a rare load by subset simulation.

    Parameters
    ----------
    study : Study
        The study.
    limit : str
        Load and level, ``"cross1.F > 15 kN"``.
    out : str or Path
        Result file; one of the same question is gone on with.
    workers : int, optional
        As in `run`.
    **question
        ``n``, ``p0``, ``seed`` and ``unresolved`` of `asked`.

    Returns
    -------
    Found

    Raises
    ------
    InputError
        With every fault of the question.
    StoreError, Interrupted, WorkerDied
        As `run`.

    Examples
    --------
    >>> found = tolstat.rare_event(study, "cross1.F > 850 N", path, n=100, p0=0.5)
    >>> found.estimate.lower < 0.0668 < found.estimate.upper  # the load is normal: 700 N, standard deviation 100 N
    True
    """
    return run(asked(study, limit, **question), Path(out), workers)


def run(plan: Study, out: Path, workers: int | None = None, tell: Callable[[str], None] = note) -> Found:
    """Carry a subset simulation through, or on.

    Parameters
    ----------
    plan : Study
        As `asked` makes it.
    out : Path
        Result file; made if it does not exist, otherwise gone on with.
    workers : int, optional
        Processes for each stage, which change no number. Without it stages of few joints stay in this process, which
        nothing then protects from a joint that crashes.
    tell : callable, optional
        Told of each level that is complete.

    Returns
    -------
    Found

    Raises
    ------
    StoreError
        When the file is of another question, or was begun by other code.
    Interrupted, WorkerDied
        As `campaign.run`; the same call goes on.
    """
    question = plan.sampling
    assert isinstance(question, Subset)
    walk = Walk(Settings(question.per_level, question.p0, question.above), lambda *which: _noise(plan, *which))
    unresolved: list[int] = []
    first, told = int(question.nominal_first), 0
    held = _rows(out) or first + question.per_level
    _simulate(plan, out, held, held, workers, tell)  # which also finds out that the file is of another question
    while not walk.done:
        stage = range(first, first + walk.next.parent.size)
        if held < stage.stop:
            held = stage.stop
            _append(plan, out, stage, walk.next)
            _simulate(plan, out, held, len(stage), workers, tell)
        loads, lost = _loads(question, out, stage, walk.next)
        unresolved.append(lost)
        walk.take(loads)
        first = stage.stop
        for number, level in enumerate(walk.levels[told:], told):
            tell(f"level {number}: {level.joints} joints, {level.share:.3g} of them beyond the next threshold")
        told = len(walk.levels)
    joints = first - int(question.nominal_first)
    return Found(question, walk.levels, walk.reached, walk.estimate(), joints, sum(unresolved), unresolved[0])


def _noise(plan: Study, level: int, first: int, count: int) -> FloatArray:
    """Scores of level 0, what moves them at the others."""
    if level == 0:
        return sampling.scores(plan, range(first, first + count))
    return sampling.noise(plan, level, first, count)


def _rows(out: Path) -> int:
    if not out.exists():
        return 0
    with ResultStore.open(out) as store:
        return store.n


def _sized(plan: Study, rows: int) -> Study:
    """The study with so many rows."""
    n = rows - int(plan.sampling.nominal_first)
    return replace(plan, sampling=plan.sampling.model_copy(update={"n": n}))


def _simulate(plan: Study, out: Path, rows: int, count: int, workers: int | None, tell: Callable[[str], None]) -> None:
    """Simulate the rows of the file that are pending, some `count` of them."""
    execution = Execution(workers=workers)
    if workers is None and count < MANY:
        execution = Execution("serial", 1, block=count)
    campaign.run(_sized(plan, rows), out, execution=execution, tell=tell, check=False)


def _append(plan: Study, out: Path, stage: range, joints: Candidates) -> None:
    """Give the file the joints of a stage, pending."""
    origin = np.empty(len(stage), SUBSET)
    origin["level"], origin["parent"] = joints.level, joints.parent + int(plan.sampling.nominal_first)
    with ResultStore.open(out, "r+") as store:
        grow(store, _sized(plan, stage.stop), [sampling.from_scores(plan, joints.scores)], [origin])


def _loads(question: Subset, out: Path, stage: range, joints: Candidates) -> tuple[FloatArray, int]:
    """Loads of a stage, those that are not valid beyond every level or below, and how many these are."""
    rows = slice(stage.start, stage.stop)
    with ResultStore.open(out) as store:
        results, origin = store.results(rows), store.origin(rows)
    parent = np.where(joints.parent < 0, -1, joints.parent + int(question.nominal_first))
    if (origin["level"] != joints.level).any() or (origin["parent"] != parent).any():
        found = f"rows {stage.start}:{stage.stop} do not follow from the loads before them"
        raise StoreError(str(Fault(str(out), found, "run it anew with another --out")))
    values = load(results, question.load)[0].copy()
    lost = ~np.isin(results["status"], VALID) | ~np.isfinite(values)
    values[lost] = math.inf if question.unresolved == "above" else -math.inf
    return values, int(lost.sum())
