"""Probabilities of rare loads by subset simulation, with the joints of all levels in one result file.

A stage is a set of joints that can be simulated at once: all joints of level 0, or one step of all chains. Each stage
appends its joints to the file as pending rows, and a campaign simulates them. No other state is stored: the study and
the loads in the file determine the next joints, so that an interrupted run resumes where it stopped.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from tolstat import sampling
from tolstat.analysis import prediction
from tolstat.analysis.sample import is_valid
from tolstat.analysis.subset import Candidates, Estimate, Level, Walk
from tolstat.campaign import run as campaign
from tolstat.campaign.extend import grow
from tolstat.campaign.pool import kept_workers
from tolstat.common.draw_records import SUBSET
from tolstat.common.errors import Fault, StoreError
from tolstat.common.loads import FloatArray, Limit
from tolstat.common.shown import shown
from tolstat.display.progress import Reporter, note
from tolstat.questions.rare import numerical
from tolstat.store import ResultFile, Writer
from tolstat.store.recorded import differing_keys
from tolstat.study import Study, rule, subset_of
from tolstat.study.model import Subset

MIN_PARALLEL = 2000
"""Minimum number of joints of a stage for which several worker processes are started: some seconds of work."""
CONFIDENCE = 0.95
EXAMPLE = 'write --limit "cross1.F > 900 N"'


@shown
class RareEvent(NamedTuple):
    """Result of a subset simulation.

    Attributes
    ----------
    sampling : Subset
        Load and limit, and settings of the simulation.
    levels : list of Level
        See `analysis.subset.Level`; loads in SI units.
    reached : bool
        Whether the levels reached the limit.
    estimate : Estimate
        The probability.
    joints : int
        Number of joints simulated, the nominal one not counted.
    unresolved : int
        Number of these without a valid load.
    unresolved_first : int
        Number of joints of level 0 (drawn at random) without a valid load.
    ancestors : int
        Number of joints of level 0 that the joints above the limit descend from.
    wide : Estimate
        As `estimate`, with the confidence `analysis.prediction.half` for prediction intervals.
    numerical : tuple of float, optional
        Factors on the ends of the interval by the numerical error near the limit; None if it is not known.
    """

    sampling: Subset
    levels: list[Level]
    reached: bool
    estimate: Estimate
    joints: int
    unresolved: int
    unresolved_first: int
    ancestors: int
    wide: Estimate
    numerical: tuple[float, float] | None

    @property
    def as_sure_as(self) -> float:
        """Number of joints drawn at random that would give the same coefficient of variation; NaN if unknown."""
        p, deviation = self.estimate.probability, self.estimate.deviation
        return (1.0 - p) / (p * deviation**2) if deviation > 0 else math.nan

    def delivery(self, number: int) -> tuple[float, float]:
        """Prediction interval for the joints above the limit among `number` further ones, with the numerical error."""
        low, high = self.numerical or (1.0, 1.0)
        upper = min(1.0, self.wide.upper * high)
        return prediction.of_share(self.wide.lower * low, upper, number, CONFIDENCE)

    @property
    def upper_if_above(self) -> float:
        """Upper end if joints without a valid load are all above the limit, estimated by their share in level 0."""
        return min(1.0, self.estimate.upper + self.unresolved_first / self.sampling.per_level)


def parse_limit(text: str, limits: Mapping[str, float]) -> Limit:
    """Read a limit such as ``"cross*.F > 900 N"``; `limits` are those of the study, which ``"any limit"`` names.

    Raises
    ------
    InputError
        When the text is not of this form.
    """
    return rule.limit_of(text, limits, "--limit", EXAMPLE)


def subset_study(
    study: Study,
    limit: str,
    n: int = 1000,
    p0: float = 0.1,
    seed: int | None = None,
    unresolved: Literal["above", "below"] = "below",
) -> Study:
    """Make the study of a subset simulation, for `run`.

    Parameters
    ----------
    study : Study
        Study whose tolerances are used; its number of joints is ignored.
    limit : str
        Load or pattern and level, ``"cross*.F > 15 kN"``, or ``"any limit"``.
    n : int
        Number of joints per level.
    p0 : float
        Share of them that is carried to the next level; ``n * p0`` is a whole number.
    seed : int, optional
        Seed instead of the study's.
    unresolved : {"above", "below"}
        Side of every threshold on which joints without a valid load are counted.

    Returns
    -------
    Study
        Its ``sampling`` is a `study.model.Subset`.

    Raises
    ------
    InputError
        With every fault of limit and settings.
    """
    study = study.at("")
    found = parse_limit(limit, study.limits)
    own = {} if seed is None else {"seed": seed}
    levels = dict(zip(found.loads, found.levels, strict=True))
    fields = {"load": found.name, "levels": levels, "per_level": n, "p0": p0, "unresolved": unresolved}
    return subset_of(study, fields | own)


def rare_event(
    study: Study,
    limit: str,
    out: str | Path,
    workers: int | None = None,
    n: int = 1000,
    p0: float = 0.1,
    seed: int | None = None,
    unresolved: Literal["above", "below"] = "below",
) -> RareEvent:
    """Estimate the probability of a rare load by subset simulation.

    Parameters
    ----------
    study : Study
        The study.
    limit : str
        Load or pattern and level, ``"cross*.F > 15 kN"``, or ``"any limit"``.
    out : str or Path
        Result file; an existing one of the same study, limit and settings is resumed.
    workers : int, optional
        As in `run`.
    n, p0, seed, unresolved
        As in `subset_study`.

    Returns
    -------
    RareEvent

    Raises
    ------
    InputError
        With every fault of limit and settings.
    StoreError, Interrupted, WorkerDied
        As `run`.

    Examples
    --------
    >>> found = tolstat.rare_event(study, "cross1.F > 850 N", path, n=100, p0=0.5)
    >>> found.estimate.lower < 0.0668 < found.estimate.upper  # the load is normal: 700 N, standard deviation 100 N
    True
    """
    return run(subset_study(study, limit, n, p0, seed, unresolved), Path(out), workers)


def run(
    plan: Study,
    out: Path,
    workers: int | None = None,
    tell: Callable[[str], None] = note,
    progress: Reporter | None = None,
) -> RareEvent:
    """Run or resume a subset simulation.

    Parameters
    ----------
    plan : Study
        As `subset_study` makes it.
    out : Path
        Result file; created if it does not exist, otherwise resumed.
    workers : int, optional
        Number of processes for each stage; does not affect results. By default, stages of fewer than `MIN_PARALLEL`
        joints have one.
    tell : callable, optional
        Receives a sentence on each completed level.
    progress : callable, optional
        Called with the counts of the file's joints, those of completed levels included.

    Returns
    -------
    RareEvent

    Raises
    ------
    StoreError
        When the file is of another study, limit or settings, or lacks joints and was begun by other code.
    Interrupted, WorkerDied
        As `campaign.run`; the same call resumes.
    """
    with kept_workers():
        return _run(plan, out, workers, tell, progress)


def _run(
    plan: Study, out: Path, workers: int | None, tell: Callable[[str], None], progress: Reporter | None
) -> RareEvent:
    settings = plan.sampling
    assert isinstance(settings, Subset)
    walk = Walk(settings.per_level, settings.p0, settings.limit.level, lambda *which: _noise(plan, *which))
    unresolved: list[int] = []
    first, told = plan.first_sample, 0
    rows = _rows(out) or first + settings.per_level
    held = _is_done(_sized(plan, rows), out)  # by any version of the code: reading it needs no simulation
    simulate = partial(_simulate, plan, out, workers=workers, tell=tell, progress=progress)
    if not held:
        simulate(rows, rows)  # also checks that the file is of the same plan and code
    while not walk.done:
        stage = range(first, first + walk.next.parent.size)
        if rows < stage.stop:
            if held:
                simulate(rows, rows)  # nothing to simulate: checks before rows are appended
                held = False
            rows = stage.stop
            _append(plan, out, stage, walk.next)
            simulate(rows, len(stage))
        loads, n_unresolved = _loads(plan, settings, out, stage, walk.next)
        unresolved.append(n_unresolved)
        walk.take(loads)
        first = stage.stop
        for number, level in enumerate(walk.levels[told:], told):
            tell(f"level {number}: {level.joints} joints, {level.share:.3g} of them above the next threshold")
        told = len(walk.levels)
    joints = first - plan.first_sample
    wide = walk.estimate(prediction.half(CONFIDENCE))
    moved = numerical.factors(out, settings.limit, walk.last + plan.first_sample)
    head = settings, walk.levels, walk.reached, walk.estimate(), joints
    return RareEvent(*head, sum(unresolved), unresolved[0], walk.ancestors, wide, moved)


def repeated(
    plan: Study,
    out: Path,
    repeats: int,
    workers: int | None = None,
    tell: Callable[[str], None] = note,
    progress: Reporter | None = None,
) -> list[RareEvent]:
    """Run or resume the simulation with several seeds, the study's and the following ones.

    Each has its file: `out`, then ``STEM_2.h5`` and so on beside it. Other parameters and errors raised are those of
    `run`.
    """
    found = []
    with kept_workers():
        for k in range(repeats):
            own = replace(plan, sampling=plan.sampling.model_copy(update={"seed": plan.sampling.seed + k}))
            path = out.with_name(f"{out.stem}_{k + 1}{out.suffix}") if k else out
            tell(f"seed {own.sampling.seed}: {path}")
            found.append(run(own, path, workers, tell, progress))
    return found


def _noise(plan: Study, level: int, first: int, count: int) -> FloatArray:
    """Standard normal scores of the joints of level 0; at other levels the random numbers of their moves."""
    if level == 0:
        return sampling.scores(plan, range(first, first + count))
    return sampling.noise(plan, level, first, count)


def _rows(out: Path) -> int:
    """Number of rows of the file, 0 if there is none."""
    if not out.exists():
        return 0
    with ResultFile.open(out) as store:
        return store.n


def _is_done(plan: Study, out: Path) -> bool:
    """Whether the file has all rows of the study simulated."""
    if not out.exists():
        return False
    with ResultFile.open(out) as store:
        differing = differing_keys(store.identity, json.loads(json.dumps(plan.identity())))
        return store.complete and not differing


def _sized(plan: Study, rows: int) -> Study:
    """The study with `rows` rows, the nominal joint included."""
    return replace(plan, sampling=plan.sampling.model_copy(update={"n": rows - plan.first_sample}))


def _simulate(
    plan: Study,
    out: Path,
    rows: int,
    count: int,
    workers: int | None,
    tell: Callable[[str], None],
    progress: Reporter | None,
) -> None:
    """Simulate the pending rows of the file, about `count` of them."""
    alone = workers is None and count < MIN_PARALLEL
    workers, block = (1, count) if alone else (workers, None)
    campaign.run(_sized(plan, rows), out, workers, block, tell=tell, check=False, progress=progress)


def _append(plan: Study, out: Path, stage: range, joints: Candidates) -> None:
    """Append the joints of a stage to the file, as pending rows."""
    origin = np.empty(len(stage), SUBSET)
    origin["level"], origin["parent"] = joints.level, joints.parent + plan.first_sample
    with Writer.open(out) as store:
        grow(store, _sized(plan, stage.stop), [sampling.from_scores(plan, joints.scores)], [origin])


def _loads(plan: Study, settings: Subset, out: Path, stage: range, joints: Candidates) -> tuple[FloatArray, int]:
    """Loads of a stage, inf or -inf (by `settings.unresolved`) where not valid; number of joints not valid.

    The joints of the file are no sample of a production, so that it has no view; it holds all rows, and the rows of a
    stage are its file slots.
    """
    slots = slice(stage.start, stage.stop)
    with ResultFile.open(out) as store:
        results, origin = store.results(slots), store.origin(slots)
    parent = np.where(joints.parent < 0, -1, joints.parent + plan.first_sample)
    if (origin["level"] != joints.level).any() or (origin["parent"] != parent).any():
        found = f"rows {stage.start}:{stage.stop} do not follow from the loads before them"
        raise StoreError(str(Fault(str(out), found, "run the study again into another file (--out)")))
    loads = settings.limit.of(results).copy()
    valid = is_valid(loads, results["status"])
    loads[~valid] = math.inf if settings.unresolved == "above" else -math.inf
    return loads, int(np.count_nonzero(~valid))
