"""Second simulation, with finer steps, of joints that the uniform steps do not resolve.

These are joints that have not settled, and those whose estimated step error is too large. Joints whose torque reverses
get explicit steps, all others error-controlled ones (`simulation.explicit_steps`). A joint whose largest loads still
change by the last halving of the steps is reported as not resolved.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import kinds, measure_of
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import SIMULATED, STEPS_PER_ITERATION, UNSETTLED, VALID, Fidelity, Method, Options, Status
from tolstat.solver import stationary

TOLERANCE = 0.04
"""First tolerance of the error of a part of a step, as a load relative to the joint's largest
(`kernel.integrators.mesh`); each tighter one is an eighth (`kernel.revolution.resolve.TIGHTER`). Explicit steps are
halved instead."""
MIN_MAX_REVS = 48
"""Revolutions after which a joint that has not repeated is given up, unless `max_revs` is larger."""
STEP_ERROR, AT_STEPS = 0.07, 180
"""Mean error of the uniform steps above which a joint is refined. Its largest loads err by less, since ringing that the
steps do not resolve decays. With fewer steps a revolution than the second number the bound grows with the third power
of the step, as the error of smooth motion does."""
SWINGING_PSI, SWINGING_STEP_ERROR = 1.5e-3, 1e-3
"""|Psi| above which the output shaft swings about the ideal motion, and the mean error above which such a joint is
refined: errors of a swinging motion decay slowly, and BDF2 damps it. Both numbers come from 2759 joints that were
solved both ways, at 10, 30 and 100 N m and of the fuzz tests: of those not refined the worst is 0.8 % off."""
SHARP_STEP_ERROR = 1.5e-3
"""Mean error above which a joint with faces or friction is refined: it is one of loads (`kernel.revolution.settle`)."""
FINER = 4
"""Times as many uniform steps that joints with faces or friction get before error-controlled ones: where sliding
reverses or a face is reached they give the same accuracy in a quarter of the time (docs/notes/steps.md)."""
FEWER_PARTS = 2
"""Factor by which these steps have fewer parts in a closer look."""
MAX_CHANGE = 0.05
"""Change of the largest loads by the last halving of the steps above which a joint is not resolved. A method of order 2
leaves a third of it as error, or less."""
MAX_INTERVAL_WIDTH = 0.03
"""Width of a stationary joint's interval, relative to its largest load, up to which results of the uniform steps may
stand."""
COUNTS = ("steps", "newton_iterations", "halvings", "factorisations")
"""Counters of work, summed over all runs of a joint."""

Simulate = Callable[[NDArray[np.intp], Options], tuple[NDArray[np.void], NDArray[np.void]]]


def work(results: NDArray[np.void]) -> NDArray[np.float64]:
    """Work of simulating joints, (n,), in units of a Newton iteration; an explicit step is a fifth of one."""
    return np.asarray(results["newton_iterations"] + results["steps"] / STEPS_PER_ITERATION)


def may_refine(options: Options) -> bool:
    """Whether joints can be refined with these settings."""
    return options.fidelity == Fidelity.DYNAMIC and options.max_refinements > 0


def settings(options: Options) -> Options:
    """Settings of the second simulation of joints that are first simulated with `options`."""
    revs = max(options.max_revs, MIN_MAX_REVS)
    return options._replace(method=int(Method.TR_BDF2), rtol=TOLERANCE, max_revs=revs)


def refine(results: NDArray[np.void], options: Options, simulate: Simulate, mechanism: Mechanism = CARDAN) -> None:
    """Repeat joints that need it with finer steps, until their largest loads change no more.

    Parameters
    ----------
    results : ndarray of RESULT, shape (n,)
        Joints as simulated with `options`; refined ones are overwritten.
    options : Options
        Numerical settings; steps are halved at most ``max_refinements`` times.
    mechanism : Mechanism
        What the joints are.
    simulate : callable
        Indices (m,) of joints, Options -> their results, (m,) table RESULT, and the statistics of the revolutions of
        each, (m, revolutions), see `kernel.lanes.lockstep`.
    """
    if not may_refine(options):
        return
    coarse = max(1.0, AT_STEPS / options.steps_per_rev) ** 3
    sharp = bool(mechanism.faces) or mechanism.friction
    swings = results["psi_max"] > SWINGING_PSI if mechanism.rotations else False
    allowed = np.where(sharp, SHARP_STEP_ERROR, np.where(swings, SWINGING_STEP_ERROR, STEP_ERROR)) * coarse
    unsure = (results["status"] == Status.OK) & (results["step_error"] > allowed)
    if sharp:
        unsure[_with_finer_steps(np.flatnonzero(unsure), results, options, simulate)] = False
    rows = np.flatnonzero(unsure | np.isin(results["status"], UNSETTLED))
    if not rows.size:
        return
    refined, blocks = simulate(rows, settings(options))
    stationary.classify(refined, blocks, options.duration, mechanism)
    known = np.isin(refined["status"], SIMULATED)
    for name in COUNTS:
        refined[name] += results[name][rows]
    refined["step_error"] = results["step_error"][rows]
    agreed = (results["status"][rows] == Status.OK) & _agree(results[rows], refined, mechanism)
    if agreed.any():
        results[rows[agreed]], _ = simulate(rows[agreed], options)  # for the load histories of the uniform steps
    for name in COUNTS:
        results[name][rows[agreed]] = refined[name][agreed]
    rows, refined, known = rows[~agreed], refined[~agreed], known[~agreed]
    results["status"][rows[~known]] = Status.NOT_RESOLVED
    results[rows[known]] = refined[known]
    far = np.isin(refined["status"], VALID) & (refined["refinement_change"] > MAX_CHANGE)
    results["status"][rows[far]] = Status.NOT_RESOLVED


def _with_finer_steps(
    rows: NDArray[np.intp], results: NDArray[np.void], options: Options, simulate: Simulate
) -> NDArray[np.intp]:
    """Repeat joints with `FINER` times the steps; return those that these resolve, whose results are overwritten.

    Faces that are shifted turn the output shaft as far as swinging does: |Psi| says nothing of errors here.
    """
    if not rows.size:
        return rows
    finer = options._replace(
        steps_per_rev=FINER * options.steps_per_rev, peak_substeps=max(1, options.peak_substeps // FEWER_PARTS)
    )
    found, _ = simulate(rows, finer)
    for name in COUNTS:
        found[name] += results[name][rows]
        results[name][rows] = found[name]
    good = (found["status"] == Status.OK) & (found["step_error"] <= SHARP_STEP_ERROR)
    results[rows[good]] = found[good]
    return np.asarray(rows[good])


def _agree(plain: NDArray[np.void], refined: NDArray[np.void], mechanism: Mechanism) -> NDArray[np.bool_]:
    """Whether joints are stationary, with narrow intervals that contain the largest loads of the uniform steps.

    Loads that measure others are compared: those of the shafts may be next to nothing.
    """
    agree: NDArray[np.bool_] = refined["status"] == Status.STATIONARY
    for key in dict.fromkeys(measure_of(kind).key for kind in kinds(mechanism).values() if kind.decides):
        lower, upper = refined[f"{key}_lower"], refined[f"{key}_upper"]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = plain[f"{key}_max"].max(axis=1) / refined[f"{key}_max"].max(axis=1)
        agree &= (upper - lower <= MAX_INTERVAL_WIDTH) & (lower <= ratio) & (ratio <= upper)
    return agree
