"""Distributions of errors: inverse distribution functions, densities, process capability, ISO 2768.

No statistics of the errors of Cardan crosses are published; every distribution here is an assumption
that a study makes and states.
"""

from __future__ import annotations

import csv
import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LOG_ROOT_2PI = 0.5 * math.log(2 * math.pi)


class Distribution(ABC):
    """Distribution of one error, in SI units, given by the inverse of its distribution function."""

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
    def logpdf(self, x: Array) -> Array:
        """Logarithm of the density at `x`; for a discrete distribution, of the probability.

        Parameters
        ----------
        x : ndarray, (n,)
            Values in the error's SI unit.

        Returns
        -------
        ndarray, (n,)
            -inf outside the support.
        """

    @property
    def discrete(self) -> bool:
        """Whether the distribution is discrete, so that `logpdf` gives logarithms of probabilities."""
        return False

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Kind and parameters, as JSON values: everything that determines the values drawn."""


@dataclass(frozen=True)
class Described(Distribution):
    """Distribution that its dataclass fields describe completely."""

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        return {"distribution": type(self).__name__.lower(), **asdict(self)}


class _Banded(Protocol):
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...


def _within(band: _Banded, x: Array, density: Array) -> Array:
    """Logarithmic density where x is in the band, -inf elsewhere."""
    return np.where((x >= band.lower) & (x <= band.upper), density, -np.inf)


@dataclass(frozen=True)
class Normal(Described):
    """Normal distribution with `mean` and standard deviation `sigma`."""

    mean: float
    sigma: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        from scipy.special import ndtri

        return self.mean + self.sigma * ndtri(u)

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        return -0.5 * ((x - self.mean) / self.sigma) ** 2 - math.log(self.sigma) - LOG_ROOT_2PI


@dataclass(frozen=True)
class TruncatedNormal(Described):
    """Normal distribution truncated to the band, as if parts outside were rejected.

    `mean` and `sigma` are those before the truncation.
    """

    mean: float
    sigma: float
    lower: float
    upper: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        from scipy.special import ndtr, ndtri

        a, b = (self.lower - self.mean) / self.sigma, (self.upper - self.mean) / self.sigma
        # each half from its own tail: probabilities near 1 have fewer significant digits than those near 0
        low = ndtri(ndtr(a) + u * (ndtr(b) - ndtr(a)))
        high = -ndtri(ndtr(-b) + (1 - u) * (ndtr(-a) - ndtr(-b)))
        z = np.where(low <= 0, low, high)
        return np.clip(self.mean + self.sigma * z, self.lower, self.upper)

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        from scipy.special import ndtr

        a, b = (self.lower - self.mean) / self.sigma, (self.upper - self.mean) / self.sigma
        share = float(ndtr(b) - ndtr(a) if a <= 0 else ndtr(-a) - ndtr(-b))
        return _within(self, x, Normal(self.mean, self.sigma).logpdf(x) - math.log(share))


@dataclass(frozen=True)
class Uniform(Described):
    """Uniform distribution on the band."""

    lower: float
    upper: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return self.lower + (self.upper - self.lower) * u

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        return _within(self, x, np.full_like(x, -math.log(self.upper - self.lower)))


@dataclass(frozen=True)
class Triangular(Described):
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

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        with np.errstate(divide="ignore", invalid="ignore"):
            rising, falling = (x - self.lower) / (self.peak - self.lower), (self.upper - x) / (self.upper - self.peak)
            height = np.log(np.where(x < self.peak, rising, np.where(x > self.peak, falling, 1.0)))
        return _within(self, x, height + math.log(2.0 / (self.upper - self.lower)))


@dataclass(frozen=True)
class LogNormal(Described):
    """Lognormal distribution: ``threshold + exp(y)``, where y is (truncated) normal."""

    threshold: float
    log: Normal | TruncatedNormal

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return self.threshold + np.exp(self.log.ppf(u))

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        above = x > self.threshold
        y = np.log(np.where(above, x - self.threshold, 1.0))
        return np.where(above, self.log.logpdf(y) - y, -np.inf)


@dataclass(frozen=True)
class Beta(Described):
    """Beta distribution with shapes `a` and `b`, stretched over the band."""

    a: float
    b: float
    lower: float
    upper: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        from scipy.special import betaincinv

        return self.lower + (self.upper - self.lower) * betaincinv(self.a, self.b, u)

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        from scipy.special import betaln, xlog1py, xlogy

        width = self.upper - self.lower
        t = np.clip((x - self.lower) / width, 0.0, 1.0)
        density = xlogy(self.a - 1, t) + xlog1py(self.b - 1, -t) - betaln(self.a, self.b) - math.log(width)
        return _within(self, x, np.asarray(density, dtype=float))


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

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        count = np.searchsorted(self.values, x, "right") - np.searchsorted(self.values, x, "left")
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(count / self.values.size))

    @property
    def discrete(self) -> bool:
        """See `Distribution.discrete`."""
        return True

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        return {"distribution": "measured", "count": self.values.size, "digest": self.digest}


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
    from scipy.special import ndtr, ndtri

    if isinstance(distribution, Normal):
        return np.clip((values - distribution.mean) / distribution.sigma, -9.0, 9.0)
    ends = []
    for below in (np.less, np.less_equal):  # the least and the largest z that give the value
        low, high = np.full(values.shape, -9.0), np.full(values.shape, 9.0)
        for _ in range(60):
            middle = 0.5 * (low + high)
            under = below(distribution.ppf(ndtr(middle)), values)
            low, high = np.where(under, middle, low), np.where(under, high, middle)
        ends.append(0.5 * (low + high))
    step: Array = ndtri(0.5 * (ndtr(ends[0]) + ndtr(ends[1])))
    return np.where(ends[1] - ends[0] < 1e-6, ends[0], step)


def sigma_of(lower: float, upper: float, mean: float, cpk: float) -> float:
    """Return the standard deviation of a process of capability `cpk` in the band.

    Cpk = min(upper - mean, mean - lower) / (3 sigma), so the nearer limit decides.
    """
    return min(upper - mean, mean - lower) / (3 * cpk)


class IsoRow(NamedTuple):
    """One range of the ISO 2768-1 tables: sizes over `over` up to and including `up_to` (mm)."""

    kind: str
    grade: str
    over: float
    up_to: float
    deviation: float


@cache
def iso2768_rows(path: Path) -> tuple[IsoRow, ...]:
    """Read the general tolerances; deviations in m and rad."""
    factor = {"mm": 1e-3, "arcmin": math.radians(1 / 60)}
    with path.open(encoding="utf-8", newline="") as file:
        return tuple(
            IsoRow(
                row["kind"],
                row["class"],
                float(row["over_mm"]),
                float(row["up_to_mm"]),
                float(row["deviation"]) * factor[row["unit"]],
            )
            for row in csv.DictReader(line for line in file if not line.startswith("#"))
        )


def iso2768(path: Path, kind: str, grade: str, nominal: float) -> float:
    """Permissible deviation (plus and minus) of a dimension without individual tolerance.

    Parameters
    ----------
    path : Path
        The table, ``data/iso2768.csv``.
    kind : str
        ``"linear"`` or ``"angular"``.
    grade : str
        Tolerance class, ``"f"`` or ``"m"``.
    nominal : float
        Nominal size (m); for an angle the length of its shorter leg.

    Returns
    -------
    float
        Deviation in m or rad.

    Raises
    ------
    ValueError
        When the table has no such class or ends before that size; the text names the range that it covers.
    """
    rows = [row for row in iso2768_rows(path) if (row.kind, row.grade) == (kind, grade)]
    if not rows:
        raise ValueError(f"no {kind} table for class {grade!r}")
    size = 1e3 * nominal
    fits = (row for row in rows if size <= row.up_to * (1 + 1e-12))
    row = next(fits, None) if size >= rows[0].over * (1 - 1e-12) else None
    if row is None:
        raise ValueError(f"outside the table ({rows[0].over:g} mm to {rows[-1].up_to:g} mm)")
    return row.deviation
