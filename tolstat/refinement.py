"""Joints whose loads have bends that the steps do not resolve, once more with finer steps.

A joint whose largest loads still change at the finest steps is unresolved, and is said to be.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tolstat.tables import SIMULATED, UNSETTLED, Fidelity, Method, Options, Status

FACTOR = 4
"""Steps of a refinement in one of those before."""
MOST_STEPS = 20_000
"""No refinement has more steps a revolution."""
ROUGH, AT_STEPS = 0.02, 180
"""Roughness above which a joint is refined, and the steps a revolution up to which the bends of smooth loads decide it:
they go with the square of a step."""
RESOLVED = 2e-3
"""Change of the largest loads at which a refinement is the last if it leaves no roughness, relative to their kind's."""
LIVELY, SMOOTH = 1.5e-3, 1e-3
"""|Psi| and roughness above which deviations from the ideal motion are lively: their ringing can be damped at few steps
to less than shows as roughness, and change little from one refinement to the next before it is resolved."""
SURE_STEPS = 2880
"""Steps a revolution to which lively joints are refined even if nothing changes."""
TOLERANCE, WATCHED = 2e-2, 48
UNRESOLVED = 3e-2
"""Change in the last refinement allowed that a joint may not exceed."""
COUNTS = ("steps", "newton_iterations", "halvings", "factorisations")
"""What a joint has cost: all its runs together."""

Simulate = Callable[[NDArray[np.intp], Options], NDArray[np.void]]


def refine(results: NDArray[np.void], options: Options, simulate: Simulate) -> None:
    """Simulate rough and lively joints again with finer steps, until they change no more.

    Parameters
    ----------
    results : ndarray of RESULT, shape (n,)
        Joints as simulated with `options`; refined ones are overwritten.
    options : Options
        Numerical settings, with at most ``max_refinements``.
    simulate : callable
        Indices (m,) of joints, Options -> their results, (m,) table RESULT.
    """
    if options.fidelity != Fidelity.DYNAMIC:
        return
    coarse = max(1.0, AT_STEPS / options.steps_per_rev) ** 2
    lively = (results["psi_max"] > LIVELY) & (results["roughness"] > SMOOTH * coarse)
    unsure = lively | (results["roughness"] > ROUGH * coarse)
    unsure = np.where(results["status"] == Status.OK, unsure, np.isin(results["status"], UNSETTLED))
    rows = np.flatnonzero(unsure)
    if not rows.size or not options.max_refinements:
        return
    method, revs = int(Method.TR_BDF2), max(options.max_revs, WATCHED)
    found, blocks = simulate(rows, options._replace(method=method, rtol=TOLERANCE, max_revs=revs))
    known = np.isin(found["status"], SIMULATED)
    for name in COUNTS:
        found[name] += results[name][rows]
    results["status"][rows[~known]] = Status.NOT_RESOLVED
    results[rows[known]] = found[known]
    far = (found["status"] == Status.OK) & (found["refinement_change"] > UNRESOLVED)
    results["status"][rows[far]] = Status.NOT_RESOLVED


def changes(before: NDArray[np.void], after: NDArray[np.void]) -> NDArray[np.float64]:
    """Largest change of any largest |F| or |T|, relative to the largest of the kind; NaN without results, (m,)."""
    worst = np.zeros(len(after))
    for name in ("F_max", "T_max"):
        size = after[name].max(axis=1)
        change = np.abs(after[name] - before[name]).max(axis=1)
        worst = np.maximum(worst, np.divide(change, size, out=np.zeros(len(after)), where=size != 0))
    return np.asarray(worst)
