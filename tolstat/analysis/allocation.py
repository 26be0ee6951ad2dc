"""The cheapest tolerances that keep loads below limits, as far as the joints drawn can tell.

Each joint counts by how much more often other tolerances make it (`reweight`); what the weights can carry is the region
that the search stays in. Half of the joints choose; the other half, which had no part in it, is to judge the choice.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import reweight
from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.reweight import Weights

FEWEST = 10
"""Joints above a limit from which on a search may rest on the estimate of their share."""
REGION = 0.3
"""Share of the joints that must be left effective, on the average, where the search goes."""
_EDGE = 1e-9


class Problem(NamedTuple):
    """What is searched.

    Attributes
    ----------
    log_ratios : callable
        Factors on the tolerances, (g,), to the logarithm of the new density of each joint over the old one, (n,).
    log_spread : callable
        Factors to the logarithm of the mean square of that ratio over all joints that the old tolerances make (1 more
        than Pearson's chi-squared divergence): n joints are worth n over it. The weights of a sample know it too well
        to be asked, since the joints that would tell are missing in it.
    above : ndarray of bool, shape (n, c)
        Which joints are above each of c limits.
    targets : ndarray, shape (c,)
        Shares that must not be exceeded.
    cost : callable
        Factors to their cost.
    lower, upper : ndarray, shape (g,)
        Ends of the factors.
    iid : bool
        Whether the joints are independent samples.
    confidence : float
        Of the intervals.
    """

    log_ratios: Callable[[FloatArray], FloatArray]
    log_spread: Callable[[FloatArray], float]
    above: NDArray[np.bool_]
    targets: FloatArray
    cost: Callable[[FloatArray], float]
    lower: FloatArray
    upper: FloatArray
    iid: bool = True
    confidence: float = 0.95


class Choice(NamedTuple):
    """What a search came to.

    Attributes
    ----------
    factors : ndarray, shape (g,)
        On the tolerances.
    aim : str
        ``interval``: upper ends of the intervals below the targets; ``estimate``: the shares themselves;
        ``step``: neither can be had within reach of the joints, and the shares are as low there as can be.
    """

    factors: FloatArray
    aim: str


def search(problem: Problem) -> Choice:
    """Find the cheapest factors within reach of the joints.

    Sequential quadratic programming (Kraft 1988) on the logarithms of the factors, from the tolerances as they are and
    from those with the lowest shares; the region has `reweight.LEAST_ESS` effective joints or more, and more of them
    where the Pareto shape of the weights' tail asks for it.

    Parameters
    ----------
    problem : Problem
        What to search.

    Returns
    -------
    Choice
        The factors, and what could be aimed at.
    """
    share = max(REGION, reweight.LEAST_ESS / len(problem.above))
    choice = _within(problem, share)
    while not reweight.smooth(problem.log_ratios(choice.factors)).usable and share < 0.9:
        share = min(1.5 * share, 0.9)
        choice = _within(problem, share)
    return choice


def _within(problem: Problem, share: float) -> Choice:
    """Search where at least that share of the joints is left effective."""
    lowest = _lowest(problem, share)
    starts = [np.zeros(len(problem.lower)), lowest]
    enough = not problem.iid or problem.above.sum(axis=0).min() >= FEWEST
    aims = ["interval"] * problem.iid + ["estimate"] * bool(enough)
    for aim in aims:
        found = [x for x in (_cheapest(problem, share, aim, start) for start in starts) if x is not None]
        if found:
            return Choice(np.exp(min(found, key=lambda x: problem.cost(np.exp(x)))), aim)
    return Choice(np.exp(lowest), "step")


def _room(problem: Problem, x: FloatArray, share: float) -> float:
    """Distance from the edge of the region, a logarithm: not negative inside."""
    return float(np.clip(-problem.log_spread(np.exp(x)) - np.log(share), -30.0, 30.0))


def _cheapest(problem: Problem, share: float, aim: str, start: FloatArray) -> FloatArray | None:
    """Logarithms of the cheapest factors that hold; None where none are found."""
    scale = problem.cost(np.ones(len(start)))

    def room(x: FloatArray) -> FloatArray:
        over = np.log(problem.targets / np.maximum(_shares(problem, x, aim), 1e-12))
        return np.append(over, _room(problem, x, share))

    x = _minimise(lambda x: problem.cost(np.exp(x)) / scale, room, problem, start)
    return x if (room(x) >= -1e-6).all() else None


def _lowest(problem: Problem, share: float) -> FloatArray:
    """Logarithms of the factors with the lowest shares, over the targets, within the region."""

    def height(x: FloatArray) -> float:
        shares = _shares(problem, x, "estimate") + 0.5 / len(problem.above)
        return float(np.log(shares / problem.targets).max())

    start = np.zeros(len(problem.lower))
    x = _minimise(height, lambda x: np.atleast_1d(_room(problem, x, share)), problem, start)
    while _room(problem, x, share) < -1e-6:  # a program that ends outside still says which way
        x = 0.9 * x
    return x


def _minimise(
    what: Callable[[FloatArray], float], room: Callable[[FloatArray], FloatArray], problem: Problem, start: FloatArray
) -> FloatArray:
    from scipy.optimize import Bounds, minimize

    low, high = np.log(problem.lower), np.log(problem.upper)
    settings: Any = {"method": "SLSQP", "options": {"maxiter": 60, "ftol": 1e-5, "eps": 1e-4}}
    settings |= {"bounds": Bounds(low, np.maximum(high, low + _EDGE)), "constraints": {"type": "ineq", "fun": room}}
    found = minimize(what, np.clip(start, low, high), **settings)
    return np.asarray(np.clip(found.x, low, high), dtype=float)


def _shares(problem: Problem, x: FloatArray, aim: str) -> FloatArray:
    """Share of the joints above each limit, or its upper end; weights as they are."""
    logs = problem.log_ratios(np.exp(x))
    raw = np.exp(logs - logs.max())
    values = raw / raw.sum()
    if aim == "estimate":
        return np.asarray(values @ problem.above)
    weights = Weights(values, float(1.0 / (values**2).sum()), 0.0, 1.0)
    return np.array([reweight.share_above(c, weights, 0.5, problem.confidence).upper for c in problem.above.T])


def joints_needed(share: float, ess: float, target: float, confidence: float = 0.95) -> float:
    """How many times as many joints show that a share is below a target, if it is as estimated.

    Parameters
    ----------
    share : float
        Estimate.
    ess : float
        Effective joints that it stands on.
    target : float
        Share that the upper end must be below.
    confidence : float
        Of the interval.

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
    from tolstat.analysis.exceedance import clopper_pearson

    factors = 2.0 ** np.arange(0, 24)
    upper = clopper_pearson(share * ess * factors, ess * factors, confidence)[1]
    enough = np.flatnonzero(upper < target)
    return float(factors[enough[0]]) if enough.size and share < target else np.inf


def halves(n: int, most: int) -> Sequence[NDArray[np.intp]]:
    """Joints that choose, at most `most` of them, and those that judge: every other one each."""
    rows = np.arange(n)
    chosen = rows[::2][:most]
    return chosen, np.setdiff1d(rows, chosen, assume_unique=True)
