"""Checks of the numerical error: joints are simulated again with other settings or another solver."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import closing

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign import pool
from tolstat.campaign.blocks import simulate_beside
from tolstat.campaign.pool import Lost, Work, kept_workers
from tolstat.common.counts import Counts
from tolstat.common.tables import (
    RESULT,
    Fidelity,
    Method,
    Options,
    Simulation,
    Start,
    Status,
    to_names,
    without_results,
)
from tolstat.solver.reference import reference_rows
from tolstat.store.verification import Check

QUICK_CHECKS = ("half_step", "newton", "settling")
"""Checks at the end of every run; they need no code beyond that of the run."""
ALL_CHECKS = (*QUICK_CHECKS, "method", "reference")
MIN_STEPS = 180
"""Minimum steps per revolution of the dynamic simulation that checks one of lower fidelity."""
DESCRIPTION = {
    "half_step": "twice as many steps a revolution",
    "newton": "a hundredth of solver.newton_tol",
    "settling": "the other solver.start, and a hundredth of solver.settle_tol",
    "method": "another solver.method",
    "fidelity": "dynamic fidelity instead of a lower one",
    "reference": "scipy's Radau, rtol 1e-7, largest loads at 2880 angles and all steps",
}

Simulate = Callable[..., Simulation]
Progress = Callable[[Counts], None]


def no_progress(counts: Counts) -> None:
    """Report no progress."""


def options_of_check(options: Options, check: str) -> Options:
    """Return the solver options of a check.

    Parameters
    ----------
    options : Options
        Solver options of the campaign.
    check : str
        One of `ALL_CHECKS`, or ``fidelity``.
    """
    if check == "half_step":
        return options._replace(steps_per_rev=2 * options.steps_per_rev)
    if check == "newton":
        return options._replace(newton_tol=0.01 * options.newton_tol)
    if check == "settling":
        other_start = Start.RAMP if options.start == Start.STATIC else Start.STATIC
        return options._replace(settle_tol=0.01 * options.settle_tol, start=int(other_start))
    if check == "method":
        other = Method.BDF2 if options.method == Method.TR_BDF2 else Method.TR_BDF2
        return options._replace(method=int(other))
    if check == "fidelity" and options.fidelity != Fidelity.DYNAMIC:
        steps = max(options.steps_per_rev, MIN_STEPS)
        return options._replace(fidelity=int(Fidelity.DYNAMIC), steps_per_rev=steps)
    return options


def run_checks(
    params: NDArray[np.void],
    options: Sequence[Options],
    names: Iterable[str],
    simulate: Simulate = simulate_beside,
    workers: int = 1,
    progress: Progress = no_progress,
) -> dict[str, Check]:
    """Simulate joints again, once for each check.

    Parameters
    ----------
    params : ndarray of PARAM, shape (m,)
        Parameters of the joints.
    options : sequence of Options
        Solver options of each joint in the campaign.
    names : iterable of str
        Names from `ALL_CHECKS`; ``fidelity`` is added if a joint is below dynamic fidelity.
    simulate : callable
        As `simulation.simulate_rows`; joints are simulated with it, without histories.
    workers : int
        Processes that compute the references, seconds each; their number changes results within the tolerance only.
    progress : callable
        Called with the counts of joints whose reference is computed.

    Returns
    -------
    dict of str to Check
    """
    lower = any(changed.fidelity != Fidelity.DYNAMIC for changed in options)
    checks = {}
    with kept_workers():
        for name in (*names, *(("fidelity",) if lower else ())):
            changed = [options_of_check(joint_options, name) for joint_options in options]
            if name == "reference":
                results = _references(params, changed, workers, progress)
            else:
                results = simulate_each(params, changed, simulate)
            checks[name] = Check(DESCRIPTION[name], to_names(changed[0]), results)
    return checks


Single = tuple[int, NDArray[np.void], Options]
"""A joint: its index, its row of PARAM, shape (1,), and its solver options."""


def _references(
    params: NDArray[np.void], options: Sequence[Options], workers: int, progress: Progress
) -> NDArray[np.void]:
    """Compute the reference of each joint, (m,) table RESULT; each process computes one joint at a time."""
    joints: list[Single] = [(i, params[i : i + 1], of_joint) for i, of_joint in enumerate(options)]
    work: Work[Single, NDArray[np.void] | Lost] = Work(_reference)
    done = pool.map_blocks(work, joints, min(workers, len(joints)))
    results, counts = without_results(len(joints), Status.CRASHED), Counts(len(joints), 0, 0, 0)
    progress(counts)
    with closing(done):
        for (i, _, _), result in done:
            if not isinstance(result, Lost):
                results[i] = result[0]
            counts = counts.after(results["status"][i : i + 1])
            progress(counts)
    return results


def _reference(joint: Single) -> NDArray[np.void]:
    _, params, options = joint
    return reference_rows(params, options)


def simulate_each(
    params: NDArray[np.void], options: Sequence[Options], simulate: Simulate = simulate_beside
) -> NDArray[np.void]:
    """Results of joints, (m,) table RESULT, each with its own options, without histories."""
    results = np.empty(len(params), RESULT)
    for distinct in dict.fromkeys(options):
        here = np.array([each == distinct for each in options])
        results[here] = simulate(params[here], distinct).results
    return results
