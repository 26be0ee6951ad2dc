"""Tolerance allocation: the cheapest tolerances that keep loads below limits, estimated from the joints drawn.

Each joint is weighted with the likelihood ratio of other tolerances (`reweight`). The search stays in the region where
enough joints remain effective. It uses half of the joints; the other half serves as an independent check of the choice.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import reweight
from tolstat.analysis.binomial import clopper_pearson
from tolstat.analysis.weighted import Split
from tolstat.common.late import optimize
from tolstat.common.loads import FloatArray

FEWEST = 10
"""Minimum number of joints above each limit for a search that aims at the estimated shares."""
REGION = 0.3
"""Minimum share of the joints that is effective, in expectation, within the search region."""


class Problem(NamedTuple):
    """Objective, constraints and bounds of a search.

    Attributes
    ----------
    log_ratios : callable
        Maps factors on the tolerances, (g,), to the logarithm of new over old density of each joint, (n,).
    log_spread : callable
        Maps factors to the logarithm of the mean square of that ratio under the old tolerances (1 plus Pearson's
        chi-squared divergence): n joints have n over that mean square effective ones. It is exact, because the weights
        of a sample underestimate it where no joint was drawn.
    usable : callable
        Maps factors to whether shares can be estimated from these joints, see `reweight.Ratios.usable`.
    above : ndarray of bool, shape (n, c)
        Which joints are above each of c limits.
    targets : ndarray, shape (c,)
        Shares that must not be exceeded.
    cost : callable
        Maps factors to their cost.
    lower, upper : ndarray, shape (g,)
        Bounds of the factors.
    iid : bool
        Whether the joints are independent samples.
    confidence : float
        Confidence level of the intervals.
    """

    log_ratios: Callable[[FloatArray], FloatArray]
    log_spread: Callable[[FloatArray], float]
    usable: Callable[[FloatArray], bool]
    above: NDArray[np.bool_]
    targets: FloatArray
    cost: Callable[[FloatArray], float]
    lower: FloatArray
    upper: FloatArray
    iid: bool = True
    confidence: float = 0.95


class Choice(NamedTuple):
    """Result of a search.

    Attributes
    ----------
    factors : ndarray, shape (g,)
        Factors on the tolerances.
    aim : str
        What does not exceed the targets. ``interval``: the upper ends of the intervals; ``estimate``: the estimated
        shares; ``step``: neither is feasible in the search region, and the factors give the lowest shares there.
    """

    factors: FloatArray
    aim: str


def search(problem: Problem) -> Choice:
    """Find the cheapest factors in the region where enough joints remain effective.

    Sequential quadratic programming (Kraft 1988) on the logarithms of the factors, started at the present tolerances
    and at those with the lowest shares. The region has at least `reweight.LEAST_ESS` effective joints; the required
    share is raised, up to 0.9, while the weights of the choice are not `usable`.

    Parameters
    ----------
    problem : Problem
        Objective, constraints and bounds.

    Returns
    -------
    Choice
        The factors, and the constraint that they meet.
    """
    share = max(REGION, reweight.LEAST_ESS / len(problem.above))
    while not problem.usable((choice := _within(problem, share)).factors) and share < 0.9:
        share = min(1.5 * share, 0.9)
    return choice


def _within(problem: Problem, share: float) -> Choice:
    """Search where at least `share` of the joints is effective."""
    lowest = _lowest(problem, share)
    starts = [np.zeros(len(problem.lower)), lowest]
    enough = not problem.iid or problem.above.sum(axis=0).min() >= FEWEST
    aims = ["interval"] * problem.iid + ["estimate"] * bool(enough)
    for aim in aims:
        feasible = [x for x in (_cheapest(problem, share, aim, start) for start in starts) if x is not None]
        if feasible:
            return Choice(np.exp(min(feasible, key=lambda x: problem.cost(np.exp(x)))), aim)
    return Choice(np.exp(lowest), "step")


def _room(problem: Problem, x: FloatArray, share: float) -> float:
    """Constraint of the region: logarithm of the effective share over `share`, not negative inside."""
    return float(np.clip(-problem.log_spread(np.exp(x)) - np.log(share), -30.0, 30.0))


def _cheapest(problem: Problem, share: float, aim: str, start: FloatArray) -> FloatArray | None:
    """Logarithms of the cheapest factors that meet the constraints; None if none are found."""
    scale = problem.cost(np.ones(len(start)))

    def room(x: FloatArray) -> FloatArray:
        over = np.log(problem.targets / np.maximum(_shares(problem, x, aim), 1e-12))
        return np.append(over, _room(problem, x, share))

    x = _minimise(lambda x: problem.cost(np.exp(x)) / scale, room, problem, start)
    return x if (room(x) >= -1e-6).all() else None


def _lowest(problem: Problem, share: float) -> FloatArray:
    """Logarithms of the factors in the region that minimise the largest ratio of share to target."""

    def height(x: FloatArray) -> float:
        shares = _shares(problem, x, "estimate") + 0.5 / len(problem.above)
        return float(np.log(shares / problem.targets).max())

    start = np.zeros(len(problem.lower))
    x = _minimise(height, lambda x: np.atleast_1d(_room(problem, x, share)), problem, start)
    while _room(problem, x, share) < -1e-6:  # SLSQP may end outside: shrink towards the present tolerances
        x = 0.9 * x
    return x


def _minimise(
    what: Callable[[FloatArray], float], room: Callable[[FloatArray], FloatArray], problem: Problem, start: FloatArray
) -> FloatArray:
    low, high = np.log(problem.lower), np.log(problem.upper)
    settings: Any = {"method": "SLSQP", "options": {"maxiter": 60, "ftol": 1e-5, "eps": 1e-4}}
    constraint = {"type": "ineq", "fun": room}
    settings |= {"bounds": optimize.Bounds(low, np.maximum(high, low + 1e-9)), "constraints": constraint}
    result = optimize.minimize(what, np.clip(start, low, high), **settings)
    return np.asarray(np.clip(result.x, low, high), dtype=float)


def _shares(problem: Problem, x: FloatArray, aim: str) -> FloatArray:
    """Share of the joints above each limit, or its upper end for ``interval``."""
    logs = problem.log_ratios(np.exp(x))
    if np.isneginf(logs.max()):  # none of the joints is possible with these tolerances, so that they tell nothing
        return np.ones(problem.above.shape[1])
    ratios = np.exp(logs - logs.max())
    splits = [Split.by(column, ratios) for column in problem.above.T]
    if aim == "estimate":
        return np.array([split.share[0] for split in splits])
    return np.array([split.interval(problem.confidence)[1][0] for split in splits])


def joints_needed(share: float, ess: float, target: float, confidence: float = 0.95) -> float:
    """Factor on the number of joints with which an interval lies below a target, if the share is as estimated.

    Parameters
    ----------
    share : float
        Estimate.
    ess : float
        Effective number of joints behind the estimate.
    target : float
        Share that the upper end must be below.
    confidence : float
        Confidence level of the interval.

    Returns
    -------
    float
        Factor, a power of two; inf where the estimate itself is not below the target.

    Examples
    --------
    >>> joints_needed(share=0.002, ess=1000, target=0.01)
    1.0
    >>> joints_needed(share=0.008, ess=1000, target=0.01)
    16.0
    """
    factors = 2.0 ** np.arange(0, 24)
    upper = clopper_pearson(share * ess * factors, ess * factors, confidence)[1]
    enough = np.flatnonzero(upper < target)
    return float(factors[enough[0]]) if enough.size and share < target else np.inf


def halves(units: NDArray[np.intp], most: int) -> Sequence[NDArray[np.intp]]:
    """Split joints: every second independent unit, at most `most` joints, for the search; all others for the check.

    Parameters
    ----------
    units : ndarray of int, shape (n,)
        Unit of each joint, see `Design.units`.
    most : int
        Maximum number of joints for the search.
    """
    rows = np.arange(units.size)
    chosen = rows[units % 2 == 0][:most]
    return chosen, np.setdiff1d(rows, chosen, assume_unique=True)
