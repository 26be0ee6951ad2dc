"""What a user can do about a joint that is not ok, in one sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from tolstat.common.tables import MAX_ITERATIONS, STATUS_TEXT, Motion, Status

ALLOWED_REVS, ALLOWED_STEPS = 1000, 20_000
"""Largest solver.max_revs and solver.steps_per_rev that a study may ask for."""


def remedy(row: np.void, options: Mapping[str, Any]) -> str:
    """Return which setting may help, or what the results can be used for.

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
    if status == Status.NEWTON_FAILED:
        return _of_failure(row, options)
    if status == Status.NOT_RESOLVED:
        return _of_steps(row, options)
    if status == Status.STATIONARY and motion == Motion.SUBHARMONIC:
        return f"repeats every {row['period']} revolutions, which the results cover"
    if status == Status.STATIONARY:
        return f"never repeats: largest loads are those of {options['duration']} revolutions, with an interval"
    if motion == Motion.SLOW or (status == Status.NOT_SETTLED and float(row["closure_trend"]) < -1e-3):
        return _of_slow(row, options)
    if motion in (Motion.QUASI_PERIODIC, Motion.CHAOTIC):
        kind = motion.label.replace("_", "-")
        return f"{kind}, and its largest loads still change: try a larger solver.max_revs"
    if status == Status.NOT_SETTLED:
        return "give more solver.max_revs, and solver.max_refinements above 0 to be told what motion it is"
    return STATUS_TEXT[status]


def _of_failure(row: np.void, options: Mapping[str, Any]) -> str:
    place = f"step {row['failed_step']} ({math.degrees(row['failed_theta']):.0f} deg)"
    steps = min(4 * int(options["steps_per_rev"]), ALLOWED_STEPS)
    if row["newton_iterations"] > MAX_ITERATIONS * options["steps_per_rev"] * options["max_revs"]:
        return f"{MAX_ITERATIONS} iterations a step were spent at {place}: try solver.steps_per_rev = {steps}"
    return f"failed at {place}: try solver.steps_per_rev = {steps}, or solver.max_halvings = 20"


def _of_steps(row: np.void, options: Mapping[str, Any]) -> str:
    change = float(row["refinement_change"])
    if not math.isfinite(change):
        return "fails with finer steps: try solver.max_halvings = 20"
    more = int(options["max_refinements"]) + 1
    return f"largest loads change by {change:.1%} with the last halving of steps: try solver.max_refinements = {more}"


def _of_slow(row: np.void, options: Mapping[str, Any]) -> str:
    trend = float(row["closure_trend"])
    if not trend < -1e-3:
        return "neighbouring motions converge: give more solver.max_revs"
    missing = math.log10(float(row["closure"]) / options["settle_tol"]) / -trend
    revs = float(row["revolutions"]) + missing
    if revs > ALLOWED_REVS:
        return f"would settle in some {revs:.0f} revolutions: give a larger solver.settle_tol"
    return f"settles in some {revs:.0f} revolutions: try solver.max_revs = {min(math.ceil(1.3 * revs), ALLOWED_REVS)}"
