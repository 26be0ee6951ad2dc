"""Simulate the joints of a campaign with other values of what is assumed of the joint."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from tolstat.campaign import what_if as sets
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.what_if import Asked, Change
from tolstat.campaign.work import Work
from tolstat.common.cores import available_cores
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.display.options import Opt
from tolstat.display.progress import clock
from tolstat.questions.assumptions import variations
from tolstat.questions.assumptions.variations import Variation
from tolstat.solver.compilation import warm_up
from tolstat.store import Writer, what_if
from tolstat.store.provenance import versions
from tolstat.store.view import View

PILOT = 64
"""Number of joints whose time is measured."""


def simulate(path: Path, work: Work, joints: Annotated[int, Opt("N", least=100)] = variations.JOINTS) -> list[Path]:
    """Simulate the first joints of a campaign with each value of what is assumed, and keep their loads in the file.

    First each value of each assumption that is varied, all else equal, then all assumptions at their better and at
    their worse values. Of several operating points those that a limit of the study is about. What is done stays in the
    file, also of a run that is stopped; the same call goes on.

    Parameters
    ----------
    path : Path
        Result file of a campaign whose joints are drawn from tolerances.
    work : Work
        Workers, progress and messages.
    joints : int
        With --run: number of joints of each variation, 1000 unless given; more than the campaign has are drawn with its
        seed.

    Returns
    -------
    list of Path
        The file.

    Raises
    ------
    InputError
        With every fault of the values.
    StoreError
        When the file cannot be used, was made by other code, or its joint has no assumptions that are varied.
    """
    with Writer.open(path) as store, kept_workers():
        view = View(store)
        _check(view)
        run = _Run(store, view, work, joints)
        singles = variations.singles(view.study)
        if not singles:
            remedy = "write [[assumed]] in the study, with name, values and because: tolstat docs study"
            raise StoreError(str(Fault(str(path), "has a joint of which nothing is assumed that is varied", remedy)))
        run.simulate(singles)
        run.simulate(variations.all_together(View(store)))
        work.tell(run.outcome)
    return [path]


def _check(view: View) -> None:
    """Refuse a file that the question does not apply to, that has no joints yet, or that the code cannot continue."""
    variations.check(view)
    store, place = view.store, str(view.path)
    if not variations.joints_of(view):
        remedy = f"run its study: tolstat run {store.study_name}.toml"
        raise StoreError(str(Fault(place, "has no simulated joint to compare with", remedy)))
    if any(store.versions.get(name) != value for name, value in versions().items() if name in ("tolstat", "sources")):
        remedy = "use that version, or run the campaign again: tolstat run STUDY --out OTHER.h5"
        raise StoreError(str(Fault(place, "was made by another version of the code", remedy)))


class _Run:
    """Simulation of variations, one round after the other.

    Attributes
    ----------
    simulated : int
        Number of joints simulated so far, each at every point.
    """

    def __init__(self, store: Writer, view: View, work: Work, joints: int) -> None:
        self._begin, self._seconds = time.monotonic(), 0.0
        self._store, self._view, self._work = store, view, work
        self._workers = work.workers or available_cores()
        self._asked = Asked(view.kept_loads, variations.points_of(view))
        self._n = joints if joints > variations.JOINTS else min(joints, variations.joints_of(view))
        self.simulated, self._number = 0, 0

    @property
    def outcome(self) -> str:
        """What was simulated, in words."""
        spent = time.monotonic() - self._begin
        if not self.simulated:
            return f"all {self._number} variations are in the file, {self._n} joints of each"
        return f"simulated {self.simulated} joints in {spent:.0f} s, {self._n} of each of {self._number} variations"

    def simulate(self, wanted: Sequence[Variation]) -> None:
        """Simulate what the file lacks of some variations."""
        study, changes, faults = self._view.study, list[Change](), list[Fault]()
        for own in wanted:
            with gather(faults):
                changes.append(sets.with_joint(study, own.keys, range(self._n)))
        if faults:
            raise InputError(faults)
        self._number += len(changes)
        if (first := sets.own_joints(self._view)) < self._n:
            changes.insert(0, sets.as_drawn(study, range(first, self._n)))
        held, names = what_if.read(self._store), self._asked.names(study)
        lacking = sum(len(sets.missing(held, change, names)) for change in changes)
        if not lacking:
            return
        if not self._seconds:
            warm_up()
            options = sets.options_of(study, self._store)
            self._seconds = sets.seconds_per_joint(study, options, PILOT, self._asked.points) / self._workers
        cost, where = clock(self._seconds * lacking), ", ".join(self._asked.points)
        where = f" at {where}" if where else ""
        self._work.tell(f"{lacking} joints to simulate{where}, about {cost} on {self._workers} processes")
        self._work.display.stage("variations")
        sets.simulate(study, self._store, changes, self._asked, self._workers, lambda: False, self._work.display)
        self.simulated += lacking
