"""Subset simulation with the joints of all levels in one result file.

A stage is a set of joints that can be simulated at once: all joints of level 0, or one step of all chains. Each stage
appends its joints to the file as pending rows, and a campaign simulates them. No other state is stored: the study and
the loads in the file determine the next joints, so that an interrupted run resumes where it stopped.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis.sample import is_valid
from tolstat.analysis.subset import Walk
from tolstat.campaign import run as campaign
from tolstat.campaign.extend import grow
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.work import Work
from tolstat.common.draw_records import SUBSET
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import FloatArray
from tolstat.display.options import Opt
from tolstat.store import ResultFile, Writer
from tolstat.store.reader import Reader
from tolstat.store.recorded import differing_keys
from tolstat.store.view import View
from tolstat.study import Study, rule, subset_of
from tolstat.study.model import Subset

MIN_PARALLEL = 2000
"""Minimum number of joints of a stage for which several worker processes are started: some seconds of work."""
EXAMPLE = 'write --limit "cross1.F > 900 N"'


def simulate(
    source: Study | Path,
    work: Work,
    limit: Annotated[str | None, Opt("LIMIT")] = None,
    n: Annotated[int, Opt("N", least=20)] = 1000,
    p0: Annotated[float, Opt("P")] = 0.1,
    seed: Annotated[int | None, Opt("S", least=0)] = None,
    unresolved: Literal["above", "below"] = "below",
    repeats: Annotated[int, Opt("K", least=1)] = 4,
) -> list[Path]:
    """Run or resume subset simulations with several seeds: that of the study, and the following ones.

    Parameters
    ----------
    source : Study or Path
        Study whose tolerances are used, its number of joints is ignored; or the result file of a simulation to resume,
        which holds all settings.
    work : Work
        Worker processes, folder of the result files, progress and messages. By default, stages of fewer than
        `MIN_PARALLEL` joints have one process.
    limit : str
        "cross1.F > 900 N", "cross*.F > 900 N" or "any limit"; required with STUDY.
    n : int
        Number of joints per level.
    p0 : float
        Share of joints carried to the next level, up to 0.5.
    seed : int, optional
        Seed of all draws; default: that of the study.
    unresolved : {"above", "below"}
        Whether failed and unsettled joints count as above or below the level.
    repeats : int
        Number of seeds, each with a result file of its own.

    Returns
    -------
    list of Path
        Result files ``STUDY_rare.h5``, ``STUDY_rare_2.h5`` and so on; existing ones of the same study, limit and
        settings are resumed.

    Raises
    ------
    InputError
        With every fault of limit and settings.
    StoreError
        When a file is of another study, limit or settings, or lacks joints and was begun by other code.
    Interrupted, WorkerDied
        As `campaign.run`; the same call resumes.
    """
    if isinstance(source, Path):
        with ResultFile.open(source) as store:
            plans = {source: plan_of(store.view(work.study_file))}
    else:
        if limit is None:
            raise InputError([Fault("--limit", "is missing", 'add --limit "cross1.F > 900 N"')])
        plan, plans = subset_study(source.at(work.point), limit, n, p0, seed, unresolved), {}
        for k in range(repeats):
            path = work.folder / f"{source.path.stem}_rare{f'_{k + 1}' if k else ''}.h5"
            seeded = plan.sampling.model_copy(update={"seed": plan.sampling.seed + k})
            plans[path] = replace(plan, sampling=seeded)
    work.display.stage("levels of the subset simulation")
    with kept_workers():
        for path, plan in plans.items():
            work.tell(f"seed {plan.sampling.seed}: {path}")
            run(plan, path, work)
    return list(plans)


def subset_study(
    study: Study,
    limit: str,
    n: int = 1000,
    p0: float = 0.1,
    seed: int | None = None,
    unresolved: Literal["above", "below"] = "below",
) -> Study:
    """Make the study of a subset simulation, whose ``sampling`` is a `study.model.Subset`; see `simulate`."""
    study = study.at("")
    found = rule.limit_of(limit, study.limits, "--limit", EXAMPLE)
    levels = dict(zip(found.loads, found.levels, strict=True))
    fields = {"load": found.name, "levels": levels, "per_level": n, "p0": p0, "unresolved": unresolved}
    return subset_of(study, fields | ({} if seed is None else {"seed": seed}))


def plan_of(view: View) -> Study:
    """The study of the subset simulation that a result file holds.

    Raises
    ------
    StoreError
        When it holds none.
    """
    if view.method != "subset":
        remedy = 'give the study: tolstat rare STUDY --limit "cross1.F > 900 N" --out DIR'
        raise StoreError(str(Fault(str(view.path), "is not a result file of tolstat rare", remedy)))
    return view.study


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

        self.walk = Walk(self.settings.per_level, self.settings.p0, self.settings.limit.level, noise)

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
        results, origin, expected = store.results(slots), store.origin(slots), self.origin
        if any((origin[name] != expected[name]).any() for name in ("level", "parent")):
            found = f"rows {stage.start}:{stage.stop} do not follow from the loads before them"
            raise StoreError(str(Fault(str(store.path), found, "run the study again into another folder (--out DIR)")))
        loads = self.settings.limit.of(results).copy()
        valid = is_valid(loads, results["status"])
        loads[~valid] = math.inf if self.settings.unresolved == "above" else -math.inf
        self.walk.take(loads)
        self.first = stage.stop
        return int(np.count_nonzero(~valid))


def run(plan: Study, out: Path, work: Work) -> None:
    """Run or resume a simulation of one seed, see `simulate`."""
    subsets, told, whole = Subsets(plan), 0, False
    rows = subsets.stage.stop
    if out.exists():
        with ResultFile.open(out) as store:
            rows = store.n
            wanted = json.loads(json.dumps(_sized(plan, rows).identity()))
            whole = store.complete and not differing_keys(store.identity, wanted)
    if not whole:  # a whole file is read by any version of the code; otherwise it must be of the same plan and code
        _simulate(plan, out, rows, rows, work)
    while not subsets.walk.done:
        stage = subsets.stage
        if rows < stage.stop:
            if whole:
                _simulate(plan, out, rows, rows, work)  # nothing to simulate: checks before rows are appended
            rows, whole = stage.stop, False
            with Writer.open(out) as store:
                scores = sampling.from_scores(plan, subsets.walk.next.scores)
                grow(store, _sized(plan, rows), [scores], [subsets.origin])
            _simulate(plan, out, rows, len(stage), work)
        with ResultFile.open(out) as store:
            subsets.take(store)
        for number, level in enumerate(subsets.walk.levels[told:], told):
            work.tell(f"level {number}: {level.joints} joints, {level.share:.3g} of them above the next threshold")
        told = len(subsets.walk.levels)


def _sized(plan: Study, rows: int) -> Study:
    """The study with `rows` rows, the nominal joint included."""
    return replace(plan, sampling=plan.sampling.model_copy(update={"n": rows - plan.first_sample}))


def _simulate(plan: Study, out: Path, rows: int, count: int, work: Work) -> None:
    """Simulate the pending rows of the file, about `count` of them."""
    alone = work.workers is None and count < MIN_PARALLEL
    workers, block = (1, count) if alone else (work.workers, None)
    campaign.run(_sized(plan, rows), out, workers, block, tell=work.tell, check=False, progress=work.display)
