"""Joints of one lot depend on one another: intervals over lots, and what the next delivery may hold.

Lots are independent of each other, joints of one lot are not. Intervals of shares come from the lots' shares (Student's
t on the logit of their mean), and predictions from the beta-binomial law: the share of a lot is a beta variate. Where
few lots have the joints above a limit, lots that are worse may not have been seen: there, the interval contains that of
the beta-binomial law, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.analysis import exceedance, prediction
from tolstat.analysis.exceedance import FloatArray, Table
from tolstat.analysis.quantile import Quantile
from tolstat.analysis.quantile import of_sample as quantile_of_sample
from tolstat.analysis.sorted_loads import Sample

LEAST = 30
"""Number of lots from which on intervals over lots hold; with fewer there are none."""
FEW = 20
"""Number of joints on a side of a level below which an interval contains that of independent joints, too, and effective
number below which it contains that of the beta-binomial law."""
STEP = 0.2
"""Distance of the mean shares, on the logit scale, at which the posterior density of that law is computed."""
MOST_LEVELS = 2000
"""Number of loads at which the interval of a quantile is looked for; its ends are rounded outwards to one of these."""
GRID, REACH = 33, 5.0
"""Points of each parameter of the posterior distribution, and its half width in standard errors of the mean share."""
SPREADS = np.linspace(-8.0, 5.0, GRID)
"""Logits of the correlation of two joints of a lot in the grid."""
NEGLIGIBLE = 1e-5
"""Posterior probability below which a point of the grid is left out."""


class Shares(NamedTuple):
    """Shares of lots.

    Attributes
    ----------
    estimate, lower, upper : ndarray, shape (...)
        Share of the joints over all lots, with its interval; without one NaN.
    correlation : ndarray, shape (...)
        Correlation of two joints of a lot, both above or not: 0 if lots do not differ, 1 if they are all good or all
        bad (intraclass correlation, from the analysis of variance). It may be slightly negative.
    n : int
        Lots.
    """

    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray
    correlation: FloatArray
    n: int


def interval(above: ArrayLike, joints: ArrayLike, confidence: float = 0.95) -> Shares:
    """Student's t interval of the share of the joints, on its logit, from lots.

    Parameters
    ----------
    above : array_like, shape (lots, ...)
        Number of joints above a limit in each lot.
    joints : array_like, shape (lots, ...) or (lots,)
        Number of joints of each lot; lots may differ in size.
    confidence : float
        Confidence level.

    Returns
    -------
    Shares
        Where no joint is above a limit, or each, the share of lots with such a joint bounds that of the joints: its end
        is Clopper and Pearson's for lots. Where the joints on a side of the limit, (sum of k)² / sum of k² over the
        lots, are effectively fewer than `FEW`, the interval contains `_credible`, too. NaN for fewer than `LEAST` lots.
    """
    from scipy.special import expit, logit, stdtrit

    k = np.asarray(above, dtype=float)
    n = np.asarray(joints, dtype=float)
    n = np.broadcast_to(n.reshape(n.shape + (1,) * (k.ndim - n.ndim)), k.shape)
    lots, total = len(k), n.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        p = k.sum(axis=0) / total
        between = ((k - p * n) ** 2).sum(axis=0) * lots / (lots - 1.0)
        half = stdtrit(lots - 1, 0.5 * (1.0 + confidence)) * np.sqrt(between) / total / (p * (1.0 - p))
        lower, upper = np.asarray(expit(logit(p) - half)), np.asarray(expit(logit(p) + half))
        none = float(exceedance.clopper_pearson(0, lots, confidence)[1])
        sides = np.stack([k, n - k])
        effective = (sides.sum(axis=1) ** 2 / (sides**2).sum(axis=1)).min(axis=0)
        few = (p > 0.0) & (p < 1.0) & (effective < FEW)
        if few.any() and lots >= LEAST:
            own = _credible(k[:, few], n[:, few], confidence)
            lower[few], upper[few] = np.minimum(lower[few], own[0]), np.maximum(upper[few], own[1])
        lower = np.where(p == 0.0, 0.0, np.where(p == 1.0, 1.0 - none, lower))
        upper = np.where(p == 1.0, 1.0, np.where(p == 0.0, none, upper))
        # analysis of variance of the joints, 0 or 1, with lots of different size
        inside = (k * (1.0 - k / n)).sum(axis=0) / (total - lots)
        outside = ((k - p * n) ** 2 / n).sum(axis=0) / (lots - 1.0)
        size = (total - (n**2).sum(axis=0) / total) / (lots - 1.0)
        correlation = (outside - inside) / (outside + (size - 1.0) * inside)
    if lots < LEAST:
        lower, upper = np.full_like(p, np.nan), np.full_like(p, np.nan)
    return Shares(p, lower, upper, correlation, lots)


def _credible(k: FloatArray, n: FloatArray, confidence: float) -> tuple[FloatArray, FloatArray]:
    """Credible interval of the mean share of m limits, k of n joints in each lot, both (lots, m), as `law_of` has it.

    All limits share the grid of means, so that the density is computed once for each pair of k and n.
    """
    from scipy.special import expit, logit

    p = k.sum(axis=0) / n.sum(axis=0)
    means = np.arange(logit(p.min()) - REACH, logit(p.max()) + REACH, STEP)
    mean, r = np.meshgrid(expit(means), expit(SPREADS[::2]), indexing="ij")
    a, b = mean * (1.0 - r) / r, (1.0 - mean) * (1.0 - r) / r
    pairs, which = np.unique(np.stack([k.ravel(), n.ravel()]), axis=1, return_inverse=True)
    times = np.zeros((k.shape[1], pairs.shape[1]))
    np.add.at(times, (np.tile(np.arange(k.shape[1]), len(k)), which.ravel()), 1.0)
    log = times @ np.array([_log_pmf(one, of, a, b).ravel() for one, of in pairs.T]) + _log_prior(mean, r).ravel()
    density = np.exp(log - log.max(axis=1, keepdims=True)).reshape(len(log), *mean.shape).sum(axis=2)
    below = np.cumsum(density, axis=1) / density.sum(axis=1, keepdims=True)
    tail = 0.5 * (1.0 - confidence)
    ends = np.array([np.interp([tail, 1.0 - tail], own, means + 0.5 * STEP) for own in below])
    return expit(ends[:, 0]), expit(ends[:, 1])


def curve_of(
    whole: Sample, parts: Sequence[Sample], levels: ArrayLike | None = None, confidence: float = 0.95
) -> Table:
    """Share of the joints above each of many levels, with intervals over lots.

    Parameters
    ----------
    whole : Sample
        A load of all joints.
    parts : sequence of Sample
        The same load of the joints of each lot.
    levels, confidence
        As in `exceedance.curve`.

    Returns
    -------
    ndarray of exceedance.CURVE, shape (m,)
        As from `exceedance.curve`. With fewer than `FEW` joints on a side of a level an interval contains that of as
        many independent joints (Clopper and Pearson), too. NaN for fewer than `LEAST` lots.
    """
    table = exceedance.curve_of(whole, levels, confidence)
    parts = [part for part in parts if part.n]
    each = [exceedance.curve_of(part, table["level"], confidence, iid=False) for part in parts]
    n, valid = np.array([part.n for part in parts]), np.array([part.valid.size for part in parts])
    shape = (len(parts), len(table))
    counted = {"estimate": (np.reshape([own["count"] for own in each], shape)[valid > 0], valid[valid > 0])}
    if (valid < n).any():
        for name in ("bound_lower", "bound_upper"):
            counted[name] = ((np.reshape([own[name] for own in each], shape) * n[:, None]).round(), n)
    shares = {name: interval(above, joints, confidence) for name, (above, joints) in counted.items()}
    ends = {"estimate": ("lower", "upper"), "bound_lower": ("outer_lower", ""), "bound_upper": ("", "outer_upper")}
    for name, (low, high) in ends.items():
        own = name if name in counted else "estimate"
        (above, joints), found = counted[own], shares[own]
        total = above.sum(axis=0)
        few = np.minimum(total, joints.sum() - total) < FEW
        for end, value, outermost in ((low, found.lower, np.minimum), (high, found.upper, np.maximum)):
            if end:
                table[end] = np.where(few, outermost(value, table[end]), value)
    return table


def quantile_of(whole: Sample, parts: Sequence[Sample], share: float, confidence: float = 0.95) -> Quantile:
    """Load that a share of the joints stays at or below; its interval inverts that of `curve_of`."""
    found = quantile_of_sample(whole, share, confidence, iid=False)
    loads = np.unique(whole.valid)
    if loads.size == 0 or sum(part.n > 0 for part in parts) < LEAST:
        return found
    loads = loads[np.unique(np.append(np.arange(0, loads.size, -(-loads.size // MOST_LEVELS)), loads.size - 1))]
    table = curve_of(whole, parts, np.concatenate([[np.nextafter(loads[0], -np.inf)], loads]), confidence)
    above, below = np.flatnonzero(table["upper"][1:] <= 1.0 - share), np.flatnonzero(table["lower"][:-1] >= 1.0 - share)
    upper = float(loads[above[0]]) if above.size else np.inf
    return found._replace(lower=float(loads[below[-1]]) if below.size else -np.inf, upper=upper)


class Law(NamedTuple):
    """What is known of the law of the lots' shares: beta distributions, each with a probability.

    Attributes
    ----------
    a, b : ndarray, shape (m,)
        Parameters of the beta distributions.
    weight : ndarray, shape (m,)
        Their probabilities; the sum is 1.
    counts : tuple of int
        Joints above the limit, and joints, that this is known from.
    """

    a: FloatArray
    b: FloatArray
    weight: FloatArray
    counts: tuple[int, int]

    def delivery(self, number: int, lots: int = 1) -> Delivery:
        """Predict the next delivery.

        Parameters
        ----------
        number : int
            Joints of the delivery.
        lots : int
            New lots that they come from, equally many of each but for one.
        """
        small, more = divmod(number, lots)
        spectrum = np.ones((self.weight.size, (number + 1) // 2 + 1), dtype=complex)
        for size, count in ((small, lots - more), (small + 1, more)):
            if count and size:
                padded = np.zeros((self.weight.size, number + 1))
                padded[:, : size + 1] = np.exp(_log_pmf(np.arange(size + 1), size, self.a[:, None], self.b[:, None]))
                spectrum = spectrum * np.fft.rfft(padded) ** count
        pmf = np.fft.irfft(self.weight @ spectrum, number + 1).clip(0.0)
        return Delivery(np.asarray(pmf / pmf.sum()), self.counts)


class Delivery(NamedTuple):
    """Prediction of the number of joints above a limit in the next delivery.

    Attributes
    ----------
    probability : ndarray, shape (number + 1,)
        Probability of each number.
    counts : tuple of int
        As in `Law`.
    """

    probability: FloatArray
    counts: tuple[int, int]

    def ends(self, confidence: float = 0.95) -> tuple[float, float]:
        """Prediction interval of the number, ends included; it contains that of independent joints (Thatcher 1964)."""
        above, joints = self.counts
        number, tail = self.probability.size - 1, 0.5 * (1.0 - confidence)
        low, high = prediction.of_counts(above, above, joints, number, confidence)
        below = np.cumsum(self.probability)
        least, most = (float(np.searchsorted(below, share)) for share in (tail, 1.0 - tail))
        return min(least, low), min(max(most, high), float(number))

    def more_than(self, share: float) -> float:
        """Probability that more than a share of the delivery is above the limit."""
        allowed = int(np.floor(share * (self.probability.size - 1) * (1.0 + 1e-12)))
        return float(self.probability[allowed + 1 :].sum())


def law_of(above: ArrayLike, joints: ArrayLike) -> Law:
    """Posterior distribution of the law of the lots' shares.

    The prior distribution of the mean is Jeffreys' of a share, that of the correlation of two joints of a lot uniform.

    Parameters
    ----------
    above, joints : array_like, shape (lots,)
        Joints above a limit, and joints, of each lot.

    Returns
    -------
    Law
    """
    from scipy.special import expit, logit

    k, n = np.asarray(above, dtype=np.intp), np.asarray(joints, dtype=np.intp)
    pairs, times = np.unique(np.column_stack([k, n]), axis=0, return_counts=True)
    p = (k.sum() + 0.5) / (n.sum() + 1.0)
    shares = interval(k, n)
    spread = max(float(np.nan_to_num(shares.correlation)), 0.05)
    error = np.sqrt((1.0 + (n.mean() - 1.0) * spread) / (n.sum() * p * (1.0 - p)))
    means = logit(p) + np.linspace(-REACH, REACH, GRID) * min(float(error), 1.0)
    mean, r = (own.ravel() for own in np.meshgrid(expit(means), expit(SPREADS)))
    a, b = mean * (1.0 - r) / r, (1.0 - mean) * (1.0 - r) / r
    log = _log_prior(mean, r)
    for (one, of), count in zip(pairs, times, strict=True):
        log += count * _log_pmf(one, of, a, b)
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    kept = weight > NEGLIGIBLE
    return Law(a[kept], b[kept], weight[kept] / weight[kept].sum(), (int(k.sum()), int(n.sum())))


def _log_prior(mean: FloatArray, correlation: FloatArray) -> FloatArray:
    """Logarithm of the prior density of the logits of mean and correlation: Jeffreys' of a share, and uniform."""
    return np.asarray(0.5 * np.log(mean * (1.0 - mean)) + np.log(correlation * (1.0 - correlation)))


def _log_pmf(k: ArrayLike, n: ArrayLike, a: FloatArray, b: FloatArray) -> FloatArray:
    """Logarithm of the beta-binomial probability of k of n."""
    from scipy.special import betaln, gammaln

    k, n = np.asarray(k, dtype=float), np.asarray(n, dtype=float)
    choose = gammaln(n + 1.0) - gammaln(k + 1.0) - gammaln(n - k + 1.0)
    return np.asarray(choose + betaln(k + a, n - k + b) - betaln(a, b))
