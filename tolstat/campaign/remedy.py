"""Why joints have no valid load, the remedy in one sentence, and joints that are simulated again as it says."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common import strict, tables
from tolstat.common.errors import Fault, gather, input_error, raise_all
from tolstat.common.fields import HistorySpec
from tolstat.common.tables import FAILED, UNSETTLED, Options, Status
from tolstat.solver import fidelity
from tolstat.solver.refinement import MIN_MAX_REVS
from tolstat.store import Reader, Writer
from tolstat.store.recorded import MISFIT, misfits
from tolstat.study import Study
from tolstat.study.rewriting import parsed

MAX_REVS, MAX_STEPS = 1000, 20_000
"""Largest solver.max_revs and solver.steps_per_rev that a study may have."""
WITHOUT_RESULTS = {
    Status.CRASHED: "simulate it again: tolstat run STUDY --retry crashed; if it crashes again, report the error",
    Status.INVALID_INPUT: "a parameter is not finite, or shaft.spline not from -1 to 1: check the errors",
    Status.OUTSIDE_MODEL: "check the units (errors in tables are in m and rad), else change joint or tolerances",
}
"""Remedies that do not depend on the results of the joint."""


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
    why : str
        What the status means; of joints that cannot be assembled that.
    point : str
        Operating point, where the campaign has several.
    """

    status: Status
    joints: int
    row: int
    remedy: str
    why: str
    point: str = ""

    @property
    def where(self) -> str:
        """Operating point in words, where the campaign has several."""
        return f" at {self.point}" if self.point else ""

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
    each = []
    for point, state in product(status, (*FAILED, *UNSETTLED)):
        slots = np.flatnonzero(status[point] == state)
        scrap = misfits(store, slots) if state == Status.OUTSIDE_MODEL else np.zeros(slots.size, dtype=bool)
        for own, why in ((slots[scrap], f"{MISFIT}: scrap in the yield"), (slots[~scrap], tables.STATUS_TEXT[state])):
            if own.size:
                first, joint = int(own[0]), int(store.row(own[:1])[0])
                row = store.at(point).results(slice(first, first + 1))[0]
                each.append(Reason(Status(state), len(own), joint, remedy(row, store.options), why, point))
    return sorted(each, key=lambda reason: -reason.joints)


def in_words(reasons: Sequence[Reason]) -> Iterator[str]:
    """Say why joints have no valid load: numbers, meaning and remedies of each reason, in lines, each once."""
    for why in dict.fromkeys(reason.why for reason in reasons):
        first, *others = [reason for reason in reasons if reason.why == why]
        noun = "joint" if first.joints == 1 else "joints"
        counts = [f"{first.joints} {noun} {first.status.label}{first.where}"]
        counts += [f"{other.joints}{other.where}" for other in others]
        rows = {first.remedy: first}
        for other in others:
            rows.setdefault(other.remedy, other)
        hints = [f"  hint, for row {each.row}{each.where}: {remedy}" for remedy, each in rows.items()]
        yield "\n".join([f"{', '.join(counts)}: {why}", *hints])


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
    status = Status(int(row["status"]))
    if status in (Status.OK, Status.PENDING):
        return ""
    if status in WITHOUT_RESULTS:
        return WITHOUT_RESULTS[status]
    place = f"step {row['failed_step']} ({math.degrees(row['failed_theta']):.0f} deg)"
    finer = f"try solver.steps_per_rev = {min(4 * int(options['steps_per_rev']), MAX_STEPS)}"
    if status == Status.NEWTON_FAILED:
        return _of_newton_failure(row, options, place, finer)
    if status == Status.NOT_FINITE:
        return f"the solution overflowed at {place}: {finer}"
    if status == Status.NOT_RESOLVED and not math.isfinite(row["refinement_change"]):
        return "finer steps failed: try solver.max_halvings = 20"
    if status == Status.NOT_RESOLVED:
        change = f"the last halving of the steps changes largest loads by {float(row['refinement_change']):.1%}"
        return f"{change}: try solver.max_refinements = {int(options['max_refinements']) + 1}"
    if status == Status.STATIONARY and row["period"] > 1:
        return f"the motion repeats every {row['period']} revolutions; the results cover all of them"
    if status == Status.STATIONARY:
        return f"the motion never repeats; the largest loads of {options['duration']} revolutions have an interval"
    if float(row["closure_trend"]) < -1e-3:
        missing = math.log10(float(row["closure"]) / options["settle_tol"]) / -float(row["closure_trend"])
        revs = float(row["revolutions"]) + missing
        if revs > MAX_REVS:
            return f"would settle in some {revs:.0f} revolutions: give a larger solver.settle_tol"
        return f"settles in some {revs:.0f} revolutions: try solver.max_revs = {min(math.ceil(1.3 * revs), MAX_REVS)}"
    more = min(4 * max(int(options["max_revs"]), MIN_MAX_REVS), MAX_REVS)  # more than the refinement has, too
    refine = "" if options["max_refinements"] else ", and solver.max_refinements = 3 if it never repeats"
    return f"the largest loads still change: try solver.max_revs = {more}{refine}"


def _of_newton_failure(row: np.void, options: Mapping[str, Any], place: str, finer: str) -> str:
    if row["failed_step"] < 0:
        return 'at an input angle no equilibrium was found: try solver.fidelity = "dynamic"'
    if row["newton_iterations"] == tables.iterations_allowed(options["steps_per_rev"], options["max_revs"]):
        return f"all {row['newton_iterations']} iterations that a joint may take were spent at {place}: {finer}"
    if row["newton_iterations"] > tables.MAX_ITERATIONS * options["steps_per_rev"] * options["max_revs"]:
        return f"{tables.MAX_ITERATIONS} iterations a step were spent at {place}: {finer}"
    return f"failed at {place}: {finer}, or solver.max_halvings = 20"


class Retry(NamedTuple):
    """Which joints are simulated again, and how.

    Attributes
    ----------
    status : tuple of Status
        Status of the joints that are simulated again.
    settings : dict
        Settings that replace the study's, ``{"solver.steps_per_rev": 360}``.
    options : Options
        Complete solver options.
    auto : bool
        Whether fidelity and steps a revolution are those that ``solver.fidelity = "auto"`` chose for the campaign.
    """

    status: tuple[Status, ...]
    settings: dict[str, Any]
    options: Options
    auto: bool = False

    def chosen(self, record: Mapping[str, Any]) -> Retry:
        """Return the retry with the fidelity and steps that ``auto`` chose for the campaign, if `auto` is true."""
        return self._replace(options=fidelity.apply(self.options, record)) if self.auto else self


def parse_retry(statuses: str, settings: Sequence[str], study: Study) -> Retry:
    """Parse a retry from the arguments of the command line.

    Parameters
    ----------
    statuses : str
        ``"newton_failed,crashed"``.
    settings : sequence of str
        ``"solver.steps_per_rev=360"``: a key of the study's ``[solver]`` and its value as in TOML.
    study : Study
        The study whose settings they replace.

    Raises
    ------
    InputError
        With every fault.
    """
    faults: list[Fault] = []
    labels = {state.label: state for state in Status if state != Status.PENDING}
    names = [name.strip() for name in statuses.split(",")]
    for name in names:
        if name not in labels:
            faults.append(Fault("--retry", f"{name!r} is not a status", strict.did_you_mean(name, list(labels))))
    changed: dict[str, Any] = {}
    for text in settings:
        with gather(faults):
            example = "write --set solver.steps_per_rev=360"
            path, value = parsed(text, "--set", example)
            if path[0] != "solver":
                raise input_error("--set", f"{text!r} is not a solver setting", example)
            changed[".".join(path)] = value
    solver = study.solver
    with gather(faults):
        new = {key.removeprefix("solver."): value for key, value in changed.items()}
        solver = strict.validate(type(solver), solver.model_dump(exclude_unset=True) | new, "--set", prefix=("solver",))
    if solver.fidelity == "ideal":
        faults += [Fault("--set: solver.fidelity", *texts) for texts in study.no_closed_form]
    raise_all(faults)
    chosen = tuple(labels[name] for name in dict.fromkeys(names))
    return Retry(chosen, changed, solver.options(), auto=solver.fidelity == "auto")


def begin_retry(store: Writer, retry: Retry, specs: Mapping[str, HistorySpec], tell: Callable[[str], None]) -> None:
    """Mark the joints of a retry as pending, unless the same retry is already under way in the file.

    Parameters
    ----------
    store : Writer
        Open for writing.
    retry : Retry
        Which joints, and how.
    specs : mapping of str to HistorySpec
        Histories that joints would have with the settings of the retry.
    tell : callable
        Called with a message that gives the number of joints.

    Raises
    ------
    InputError
        When histories would have another shape than those of the other joints.
    StoreError
        When there is no room for a second copy of the file.
    """
    status, options = [state.label for state in retry.status], tables.to_names(retry.options)
    entry = json.loads(json.dumps({"status": status, "settings": retry.settings, "options": options}))
    each = store.each()
    attempts = np.concatenate([at_point.attempt()[at_point.pending()] for at_point in each])
    if store.retries[-1:] == (entry,) and np.any(attempts == len(store.retries)):
        return
    if dict(specs) != store.history_specs:
        found = "these settings give load histories another number of samples than those in the file"
        remedy = "remove solver.steps_per_rev, or run another campaign: tolstat run STUDY --out OTHER.h5"
        raise input_error("--set", found, remedy)
    rows = {at_point.point or "": np.flatnonzero(np.isin(at_point.status(), retry.status)) for at_point in each}
    again = sum(slots.size for slots in rows.values())
    tell(f"{again} joints are simulated again")
    if again:
        store.mark_pending(rows, entry)
