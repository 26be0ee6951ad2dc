"""Mean square and largest value of the ratio of two densities: how many joints remain effective after reweighting."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from tolstat.study.tolerances.distributions import Distribution, Normal
from tolstat.study.tolerances.radial import Rayleigh

MIDPOINTS = 1000
"""Number of midpoints in probability, for distributions on a band."""
TAIL_NODES, END = 1001, 1e-10
"""Number of nodes in each half of an unbounded distribution, and probability of its outermost node."""
GROWTH = 0.01
"""Growth of the logarithm of a ratio over the outermost decade of probability from which on it has no bound."""


class Exact(NamedTuple):
    """What the density ratio of independent errors is over all joints that could be drawn, in logarithms.

    Attributes
    ----------
    mean_square : float
        Mean square of the ratio.
    unbounded : float
        Mean square of the ratio of those errors alone whose ratio has no bound; 0 without any.
    largest : float
        Largest ratio; infinite without a bound.
    """

    mean_square: float = 0.0
    unbounded: float = 0.0
    largest: float = 0.0


def exact(pairs: Iterable[tuple[Distribution, Distribution]]) -> Exact:
    """Sum up the errors of a joint, each with its new and its old distribution."""
    found = Exact()
    for new, old in pairs:
        square, largest = log_mean_square(new, old), log_largest(new, old)
        open_square = 0.0 if math.isfinite(largest) else square
        found = Exact(found.mean_square + square, found.unbounded + open_square, found.largest + largest)
    return found


def unbounded(found: Distribution) -> bool:
    """Whether an end of the support is infinite, so that a wider distribution of the same kind has the same support."""
    with np.errstate(divide="ignore"):
        return not np.isfinite(found.ppf(np.array([0.0, 1.0]))).all()


def log_mean_square(new: Distribution, old: Distribution) -> float:
    """Logarithm of the mean square of the density ratio `new` / `old` over errors drawn from `old`.

    The mean square is 1 plus Pearson's chi-squared divergence: n joints drawn from `old` count, reweighted to `new`,
    as n over the mean square.

    Parameters
    ----------
    new, old : Distribution
        Distributions of one kind.

    Returns
    -------
    float
        In closed form for two normal distributions and for two Rayleigh distributions without an upper end, otherwise
        integrated. Infinite if the mean square is, or where `new` has values that `old` does not have.
    """
    if isinstance(new, Normal) and isinstance(old, Normal):
        return _of_normals(new.sigma / old.sigma, (new.mean - old.mean) / old.sigma)
    if isinstance(new, Rayleigh) and isinstance(old, Rayleigh) and new.upper is None and old.upper is None:
        return 2.0 * _of_normals(new.sigma / old.sigma)  # both coordinates are normal
    return _over_tails(new, old) if unbounded(new) else _over_band(new, old)


def log_largest(new: Distribution, old: Distribution) -> float:
    """Logarithm of the largest density ratio `new` / `old`; infinite where the ratio has no bound.

    In closed form as `log_mean_square`, otherwise the largest at steps of the probability of `new`: at the same steps
    from both ends, and it has no bound if it still grows as a power of the probability at an end.
    """
    if isinstance(new, Normal) and isinstance(old, Normal):
        return _largest_of_normals(new.sigma / old.sigma, (new.mean - old.mean) / old.sigma)
    if isinstance(new, Rayleigh) and isinstance(old, Rayleigh) and new.upper is None and old.upper is None:
        return 2.0 * _largest_of_normals(new.sigma / old.sigma)
    u, largest = np.geomspace(END, 0.5, TAIL_NODES), -math.inf
    decade = int(np.searchsorted(u, 10.0 * END))
    for x in (new.ppf(u), new.ppf(1.0 - u)):
        logs = new.logpdf(x) - old.logpdf(x)
        if np.isposinf(logs).any() or logs[0] > logs[decade] + GROWTH:
            return math.inf
        largest = max(largest, float(np.nanmax(logs)))
    return largest


def _largest_of_normals(ratio: float, shift: float = 0.0) -> float:
    """``log_largest`` of normal distributions; parameters as in `_of_normals`."""
    if ratio < 1.0:
        return 0.5 * shift**2 / (1.0 - ratio**2) - math.log(ratio)
    return 0.0 if ratio == 1.0 and shift == 0.0 else math.inf


def _of_normals(ratio: float, shift: float = 0.0) -> float:
    """``log_mean_square`` of normal distributions; `ratio` of the deviations, `shift` of the mean in old deviations."""
    room = 2.0 - ratio**2
    return shift**2 / room - math.log(ratio * math.sqrt(room)) if room > 0 else math.inf


def _over_band(new: Distribution, old: Distribution) -> float:
    """Mean of the ratio over `new`, which is the mean of its square over `old`, at equal steps of probability."""
    x = new.ppf((np.arange(MIDPOINTS) + 0.5) / MIDPOINTS)
    return float(np.log(np.mean(np.exp(new.logpdf(x) - old.logpdf(x)))))


def _over_tails(new: Distribution, old: Distribution) -> float:
    """The same for an unbounded distribution, in steps of the logarithm of the probability from both ends.

    Beyond `END` the ratio is continued as the power of the probability that it follows in the last decade; with an
    exponent of -1 or less the mean is infinite.
    """
    from scipy.integrate import simpson

    u, total = np.geomspace(END, 0.5, TAIL_NODES), 0.0
    decade = int(np.searchsorted(u, 10.0 * END))
    for x in (new.ppf(u), new.ppf(1.0 - u)):
        logs = new.logpdf(x) - old.logpdf(x)
        if np.isposinf(logs).any():
            return math.inf
        exponent = (logs[decade] - logs[0]) / math.log(u[decade] / END)
        if exponent <= -1.0:
            return math.inf
        total += simpson(np.exp(logs) * u, x=np.log(u)) + math.exp(logs[0]) * END / (1.0 + exponent)
    return math.log(total)
