"""Extrapolation to loads rarer than any joint simulated: generalised Pareto tail above a threshold.

Excesses over a high threshold are approximately generalised Pareto for nearly every distribution (Pickands 1975):
1 - F(x) = (1 + k x / sigma)^(-1/k). k > 0 is a heavy tail, k = 0 the exponential, k < 0 a tail that ends at -sigma / k.
The approximation can fail: the goodness of fit is tested, and fits of other shares show whether the shape is the same
at other thresholds. A tail with too few joints is refused, with the number of joints needed. Intervals are of profile
likelihood, the share above the threshold included (Coles 2001, 4.3.3): extrapolate with them, not with the estimate. A
tail whose shape may be -1/2 or less, such as that of a uniform load, is refused: likelihood has no interval there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from tolstat.analysis.estimates import Estimate
from tolstat.analysis.sample import Sample
from tolstat.common.late import special
from tolstat.common.loads import FloatArray

STRAIGHT = 1e-8
"""``|k|`` below which the tail counts as exponential."""
LEAST_SHAPE = -0.5
"""Smallest k of a fit by maximum likelihood: below it the asymptotic theory does not hold (Smith 1985)."""
FEWEST_WEIGHTS = 50
"""Minimum number of positive weights for the shape of their tail."""
MIN_EXCESSES = 50
"""Minimum number of excesses for a fit."""
REPLICATES = 400
"""Parametric bootstrap samples of the goodness-of-fit test."""
NO_TAIL = 0.05
"""p-value of the goodness of fit below which a tail is not generalised Pareto."""
GRID, SHARES = 81, 13
"""Grid points of the likelihood: in shape and scale each, and in the share above the threshold."""


def zhang_stephens(excesses: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Estimate k and sigma of many samples (Zhang and Stephens 2009: a mean over the profile likelihood).

    Parameters
    ----------
    excesses : array_like, shape (..., n)
        Positive excesses, n of each sample, at least 2.

    Returns
    -------
    k, sigma : ndarray, shape (...)
        Shape, and scale in the unit of the excesses.
    """
    m = 30 + int(np.sqrt(np.shape(excesses)[-1]))
    x, b = _grid(excesses, (np.arange(1, m + 1) - 0.5) / m)
    likelihood = _profile(x, b)[1]
    weight = np.exp(likelihood - likelihood.max(axis=-1, keepdims=True))
    mean = (b * weight).sum(axis=-1) / weight.sum(axis=-1)
    shape = np.log1p(-mean[..., None] * x).mean(axis=-1)
    return shape, -shape / mean


def most_likely(excesses: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Estimate k and sigma of many samples by maximum likelihood, k not below `LEAST_SHAPE`.

    The likelihood is that of b = -k / sigma alone, with k = mean(log(1 - b x)) (Grimshaw 1993), on the grid of
    `zhang_stephens`, then on finer ones about its maximum. Parameters and what is returned are those of
    `zhang_stephens`.
    """
    part = np.linspace(0.0, 1.0, 12)
    x, b = _grid(excesses, np.linspace(1e-3, 0.999, 20)[::-1])
    for _ in range(4):
        b = np.where(np.abs(b) * x[..., -1:] < STRAIGHT, -STRAIGHT / x[..., -1:], b)
        k, likelihood = _profile(x, b)
        best = np.argmax(np.where(k >= LEAST_SHAPE, likelihood, -np.inf), axis=-1)[..., None]
        at = [np.take_along_axis(b, np.clip(best + step, 0, b.shape[-1] - 1), axis=-1) for step in (-1, 1)]
        shape, most_likely_b = (np.take_along_axis(values, best, axis=-1)[..., 0] for values in (k, b))
        b = at[0] + (at[1] - at[0]) * part
    return shape, -shape / most_likely_b


def _grid(excesses: ArrayLike, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Excesses ascending, (..., n), and values of b = -k / sigma over the range of high likelihood, (..., m).

    They go from the end of the tail at the largest excess to one far beyond: equal steps `u` of a root.
    """
    x = np.sort(np.asarray(excesses, dtype=float), axis=-1)
    quartile = x[..., int(x.shape[-1] / 4 + 0.5) - 1, None]
    return x, 1.0 / x[..., -1:] + (1.0 - np.sqrt(1.0 / u)) / (3.0 * quartile)


def _profile(x: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Most likely k given b = -k / sigma, and the log-likelihood, (..., m) each."""
    k = np.stack([np.log1p(-b[..., j, None] * x).mean(axis=-1) for j in range(b.shape[-1])], axis=-1)
    return k, x.shape[-1] * (np.log(-b / k) - k - 1.0)


def log_likelihood(excesses: FloatArray, k: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """Log-likelihood of one sample; -inf where an excess is beyond the end of the tail.

    Parameters
    ----------
    excesses : ndarray, shape (n,)
        Excesses.
    k, sigma : array_like
        Parameters, broadcast together.

    Returns
    -------
    ndarray
        Of the shape of the broadcast.
    """
    shape = np.asarray(k, dtype=float)
    shape = np.where(np.abs(shape) < STRAIGHT, STRAIGHT, shape)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.atleast_1d(shape / sigma)
        sums = np.stack([np.log1p(row[..., None] * excesses).sum(axis=-1) for row in ratio])  # row by row, for memory
        loss = (1.0 + 1.0 / shape) * sums.reshape(np.broadcast_shapes(shape.shape, np.shape(sigma)))
    return np.where(np.isnan(loss), -np.inf, -excesses.size * np.log(sigma) - loss)


def upper_share(x: ArrayLike, k: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """1 - F(x), broadcast."""
    with np.errstate(invalid="ignore"):  # NaN beyond the end of the tail
        return np.nan_to_num(1.0 / special.inv_boxcox(np.divide(x, sigma), k))


def quantile(share_above: ArrayLike, k: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """Excess x with 1 - F(x) = `share_above`, broadcast."""
    return np.asarray(-np.asarray(sigma) * special.boxcox(np.asarray(share_above, dtype=float), np.negative(k)))


def anderson_darling(excesses: FloatArray, k: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """Anderson–Darling distance of samples (..., n) from the distribution, shape (...); emphasises both ends."""
    n = excesses.shape[-1]
    above = upper_share(np.sort(excesses, axis=-1), np.asarray(k)[..., None], np.asarray(sigma)[..., None])
    above = np.clip(above, 1e-300, 1.0 - 1e-16)
    terms = (2.0 * np.arange(1, n + 1) - 1.0) * (np.log1p(-above) + np.log(above[..., ::-1]))
    return np.asarray(-n - terms.sum(axis=-1) / n)


def shape_of_weights(weights: ArrayLike) -> float:
    """Shape k of the tail of weights (Vehtari, Simpson, Gelman, Yao and Gabry 2024): 1 / k of their moments are finite.

    Parameters
    ----------
    weights : array_like, shape (n,)
        Not negative.

    Returns
    -------
    float
        k of the largest min(n / 5, 3 sqrt(n)) positive weights, drawn towards 1/2 as by ten observations; -inf if all
        weights are equal, NaN if fewer than `FEWEST_WEIGHTS` are positive.
    """
    w = np.sort(np.asarray(weights, dtype=float))
    w = w[w > 0]
    if w.size < FEWEST_WEIGHTS:
        return np.nan
    if w[0] == w[-1]:
        return -np.inf
    m = min(w.size // 5, int(np.ceil(3.0 * np.sqrt(w.size))))
    tail = w[-m:] - w[-m - 1]
    if not tail[0] > 0:  # equal weights at the threshold: of those above it, as many as there are
        tail = tail[tail > 0]
    return float((zhang_stephens(tail)[0] * tail.size + 0.5 * 10.0) / (tail.size + 10.0)) if tail.size >= 5 else 0.5


class TooThinError(ValueError):
    """The tail has too few joints; `needed` is the number to simulate for enough of them above the threshold."""

    def __init__(self, above: int, needed: int) -> None:
        self.needed = needed
        super().__init__(
            f"{above} joints above the threshold, {MIN_EXCESSES} are needed: simulate some {needed} joints"
        )


@dataclass(frozen=True)
class Tail:
    """Generalised Pareto tail of a load.

    Attributes
    ----------
    threshold : float
        Load above which the tail is fitted, in the unit of the values.
    n, n_unresolved, n_above : int
        Joints simulated, those without a valid load, and valid ones above the threshold.
    shape, scale : Estimate
        k, and sigma in the unit of the values. With a negative k the tail has a finite upper end.
    excesses : ndarray, shape (n_above,)
        Loads above the threshold, less the threshold.
    region : ndarray, shape (r, 3)
        Grid points (share above the threshold, k, sigma) of the likelihood confidence region; the interval of any
        quantity is its range over them.
    iid : bool
        Whether the joints are independent samples.
    """

    threshold: float
    n: int
    n_unresolved: int
    n_above: int
    shape: Estimate[float]
    scale: Estimate[float]
    excesses: FloatArray
    region: FloatArray
    iid: bool

    @cached_property
    def p(self) -> float:
        """p-value of the goodness of fit; below `NO_TAIL` do not extrapolate.

        Anderson–Darling distance, by parametric bootstrap: samples of the fitted distribution, each fitted in the same
        way.
        """
        k, sigma = self.shape.estimate, self.scale.estimate
        distance = anderson_darling(self.excesses, k, sigma)
        rng = np.random.default_rng(1975)
        drawn = quantile(rng.random((REPLICATES, self.n_above)), k, sigma)
        distances = anderson_darling(drawn, *most_likely(drawn))
        return float((1 + np.count_nonzero(distances >= distance)) / (1 + REPLICATES))

    @property
    def refusal(self) -> str:
        """Reason why the tail must not be extrapolated; empty if it may be."""
        if self.region[:, 1].min() <= LEAST_SHAPE + 1e-9:
            return f"the shape of the tail may be {LEAST_SHAPE:g} or less, where there is no interval"
        return f"the tail is not generalised Pareto (p < {NO_TAIL:g})" if self.p < NO_TAIL else ""

    @property
    def share(self) -> float:
        """Share of the valid joints above the threshold."""
        return self.n_above / (self.n - self.n_unresolved)

    def probability(self, level: float) -> Estimate[float]:
        """Share of the joints above a level beyond the threshold.

        Raises
        ------
        ValueError
            When the level is below the threshold.
        """
        if level < self.threshold:
            raise ValueError(f"{level:g} is below the threshold {self.threshold:g}: count the joints above it")
        excess = level - self.threshold
        share, k, sigma = self.region.T
        values = share * upper_share(excess, k, sigma)
        best = self.share * float(upper_share(excess, self.shape.estimate, self.scale.estimate))
        return self._between(best, values)

    def level(self, share: float) -> Estimate[float]:
        """Load that a share of the joints exceed: the return load of "1 in N joints" is ``level(1 / N)``.

        Raises
        ------
        ValueError
            When `share` is not positive or is larger than the share of the joints above the threshold.
        """
        if not 0.0 < share <= self.share:
            remedy = "ask for its quantile"
            raise ValueError(f"share {share:g} is not in the tail, which begins at {self.share:g}: {remedy}")
        above, k, sigma = self.region.T
        excess = quantile(np.minimum(share / above, 1.0), k, sigma)
        best = float(quantile(share / self.share, self.shape.estimate, self.scale.estimate))
        return self._between(self.threshold + best, self.threshold + excess)

    def bounds(self, share: float) -> tuple[float, float]:
        """``level(share)`` with unresolved joints counted below it, and above it; infinite if they make up `share`."""
        lost = self.n_unresolved / self.n
        ends = [share / (1.0 - lost), (share - lost) / (1.0 - lost)]
        low = self.level(min(ends[0], self.share)).estimate
        return low, self.level(ends[1]).estimate if ends[1] > 0 else np.inf

    def largest(self, fleet: int, probability: float = 0.5) -> Estimate[float]:
        """Quantile of the largest load in a fleet of independent joints; its median by default.

        Raises
        ------
        ValueError
            As `level`: when the fleet is so small that its largest load is not in the tail.
        """
        return self.level(-np.expm1(np.log(probability) / fleet))

    def _between(self, best: float, values: FloatArray) -> Estimate[float]:
        if not self.iid:
            return Estimate(best, np.nan, np.nan)
        return Estimate(best, min(best, float(values.min())), max(best, float(values.max())))


def fit(sample: Sample, share: float | None = None, confidence: float = 0.95) -> Tail:
    """Fit a generalised Pareto tail to the loads above a threshold, of joints that count equally.

    Parameters
    ----------
    sample : Sample
        The loads.
    share : float, optional
        Share of the valid joints in the tail; by default the smaller of 0.1 and 3 / sqrt(n): with more joints the
        intervals shrink, so the error of the approximation must shrink too.
    confidence : float
        Confidence level of all intervals.

    Returns
    -------
    Tail
        Maximum likelihood estimates with k >= -1/2; see `Tail.refusal`.

    Raises
    ------
    TooThinError
        When fewer than `MIN_EXCESSES` joints are above the threshold.
    """
    valid, lost, iid = sample.valid, sum(sample.unresolved), sample.design.has_interval("tail")
    joints = valid.size + lost
    share = min(0.1, 3.0 / np.sqrt(max(valid.size, 1))) if share is None else share
    count = int(share * valid.size * (1 + 1e-12))
    if count < MIN_EXCESSES:
        raise TooThinError(count, int(np.ceil(MIN_EXCESSES / share * max(1.0, joints / max(valid.size, 1)))))
    threshold = float(valid[-min(count + 1, valid.size)])
    excesses = valid[valid > threshold] - threshold
    if excesses.size < MIN_EXCESSES:
        raise TooThinError(excesses.size, int(np.ceil(joints * MIN_EXCESSES / max(excesses.size, 1))))
    m, n = excesses.size, valid.size
    reach = float(special.gammaincinv(0.5, confidence))  # half the quantile of chi-square with one degree of freedom
    k, sigma, deficit = _likelihood(excesses, reach)
    best = [float(value) for value in most_likely(excesses)]
    half = 5.0 * np.sqrt(m * (1.0 - m / n)) / n
    shares = np.clip(np.linspace(m / n - half, m / n + half, SHARES), 0.5 / n, 1.0 - 0.5 / n)
    binomial = special.xlogy(m, m / n / shares) + special.xlog1py(n - m, -m / n) - special.xlog1py(n - m, -shares)
    inside = np.argwhere(deficit[None] + binomial[:, None, None] <= reach)
    region = np.column_stack([shares[inside[:, 0]], k[inside[:, 1], inside[:, 2]], sigma[inside[:, 1], inside[:, 2]]])
    ends = [(float(v.min()), float(v.max())) if iid else (np.nan, np.nan) for v in region.T[1:]]
    shape, scale = (Estimate(value, *interval) for value, interval in zip(best, ends, strict=True))
    return Tail(threshold, joints, lost, m, shape, scale, excesses, region, iid)


def _likelihood(excesses: FloatArray, reach: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Grid of k and sigma, and how far the log-likelihood is below its maximum, each (GRID, GRID).

    The grid is regular in k and log(sigma (1 + k)), which are orthogonal parameters (Chavez-Demoulin and Davison 2005),
    and just encloses the points whose log-likelihood is within `reach` of the maximum.
    """
    first = [float(v) for v in zhang_stephens(excesses)]
    k0, nu0 = max(first[0], -0.45), np.log(first[1] * (1.0 + max(first[0], -0.45)))
    width = 6.0 / np.sqrt(excesses.size)
    low, high = np.array([k0 - 2 * width, nu0 - width]), np.array([k0 + 3 * width, nu0 + 2 * width])
    for points in (41, GRID):
        low[0] = max(low[0], LEAST_SHAPE)
        k, nu = np.meshgrid(np.linspace(low[0], high[0], points), np.linspace(low[1], high[1], points), indexing="ij")
        sigma = np.exp(nu) / (1.0 + k)
        likelihood = log_likelihood(excesses, k, sigma)
        deficit = likelihood.max() - likelihood
        inside = np.argwhere(deficit <= reach + 0.3)
        step = (high - low) / (points - 1)
        low, high = low + (inside.min(axis=0) - 1) * step, low + (inside.max(axis=0) + 1) * step
    return k, sigma, deficit
