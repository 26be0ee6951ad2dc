"""Joints of one lot depend on one another: intervals over lots, and what the next delivery may hold.

Lots are independent of each other, joints of one lot are not. Intervals of shares come from the lots' shares (Student's
t on the logit of their mean), and predictions from the beta-binomial law: the share of a lot is a beta variate. Where
few lots have the joints above a limit, lots that are worse may not have been seen: there, the interval contains that of
the beta-binomial law, too. No interval excludes what lots without any such joint leave possible: lots all of whose
joints are above, and none of which was seen.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis import prediction
from tolstat.analysis.binomial import clopper_pearson, half_width, log_beta_binomial
from tolstat.analysis.design import Design
from tolstat.analysis.estimates import Column, Estimate
from tolstat.common.late import special
from tolstat.common.loads import FloatArray

LEAST = 30
"""Number of lots from which on intervals over lots hold; with fewer there are none."""
FEW = 20
"""Effective number of joints on a side of a level below which an interval contains that of the beta-binomial law, and
number below which it contains that of independent joints."""
STEP = 0.2
"""Distance of the mean shares, on the logit scale, at which the posterior density of that law is computed."""
GRID, REACH = 33, 5.0
"""Points of each parameter of the posterior distribution, and its half width in standard errors of the mean share."""
SPREADS = np.linspace(-8.0, 5.0, GRID)
"""Logits of the correlation of two joints of a lot in the grid."""
NEGLIGIBLE = 1e-5
"""Posterior probability below which a point of the grid is left out."""


class LotShares(NamedTuple):
    """Shares of lots.

    Attributes
    ----------
    estimate, lower, upper : ndarray, shape (...)
        Share of the joints over all lots, with its interval; without one NaN.
    correlation : ndarray, shape (...)
        Correlation of two joints of a lot, both above or not: 0 if lots do not differ, 1 if they are all good or all
        bad (intraclass correlation, from the analysis of variance). It may be slightly negative.
    """

    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray
    correlation: FloatArray


def interval(above: ArrayLike, joints: ArrayLike, confidence: float = 0.95) -> LotShares:
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
    LotShares
        Where no joint is above a limit, or each, the share of lots with such a joint bounds that of the joints: its end
        is Clopper and Pearson's for lots, 1 - (α/2)^(1/lots). With more joints above, the upper end is no lower. Where
        the joints on a side of the limit, (sum of k)² / sum of k² over the lots, are effectively fewer than `FEW`, the
        interval contains `_credible`, too. NaN for fewer than `LEAST` lots.
    """
    k = np.asarray(above, dtype=float)
    n = np.asarray(joints, dtype=float)
    n = np.broadcast_to(n.reshape(n.shape + (1,) * (k.ndim - n.ndim)), k.shape)
    lots, total = len(k), n.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        p = k.sum(axis=0) / total
        between = ((k - p * n) ** 2).sum(axis=0) * lots / (lots - 1.0)
        half = half_width(confidence, lots - 1) * np.sqrt(between) / total / (p * (1.0 - p))
        lower, upper = (np.asarray(special.expit(special.logit(p) + end)) for end in (-half, half))
        none = float(clopper_pearson(0, lots, confidence)[1])
        sides = np.stack([k, n - k])
        effective = (sides.sum(axis=1) ** 2 / (sides**2).sum(axis=1)).min(axis=0)
        few = (p > 0.0) & (p < 1.0) & (effective < FEW)
        if few.any() and lots >= LEAST:
            credible = _credible(k[:, few], n[:, few], confidence)
            lower[few], upper[few] = np.minimum(lower[few], credible[0]), np.maximum(upper[few], credible[1])
        lower = np.where(p == 0.0, 0.0, np.fmin(lower, 1.0 - none))  # Student's ends are NaN where p is 0 or 1
        upper = np.where(p == 1.0, 1.0, np.fmax(upper, none))
        # analysis of variance of the joints, 0 or 1, with lots of different size
        inside = (k * (1.0 - k / n)).sum(axis=0) / (total - lots)
        outside = ((k - p * n) ** 2 / n).sum(axis=0) / (lots - 1.0)
        size = (total - (n**2).sum(axis=0) / total) / (lots - 1.0)
        correlation = (outside - inside) / (outside + (size - 1.0) * inside)
    if lots < LEAST:
        lower, upper = np.full_like(p, np.nan), np.full_like(p, np.nan)
    return LotShares(p, lower, upper, correlation)


def _credible(k: FloatArray, n: FloatArray, confidence: float) -> tuple[FloatArray, FloatArray]:
    """Credible interval of the mean share of m limits, k of n joints in each lot, both (lots, m)."""
    p = k.sum(axis=0) / n.sum(axis=0)
    means, spreads = np.arange(special.logit(p.min()) - REACH, special.logit(p.max()) + REACH, STEP), SPREADS[::2]
    below = _posterior(k, n, means, spreads)[2].reshape(len(p), len(means), -1).sum(axis=2).cumsum(axis=1)
    tail = 0.5 * (1.0 - confidence)
    ends = np.array([np.interp([tail, 1.0 - tail], cumulative, means + 0.5 * STEP) for cumulative in below])
    return special.expit(ends[:, 0]), special.expit(ends[:, 1])


def _posterior(
    k: NDArray[Any], n: NDArray[Any], means: FloatArray, spreads: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Beta distributions of the lots' shares, (points,), and their probabilities for each of m limits, (m, points).

    k of n joints in each lot are above a limit, both (lots, m). The points are a grid of logits of the mean and of the
    correlation of two joints of a lot; all limits share it, so that the density is computed once for each pair of k and
    n. The prior distribution of the mean is Jeffreys' of a share, that of the correlation uniform.
    """
    mean, r = (grid.ravel() for grid in np.meshgrid(special.expit(means), special.expit(spreads), indexing="ij"))
    a, b = mean * (1.0 - r) / r, (1.0 - mean) * (1.0 - r) / r
    pairs, which = np.unique(np.stack([k.ravel(), n.ravel()]), axis=1, return_inverse=True)
    times = np.zeros((k.shape[1], pairs.shape[1]))
    np.add.at(times, (np.tile(np.arange(k.shape[1]), len(k)), which.ravel()), 1.0)
    log = times @ np.array([log_beta_binomial(above, of, a, b) for above, of in pairs.T])
    log += 0.5 * np.log(mean * (1.0 - mean)) + np.log(r * (1.0 - r))
    posterior = np.exp(log - log.max(axis=1, keepdims=True))
    return a, b, posterior / posterior.sum(axis=1, keepdims=True)


class Clustered(Design):
    """Joints of lots, which share the errors of their lot.

    Parameters
    ----------
    lots : ndarray of int, shape (n,)
        Number of the lot of each joint in the campaign.

    Attributes
    ----------
    numbers : ndarray of int, shape (lots,)
        The lots, ascending.
    """

    interval = "Student's t over lots, on the logit"
    covers = f"bands: pointwise 95 % intervals of the settled joints, {interval}"
    of_quantiles = "over lots"
    of_delivery = " of one new lot"
    ranks_at_once = 2000  # a share has a higher end where few lots have the joints above

    def __init__(self, lots: NDArray[np.intp]) -> None:
        self.numbers, self._lots = np.unique(lots, return_inverse=True)

    def groups(self, n: int) -> NDArray[np.intp]:
        """See `Design.groups`: the lots."""
        return self._lots

    def shares(self, x: Column, levels: FloatArray, confidence: float) -> Estimate[FloatArray]:
        """See `Design.shares`: `interval` over the lots; none for fewer than `LEAST` lots."""
        above, joints = self.counts(x, levels)
        above, joints = above[joints > 0], joints[joints > 0]
        if not joints.size:
            return super().shares(x, levels, confidence)
        share, lower, upper, _ = interval(above, joints, confidence)
        count = x.above(levels)
        low, high = clopper_pearson(count, x.n, confidence)
        few = np.minimum(count, x.n - count) < FEW
        return Estimate(
            share, np.where(few, np.minimum(lower, low), lower), np.where(few, np.maximum(upper, high), upper)
        )

    def counts(self, x: Column, levels: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Joints above each level, (lots, m), and joints that count, (lots,), of each lot of `numbers`."""
        values, levels = x.values, np.asarray(levels, dtype=float)
        counts = ~np.isnan(values)
        order = np.argsort(levels, kind="stable")
        number, steps = self.numbers.size, levels.size + 1
        below = np.searchsorted(levels[order], values[counts], side="left")  # number of levels that the joint is above
        table = np.bincount(self._lots[counts] * steps + below, minlength=number * steps).reshape(number, steps)
        above = np.empty((number, levels.size))
        above[:, order] = table[:, ::-1].cumsum(axis=1)[:, ::-1][:, 1:]
        return above, table.sum(axis=1).astype(float)

    def delivery(
        self, lower: Column, upper: Column, level: float, number: int, confidence: float
    ) -> tuple[float, float]:
        """See `Design.delivery`: joints of one new lot; the interval contains that of independent joints."""
        tail, ends = 0.5 * (1.0 - confidence), []
        for x in (lower, upper):
            above, joints = (counted.astype(np.intp) for counted in self.counts(x, [level]))
            above, joints = above[joints > 0, 0], joints[joints > 0]
            if len(joints) < LEAST:
                return np.nan, np.nan
            k, n, below = int(above.sum()), int(joints.sum()), np.cumsum(delivery(above, joints, number))
            low, high = prediction.of_counts(k, k, n, number, confidence)
            least, most = (float(np.searchsorted(below, share)) for share in (tail, 1.0 - tail))
            ends.append((min(least, low), min(max(most, high), float(number))))
        return ends[0][0], ends[1][1]

    def only(self, joints: NDArray[np.intp] | NDArray[np.bool_]) -> Clustered:
        """See `Design.only`."""
        return Clustered(self.numbers[self._lots[joints]])


def delivery(above: ArrayLike, joints: ArrayLike, number: int) -> FloatArray:
    """Predict how many joints of one new lot are above a limit, from the posterior distribution of the lots' law.

    The prior distribution of the mean is Jeffreys' of a share, that of the correlation of two joints of a lot uniform.

    Parameters
    ----------
    above, joints : array_like, shape (lots,)
        Joints above a limit, and joints, of each lot.
    number : int
        Joints of the new lot.

    Returns
    -------
    ndarray, shape (number + 1,)
        Probability of each number.
    """
    k, n = np.asarray(above, dtype=np.intp), np.asarray(joints, dtype=np.intp)
    p = (k.sum() + 0.5) / (n.sum() + 1.0)
    spread = max(float(np.nan_to_num(interval(k, n).correlation)), 0.05)
    error = np.sqrt((1.0 + (n.mean() - 1.0) * spread) / (n.sum() * p * (1.0 - p)))
    means = special.logit(p) + np.linspace(-REACH, REACH, GRID) * min(float(error), 1.0)
    a, b, (posterior,) = _posterior(k[:, None], n[:, None], means, SPREADS)
    likely = posterior > NEGLIGIBLE
    a, b, posterior = a[likely, None], b[likely, None], posterior[likely] / posterior[likely].sum()
    return np.asarray(posterior @ np.exp(log_beta_binomial(np.arange(number + 1), number, a, b)))
