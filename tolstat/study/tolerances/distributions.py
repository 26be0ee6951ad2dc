"""Distributions of errors: distribution functions and their inverses, moments, normal scores."""

from __future__ import annotations

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import input_error
from tolstat.common.late import special

Array = NDArray[np.float64]

NODES = np.linspace(-8.5, 8.5, 6801)
"""Normal scores of the trapezoidal rule, which converges faster than any power of the step here."""
NEGLIGIBLE = 1e-12
"""Shares below this are rounding errors of 1 less a share."""


class Moments(NamedTuple):
    """Mean and standard deviation, SI."""

    mean: float
    deviation: float

    @property
    def mean_square(self) -> float:
        """Mean of the square."""
        return self.mean**2 + self.deviation**2


@dataclass(frozen=True)
class Distribution(ABC):
    """Distribution of one error, in SI units."""

    @abstractmethod
    def ppf(self, u: Array) -> Array:
        """Return the value that is exceeded with probability 1 - u.

        Parameters
        ----------
        u : ndarray, (n,)
            Probabilities; at 0 and 1 the ends of the support, which may be infinite.

        Returns
        -------
        ndarray, (n,)
            Values in the error's SI unit, monotone in `u`.
        """

    @abstractmethod
    def cdf(self, x: Array) -> Array:
        """Return the probability of values up to and including `x`, SI, elementwise."""

    def rank(self, x: Array) -> Array:
        """Return the probability of smaller values than `x`, and half that of `x` itself, elementwise."""
        return self.cdf(x)

    @property
    def moments(self) -> Moments:
        """Mean and standard deviation."""
        mean = self.expect(lambda x: x)
        return Moments(mean, math.sqrt(self.expect(lambda x: (x - mean) ** 2)))

    def expect(self, function: Callable[[Array], Array]) -> float:
        """Return the mean of a function of the values, by the trapezoidal rule over their normal scores."""
        # the upper half from its own tail would need a survival function: beyond a score of 8 ndtr rounds to 1
        values = self.ppf(np.minimum(special.ndtr(NODES), 1.0 - 2.0**-53))
        return float(np.average(function(values), weights=np.exp(-0.5 * NODES**2)))

    def outside(self, lower: float, upper: float) -> float:
        """Return the share outside the band from `lower` to `upper`, SI."""
        below, up_to = self.cdf(np.array([lower, upper])).tolist()
        share = below + (1.0 - up_to)
        return share if share > NEGLIGIBLE else 0.0

    def describe(self) -> dict[str, Any]:
        """Kind and parameters, as JSON values: everything that determines the values drawn; by default all fields."""
        return {"distribution": type(self).__name__.lower(), **asdict(self)}

    def openturns(self, ot: Any) -> Any:
        """Return the same distribution of OpenTURNS, of its module `ot`; raises an InputError where there is none."""
        raise input_error(type(self).__name__, "has no equal in OpenTURNS", "take the unit cube: openturns(cube=True)")


def share_between(a: float | Array, b: float | Array) -> Array:
    """Probability of normal scores from a to b, elementwise; from the nearer tail, which keeps digits."""
    return np.where(np.asarray(a) > 0, special.ndtr(-a) - special.ndtr(-b), special.ndtr(b) - special.ndtr(a))


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal distribution with `mean` and standard deviation `sigma`."""

    mean: float
    sigma: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return self.mean + self.sigma * special.ndtri(u)

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        return np.asarray(special.ndtr((x - self.mean) / self.sigma))

    @property
    def moments(self) -> Moments:
        """See `Distribution.moments`."""
        return Moments(self.mean, self.sigma)

    def openturns(self, ot: Any) -> Any:
        """See `Distribution.openturns`."""
        return ot.Normal(self.mean, self.sigma)


@dataclass(frozen=True)
class TruncatedNormal(Distribution):
    """Normal distribution, with `mean` and `sigma` before parts outside the band are rejected."""

    mean: float
    sigma: float
    lower: float
    upper: float

    @property
    def _span(self) -> tuple[float, float, float]:
        """Scores of both ends before the truncation, and the share between them."""
        a, b = (self.lower - self.mean) / self.sigma, (self.upper - self.mean) / self.sigma
        return a, b, float(share_between(a, b))

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        a, b, _ = self._span
        # each half from its own tail: probabilities near 1 have fewer significant digits than those near 0
        low = special.ndtri(special.ndtr(a) + u * (special.ndtr(b) - special.ndtr(a)))
        high = -special.ndtri(special.ndtr(-b) + (1 - u) * (special.ndtr(-a) - special.ndtr(-b)))
        return np.clip(self.mean + self.sigma * np.where(low <= 0, low, high), self.lower, self.upper)

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        a, b, share = self._span
        z = np.clip((x - self.mean) / self.sigma, a, b)
        return share_between(a, z) / share

    def openturns(self, ot: Any) -> Any:
        """See `Distribution.openturns`."""
        return ot.TruncatedNormal(self.mean, self.sigma, self.lower, self.upper)


@dataclass(frozen=True)
class Uniform(Distribution):
    """Uniform distribution on the band."""

    lower: float
    upper: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return self.lower + (self.upper - self.lower) * u

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        return np.clip((x - self.lower) / (self.upper - self.lower), 0.0, 1.0)

    def openturns(self, ot: Any) -> Any:
        """See `Distribution.openturns`."""
        return ot.Uniform(self.lower, self.upper)


@dataclass(frozen=True)
class Triangular(Distribution):
    """Triangular distribution on the band, most likely at `peak`."""

    lower: float
    upper: float
    peak: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        width, rise, fall = self.upper - self.lower, self.peak - self.lower, self.upper - self.peak
        below = self.lower + np.sqrt(u * width * rise)
        above = self.upper - np.sqrt((1 - u) * width * fall)
        return np.where(u * width <= rise, below, above)

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        x = np.clip(x, self.lower, self.upper)
        width, rise, fall = self.upper - self.lower, self.peak - self.lower, self.upper - self.peak
        below = (x - self.lower) ** 2 / (width * (rise or 1.0))
        above = 1.0 - (self.upper - x) ** 2 / (width * (fall or 1.0))
        return np.where(x < self.peak, below, above)

    def openturns(self, ot: Any) -> Any:
        """See `Distribution.openturns`."""
        return ot.Triangular(self.lower, self.peak, self.upper)


@dataclass(frozen=True)
class LogNormal(Distribution):
    """Lognormal distribution: ``threshold + exp(y)``, where y is (truncated) normal."""

    threshold: float
    log: Normal | TruncatedNormal

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return self.threshold + np.exp(self.log.ppf(u))

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        above = x > self.threshold
        return np.where(above, self.log.cdf(np.log(np.where(above, x - self.threshold, 1.0))), 0.0)

    def openturns(self, ot: Any) -> Any:
        """See `Distribution.openturns`."""
        whole = ot.LogNormal(self.log.mean, self.log.sigma, self.threshold)
        if isinstance(self.log, Normal):
            return whole
        ends = (self.threshold + float(np.exp(end)) for end in (self.log.lower, self.log.upper))
        return ot.TruncatedDistribution(whole, *ends)


@dataclass(frozen=True)
class Beta(Distribution):
    """Beta distribution with shapes `a` and `b`, stretched over the band."""

    a: float
    b: float
    lower: float
    upper: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return self.lower + (self.upper - self.lower) * special.betaincinv(self.a, self.b, u)

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        t = np.clip((x - self.lower) / (self.upper - self.lower), 0.0, 1.0)
        return np.asarray(special.betainc(self.a, self.b, t))

    def openturns(self, ot: Any) -> Any:
        """See `Distribution.openturns`."""
        return ot.Beta(self.a, self.b, self.lower, self.upper)


@dataclass(frozen=True)
class Measured(Distribution):
    """Empirical distribution of measured parts: every draw is one of the measured values.

    The inverse of the empirical distribution function, so mean and deviation are those of the sample;
    nothing is interpolated or drawn beyond what was measured.

    Attributes
    ----------
    values : ndarray, (m,)
        Measured values, ascending.
    digest : str
        Digest of the values, which replaces them in a study's identity.
    """

    values: Array = field(repr=False, compare=False)
    digest: str

    @classmethod
    def of(cls, values: Iterable[float]) -> Measured:
        """Empirical distribution of `values` (SI) in any order."""
        ordered = np.sort(np.asarray(list(values), dtype="<f8"))
        return cls(ordered, hashlib.sha256(ordered.tobytes()).hexdigest())

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        index = np.ceil(u * self.values.size).astype(np.intp) - 1
        return self.values[np.clip(index, 0, self.values.size - 1)]

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        return np.asarray(np.searchsorted(self.values, x, "right") / self.values.size)

    def rank(self, x: Array) -> Array:
        """See `Distribution.rank`."""
        return 0.5 * (self.cdf(x) + np.searchsorted(self.values, x, "left") / self.values.size)

    def expect(self, function: Callable[[Array], Array]) -> float:
        """See `Distribution.expect`; of the sample."""
        return float(np.mean(function(self.values)))

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        return {"distribution": "measured", "count": self.values.size, "digest": self.digest}

    def openturns(self, ot: Any) -> Any:
        """See `Distribution.openturns`."""
        return ot.UserDefined(self.values[:, None].tolist())


def score(distribution: Distribution, values: Array) -> Array:
    """Standard normal scores that have the same probability as the values.

    Parameters
    ----------
    distribution : Distribution
        Where the values come from.
    values : ndarray, (n,)
        In the error's SI unit.

    Returns
    -------
    ndarray, (n,)
        z with ``ppf(Phi(z)) = value``, within +-9; for a normal distribution (value - mean) / sigma. Where a range of
        probabilities has one value (`Measured`), the score of the middle of that range.
    """
    if isinstance(distribution, Normal):  # from the values: a probability near 1 has few digits of its tail
        return np.clip((values - distribution.mean) / distribution.sigma, -9.0, 9.0)
    return np.clip(special.ndtri(distribution.rank(values)), -9.0, 9.0)


def sigma_of(lower: float, upper: float, mean: float, cpk: float) -> float:
    """Return the standard deviation of a process of capability `cpk` in the band.

    Cpk = min(upper - mean, mean - lower) / (3 sigma), so the nearer limit decides.
    """
    return min(upper - mean, mean - lower) / (3 * cpk)
