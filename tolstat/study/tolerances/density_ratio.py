"""Ratio of two densities: of some joints, and its mean square and largest value, which say how many joints remain.

Joints of a sample count as so many after reweighting to the new density.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np

from tolstat.common.late import integrate
from tolstat.study.tolerances.correlation import Copula
from tolstat.study.tolerances.distributions import Array, Distribution, Normal, score
from tolstat.study.tolerances.zone_laws import Rayleigh

MIDPOINTS = 1000
"""Number of midpoints in probability, for the mean square on a band."""
NODES, END = 1001, 1e-10
"""Number of nodes in each half of a distribution, and probability of the outermost node."""
GROWTH = 0.01
"""Growth of the logarithm of a ratio over the outermost decade of probability from which on it has no bound."""


def log_ratios(
    new: Mapping[str, Distribution],
    old: Mapping[str, Distribution],
    copula: Copula,
    values: Callable[[str], Array],
    n: int,
) -> Array:
    """Logarithm of new over old density of the errors of some joints.

    Parameters
    ----------
    new : dict of str to Distribution
        What quantities that change are drawn from.
    old : dict of str to Distribution
        What all quantities were drawn from.
    copula : Copula
        Their correlation, which stays.
    values : callable
        Name of a quantity -> its values, (n,).
    n : int
        Number of joints.

    Returns
    -------
    ndarray, (n,)
        Zero where nothing changes.
    """
    logs = np.zeros(n)
    for name, law in new.items():
        logs += law.logpdf(values(name)) - old[name].logpdf(values(name))
    if set(copula.names) & set(new):
        # density of the Gaussian copula: correlated over independent normal density
        form = np.linalg.inv(copula.matrix) - np.eye(len(copula.names))
        for sign, laws in ((-0.5, {**old, **new}), (0.5, old)):
            z = np.column_stack([score(laws[name], values(name)) for name in copula.names])
            logs += sign * np.einsum("ni,ij,nj->n", z, form, z)
    return logs


class Exact(NamedTuple):
    """What the density ratio new / old is over all joints that could be drawn, in logarithms.

    Those of independent errors add up.

    Attributes
    ----------
    mean_square : float
        Mean square of the ratio over joints drawn from the old distribution: 1 plus Pearson's chi-squared divergence.
        Reweighted, n of these joints count as n over the mean square. Infinite where the new one has other values.
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
    return Exact(*(sum(parts) for parts in zip(Exact(), *(of_error(*pair) for pair in pairs), strict=True)))


def unbounded(distribution: Distribution) -> bool:
    """Whether an end of the support is infinite, so that a wider distribution of the same kind has the same support."""
    with np.errstate(divide="ignore"):
        return not np.isfinite(distribution.ppf(np.array([0.0, 1.0]))).all()


def of_error(new: Distribution, old: Distribution) -> Exact:
    """Density ratio of one error, of two distributions of one kind.

    In closed form for two normal distributions and for two Rayleigh distributions without an upper end, otherwise
    integrated over the probability of `new`: in equal steps on a band, whose outermost half steps may lie outside that
    of `old`, else in steps of its logarithm from both ends.
    """
    if isinstance(new, Normal) and isinstance(old, Normal):
        square, largest = _of_normals(new.sigma / old.sigma, (new.mean - old.mean) / old.sigma)
    elif isinstance(new, Rayleigh) and isinstance(old, Rayleigh) and new.upper is None and old.upper is None:
        # both coordinates are normal
        square, largest = (2.0 * of_coordinate for of_coordinate in _of_normals(new.sigma / old.sigma))
    else:
        square, largest = _integrated(new, old)
        if not unbounded(new):
            x = new.ppf((np.arange(MIDPOINTS) + 0.5) / MIDPOINTS)
            square = float(np.log(np.mean(np.exp(new.logpdf(x) - old.logpdf(x)))))
    return Exact(square, 0.0 if math.isfinite(largest) else square, largest)


def _of_normals(ratio: float, shift: float = 0.0) -> tuple[float, float]:
    """Logarithms of mean square and largest ratio of normal densities.

    `ratio` is that of the deviations, `shift` that of the mean in old deviations.
    """
    room = 2.0 - ratio**2
    square = shift**2 / room - math.log(ratio * math.sqrt(room)) if room > 0 else math.inf
    if ratio < 1.0:
        return square, 0.5 * shift**2 / (1.0 - ratio**2) - math.log(ratio)
    return square, 0.0 if ratio == 1.0 and shift == 0.0 else math.inf


def _integrated(new: Distribution, old: Distribution) -> tuple[float, float]:
    """Logarithms of mean square and largest density ratio.

    The mean square over `old` is the mean over `new`. Beyond `END` the ratio is continued as the power of the
    probability that it follows in the last decade: it has no bound if it still grows there, and with an exponent of -1
    or less the mean is infinite.
    """
    u, total, largest = np.geomspace(END, 0.5, NODES), 0.0, -math.inf
    decade = int(np.searchsorted(u, 10.0 * END))
    for x in (new.ppf(u), new.ppf(1.0 - u)):
        logs = new.logpdf(x) - old.logpdf(x)
        if np.isposinf(logs).any() or logs[0] - logs[decade] >= math.log(u[decade] / END):
            return math.inf, math.inf
        exponent = (logs[decade] - logs[0]) / math.log(u[decade] / END)
        total += integrate.simpson(np.exp(logs) * u, x=np.log(u)) + math.exp(logs[0]) * END / (1.0 + exponent)
        largest = max(largest, math.inf if logs[0] > logs[decade] + GROWTH else float(np.nanmax(logs)))
    return math.log(total), largest
