"""Why joints have no valid load, and the remedy in one sentence."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.tables import (
    FAILED,
    MAX_ITERATIONS,
    STATUS_TEXT,
    UNSETTLED,
    Motion,
    Status,
    iterations_allowed,
)
from tolstat.solver.refinement import MIN_MAX_REVS

if TYPE_CHECKING:
    from tolstat.store.reader import Reader

MAX_REVS, MAX_STEPS = 1000, 20_000
"""Largest solver.max_revs and solver.steps_per_rev that a study may have."""
WITHOUT_RESULTS = {
    Status.CRASHED: "simulate it again: tolstat run STUDY --retry crashed; if it crashes again, report the error",
    Status.INVALID_INPUT: "a parameter is not finite: check the tolerances in the study",
    Status.OUTSIDE_MODEL: "negative clearance, |alpha| >= 90 deg, no speed or no stiffness: change joint or tolerances",
}
"""Remedies that do not depend on the results of the joint."""


WITHOUT_INTERVAL = {"sobol": "Sobol' points", "lhs": "a Latin hypercube"}
"""Sampling methods of a production whose joints are not independent."""


def without_interval(method: str, replicates: int = 1) -> str:
    """Return why shares of a sampling method have no interval, and the remedy; empty if they have one."""
    if method not in WITHOUT_INTERVAL or replicates > 1:
        return ""
    remedy = 'set sampling.replicates = 8, or sampling.method = "random"'
    return f"shares of {WITHOUT_INTERVAL[method]} have no interval: {remedy} for a verdict"


class Reason(NamedTuple):
    """Joints without a valid load that have the same status.

    Attributes
    ----------
    status : Status
        Their status.
    joints : int
        How many they are.
    row : int
        Row of the first in the campaign.
    remedy : str
        Remedy for the first.
    point : str
        Operating point, where the campaign has several.
    """

    status: Status
    joints: int
    row: int
    remedy: str
    point: str = ""

    @property
    def text(self) -> str:
        """Number, status, meaning and remedy, in lines."""
        noun = "joint" if self.joints == 1 else "joints"
        where = f" at {self.point}" if self.point else ""
        head = f"{self.joints} {noun} {self.status.label}{where}: {STATUS_TEXT[self.status]}"
        return f"{head}\n  hint, for row {self.row}: {self.remedy}"

    @property
    def retry(self) -> str:
        """Options of `tolstat run` that simulate these joints again as the remedy says; empty if it names none."""
        setting = re.search(r'(solver\.\w+) = "?([\w.e-]+)', self.remedy)
        if setting:
            return f"--retry {self.status.label} --set {setting[1]}={setting[2].rstrip('.')}"
        return f"--retry {self.status.label}" if "--retry" in self.remedy else ""


def reasons(store: Reader, status: Mapping[str, NDArray[np.uint8]]) -> list[Reason]:
    """Why joints of a file have no valid load, most frequent status first.

    Parameters
    ----------
    store : Reader
        The file.
    status : mapping of str to ndarray, shape (n,)
        Status of its joints at each operating point, the nominal joint included.
    """
    found = []
    for point, state in product(status, (*FAILED, *UNSETTLED)):
        slots = np.flatnonzero(status[point] == state)
        if slots.size:
            first, joint = int(slots[0]), int(store.row(slots[:1])[0])
            row = store.at(point).results(slice(first, first + 1))[0]
            found.append(Reason(Status(state), len(slots), joint, remedy(row, store.options), point))
    return sorted(found, key=lambda reason: -reason.joints)


def remedy(row: np.void, options: Mapping[str, Any]) -> str:
    """Return the setting that may help, or what the results mean.

    Parameters
    ----------
    row : record of RESULT
        The joint.
    options : mapping
        Solver options of the joint, one key for each field of `Options`.

    Returns
    -------
    str
        Empty for a joint that is ok.
    """
    status, motion = Status(int(row["status"])), Motion(int(row["motion"]))
    if status in (Status.OK, Status.PENDING):
        return ""
    if status in WITHOUT_RESULTS:
        return WITHOUT_RESULTS[status]
    if status == Status.NEWTON_FAILED:
        return _of_newton_failure(row, options)
    if status == Status.NOT_FINITE:
        return f"the solution overflowed at {_place(row)}: try solver.steps_per_rev = {_more_steps(options)}"
    if status == Status.NOT_RESOLVED:
        return _of_unresolved(row, options)
    if status == Status.STATIONARY and motion == Motion.SUBHARMONIC:
        return f"the motion repeats every {row['period']} revolutions; the results cover all of them"
    if status == Status.STATIONARY:
        return f"the motion never repeats; the largest loads of {options['duration']} revolutions have an interval"
    if motion == Motion.SLOW or (status == Status.NOT_SETTLED and float(row["closure_trend"]) < -1e-3):
        return _of_slow(row, options)
    if motion in (Motion.QUASI_PERIODIC, Motion.CHAOTIC):
        kind = motion.label.replace("_", "-")
        return f"the motion is {kind} and its largest loads still change: try solver.max_revs = {_more_revs(options)}"
    classify = "" if options["max_refinements"] else ", and solver.max_refinements = 3 to classify the motion"
    return f"try solver.max_revs = {_more_revs(options)}{classify}"


def _place(row: np.void) -> str:
    return f"step {row['failed_step']} ({math.degrees(row['failed_theta']):.0f} deg)"


def _more_steps(options: Mapping[str, Any]) -> int:
    return min(4 * int(options["steps_per_rev"]), MAX_STEPS)


def _more_revs(options: Mapping[str, Any]) -> int:
    """Return a larger solver.max_revs, also larger than that of the refinement."""
    return min(4 * max(int(options["max_revs"]), MIN_MAX_REVS), MAX_REVS)


def _of_newton_failure(row: np.void, options: Mapping[str, Any]) -> str:
    if row["failed_step"] < 0:
        return 'at an input angle no equilibrium was found: try solver.fidelity = "dynamic"'
    place, steps = _place(row), _more_steps(options)
    if row["newton_iterations"] == iterations_allowed(options["steps_per_rev"], options["max_revs"]):
        spent = f"all {row['newton_iterations']} iterations that a joint may take were spent at {place}"
        return f"{spent}: try solver.steps_per_rev = {steps}"
    if row["newton_iterations"] > MAX_ITERATIONS * options["steps_per_rev"] * options["max_revs"]:
        return f"{MAX_ITERATIONS} iterations a step were spent at {place}: try solver.steps_per_rev = {steps}"
    return f"failed at {place}: try solver.steps_per_rev = {steps}, or solver.max_halvings = 20"


def _of_unresolved(row: np.void, options: Mapping[str, Any]) -> str:
    change = float(row["refinement_change"])
    if not math.isfinite(change):
        return "finer steps failed: try solver.max_halvings = 20"
    more = int(options["max_refinements"]) + 1
    return f"the last halving of the steps changes largest loads by {change:.1%}: try solver.max_refinements = {more}"


def _of_slow(row: np.void, options: Mapping[str, Any]) -> str:
    trend = float(row["closure_trend"])
    if not trend < -1e-3:
        return f"neighbouring motions converge: try solver.max_revs = {_more_revs(options)}"
    missing = math.log10(float(row["closure"]) / options["settle_tol"]) / -trend
    revs = float(row["revolutions"]) + missing
    if revs > MAX_REVS:
        return f"would settle in some {revs:.0f} revolutions: give a larger solver.settle_tol"
    return f"settles in some {revs:.0f} revolutions: try solver.max_revs = {min(math.ceil(1.3 * revs), MAX_REVS)}"
