"""Subset simulation with the joints of all levels in one result file.

A stage is a set of joints that can be simulated at once: all joints of level 0, or one step of all chains. Each stage
appends its joints to the file as pending rows, and a campaign simulates them. No other state is stored: the study and
the loads in the file determine the next joints, so that an interrupted run resumes where it stopped.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis.sample import is_valid
from tolstat.analysis.subset import Walk
from tolstat.campaign import run as campaign
from tolstat.campaign.extend import grow
from tolstat.campaign.work import Work
from tolstat.common.columns import SUBSET
from tolstat.common.loads import FloatArray
from tolstat.store import ResultFile, Writer
from tolstat.store.hdf5 import store_error
from tolstat.store.reader import Reader
from tolstat.store.recorded import differing_keys
from tolstat.study import Study
from tolstat.study.model import Subset

MIN_PARALLEL = 2000
"""Minimum number of joints of a stage for which several worker processes are started: some seconds of work."""


class Subsets:
    """A subset simulation of one seed at its beginning.

    Attributes
    ----------
    plan : Study
        Its study.
    settings : Subset
        Limit and settings.
    walk : Walk
        The levels.
    first : int
        First row that the walk has not taken.
    """

    def __init__(self, plan: Study) -> None:
        assert isinstance(plan.sampling, Subset)
        self.plan, self.settings, self.first = plan, plan.sampling, plan.first_sample

        def noise(level: int, first: int, count: int) -> FloatArray:
            """Standard normal scores of the joints of level 0; at other levels the random numbers of their moves."""
            if level == 0:
                return sampling.scores(plan, range(first, first + count))
            return sampling.noise(plan, level, first, count)

        self.limit = self.settings.limit(plan.mechanism)
        self.walk = Walk(self.settings.per_level, self.settings.p0, self.limit.level, noise)

    @property
    def stage(self) -> range:
        """Rows of the joints that the walk has next."""
        return range(self.first, self.first + self.walk.next.parent.size)

    @property
    def origin(self) -> NDArray[np.void]:
        """Level of each joint of the stage, and the row that it was moved from, -1 at level 0; (n,) SUBSET."""
        joints, origin = self.walk.next, np.empty(len(self.stage), SUBSET)
        origin["level"] = joints.level
        origin["parent"] = np.where(joints.parent < 0, -1, joints.parent + self.plan.first_sample)
        return origin

    def take(self, store: Reader) -> int:
        """Give the walk the loads of a stage, inf or -inf where not valid; returns the number of joints that are not.

        The joints of the file are no sample of a production; it holds all rows, and the rows of a stage are its file
        slots.

        Raises
        ------
        StoreError
            When the joints of the file do not follow from the loads before them.
        """
        stage = self.stage
        slots = slice(stage.start, stage.stop)
        results = store.results(slots)
        if (store.origin(slots) != self.origin).any():
            reason = f"rows {stage.start}:{stage.stop} do not follow from the loads before them"
            raise store_error(store.path, reason, "run the study again into another folder (--out DIR)")
        loads = self.limit.of(results).copy()
        valid = is_valid(loads, results["status"])
        loads[~valid] = math.inf if self.settings.unresolved == "above" else -math.inf
        self.walk.take(loads)
        self.first = stage.stop
        return int(np.count_nonzero(~valid))


def run(plan: Study, out: Path, work: Work) -> None:
    """Run or resume a simulation of one seed.

    Parameters
    ----------
    plan : Study
        Study whose ``sampling`` is a `study.model.Subset`.
    out : Path
        Its result file.
    work : Work
        Worker processes, progress and messages. By default, stages of fewer than `MIN_PARALLEL` joints have one
        process.

    Raises
    ------
    StoreError
        When the file is of another study, limit or settings, or lacks joints and was begun by other code.
    Interrupted, WorkerDied
        As `campaign.run`; the same call resumes.
    """
    subsets, reported, is_whole = Subsets(plan), 0, False
    rows = subsets.stage.stop
    if out.exists():
        with ResultFile.open(out) as store:
            rows = store.n
            is_whole = store.complete and not differing_keys(store.identity, _sized(plan, rows).identity())
    if not is_whole:  # a whole file is read by any version of the code; otherwise it must be of the same plan and code
        _simulate(plan, out, rows, rows, work)
    while not subsets.walk.done:
        stage = subsets.stage
        if rows < stage.stop:
            if is_whole:
                _simulate(plan, out, rows, rows, work)  # nothing to simulate: checks before rows are appended
            rows, is_whole = stage.stop, False
            with Writer.open(out) as store:
                errors = sampling.from_scores(plan, subsets.walk.next.scores)
                grow(store, _sized(plan, rows), [errors], [subsets.origin])
            _simulate(plan, out, rows, len(stage), work)
        with ResultFile.open(out) as store:
            subsets.take(store)
        for number, level in enumerate(subsets.walk.levels[reported:], reported):
            work.tell(f"level {number}: {level.joints} joints, {level.share:.3g} of them above the next threshold")
        reported = len(subsets.walk.levels)


def _sized(plan: Study, rows: int) -> Study:
    """The study with `rows` rows, the nominal joint included."""
    return replace(plan, sampling=plan.sampling.model_copy(update={"n": rows - plan.first_sample}))


def _simulate(plan: Study, out: Path, rows: int, count: int, work: Work) -> None:
    """Simulate the pending rows of the file, about `count` of them."""
    is_alone = work.workers is None and count < MIN_PARALLEL
    workers, block = (1, count) if is_alone else (work.workers, None)
    campaign.run(_sized(plan, rows), out, workers, block, tell=work.tell, check=False, progress=work.display)
