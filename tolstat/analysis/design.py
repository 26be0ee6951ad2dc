"""What the joints of a campaign allow to conclude: the contract of a sampling design, and the plainest ones.

Independent joints, and joints that are no sample of a production: sweeps, cases, levels of a subset simulation.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis import prediction
from tolstat.analysis.binomial import LOOK_CONFIDENCE, clopper_pearson
from tolstat.analysis.estimates import Column, Estimate
from tolstat.common.loads import FloatArray

FEW = 20
"""Number of joints on a side of a level below which an interval over units contains that of independent joints, too."""
SAMPLE = 'give the file of a study with sampling.method = "random"'
"""Remedy where joints are no sample of a production."""


class Design:
    """How the joints of a campaign were drawn.

    Attributes
    ----------
    is_sample : bool
        Whether the joints are a sample of a production: only then shares and quantiles have intervals.
    independent : bool
        Whether the joints are independent of each other: then every estimate has an interval.
    interval : str
        Name of the interval of a share.
    covers : str
        Sentence on the intervals of shares.
    of_quantiles : str
        What the intervals of quantiles are of.
    of_delivery : str
        What the further joints of `delivery` are of, after "joints"; empty if they are as independent as these.
    ranks_at_once : int
        Number of ranks at which an end of the interval of a quantile is searched at once: many where the ends of shares
        may rise with the level.
    innermost : bool
        Whether that end is then the innermost load, not the outermost, at which shares exclude the quantile.
    """

    is_sample: ClassVar[bool] = True
    independent: ClassVar[bool] = False
    interval: str = ""
    covers: str = "no intervals: the joints are no sample of a production"
    of_quantiles: ClassVar[str] = "of order statistics"
    of_delivery: ClassVar[str] = ""
    ranks_at_once: ClassVar[int] = 16
    innermost: ClassVar[bool] = False

    def shares(self, x: Column, levels: FloatArray, confidence: float) -> Estimate[FloatArray]:
        """Share of the joints above each level and its pointwise interval, (m,) each; by default without an interval.

        Parameters
        ----------
        x : Column
            A number of each joint; joints with NaN do not count.
        levels : ndarray, shape (m,)
            Levels, in any order.
        confidence : float
            Confidence level of the intervals.
        """
        none = np.full(levels.shape, np.nan)
        return Estimate(self.estimate(x, levels), none, none)

    def estimate(self, x: Column, levels: FloatArray) -> FloatArray:
        """Share of the joints above each level, (m,), as in `shares`."""
        with np.errstate(invalid="ignore"):  # NaN without joints
            return np.asarray(x.above(levels) / np.float64(x.n))

    def level(self, confidence: float) -> float:
        """Confidence level with which intervals are computed, for them to hold with `confidence`; by default that."""
        return confidence

    def only(self, joints: NDArray[np.intp] | NDArray[np.bool_]) -> Design:
        """Return the design of some of the joints; by default the same."""
        return self

    def refuses(self) -> tuple[str, str] | None:
        """Return why the joints give no estimate, and the remedy, of file ``{path}``; None if they do."""
        return None

    def units(self, n: int) -> NDArray[np.intp]:
        """Number of the unit of each of n joints, (n,): units are independent of each other."""
        return np.arange(n)

    def delivery(
        self, lower: Column, upper: Column, level: float, number: int, confidence: float
    ) -> tuple[float, float]:
        """Prediction interval for the number above a level among further joints; see `analysis.prediction`.

        Parameters
        ----------
        lower, upper : Column
            Lower and upper end of the number of each joint.
        level, confidence
            As in `shares`.
        number : int
            Number of further joints.

        Returns
        -------
        lower, upper : float
            Whole numbers, ends included; NaN without an interval.
        """
        at, half = np.array([level]), prediction.half(confidence)
        low, high = self.shares(lower, at, half).lower[0], self.shares(upper, at, half).upper[0]
        return prediction.of_share(float(low), float(high), number, confidence)


class Independent(Design):
    """Joints drawn one by one from the tolerances."""

    independent = True
    interval = "Clopper–Pearson's"
    covers = "bands: pointwise 95 % Clopper–Pearson intervals of the settled joints"

    def shares(self, x: Column, levels: FloatArray, confidence: float) -> Estimate[FloatArray]:
        """See `Design.shares`; the interval is exact (Clopper and Pearson 1934)."""
        return Estimate(self.estimate(x, levels), *clopper_pearson(x.above(levels), x.n, self.level(confidence)))

    def delivery(
        self, lower: Column, upper: Column, level: float, number: int, confidence: float
    ) -> tuple[float, float]:
        """See `Design.delivery`; exact (Thatcher 1964)."""
        at = np.array([level])
        least, most = int(lower.above(at)[0]), int(upper.above(at)[0])
        return prediction.of_counts(least, most, upper.n, number, self.level(confidence))


class Looked(Independent):
    """Joints drawn one by one until a stop rule ended the campaign: intervals hold after any number of its looks."""

    interval = f"Clopper–Pearson's of {100 * LOOK_CONFIDENCE:g} %, valid after any number of looks"
    covers = "bands: pointwise 95 % intervals of the settled joints, valid after any number of looks"

    def level(self, confidence: float) -> float:
        """See `Design.level`: an interval of one look misses less often, as at a stop (`binomial.LOOK_CONFIDENCE`)."""
        return 1.0 - (1.0 - confidence) * (1.0 - LOOK_CONFIDENCE) / 0.05


class Listed(Design):
    """Joints that are no sample of a production, so that no estimate has an interval.

    Parameters
    ----------
    method : str
        Sampling method.
    """

    is_sample = False

    def __init__(self, method: str = "") -> None:
        self._method = method

    def refuses(self) -> tuple[str, str] | None:
        """See `Design.refuses`."""
        if self._method == "subset":
            remedy = "print its probability: tolstat rare {path}"
            return "holds the levels of a subset simulation, no random sample", remedy
        return "holds joints that are no sample of a production", SAMPLE


def or_independent(
    estimate: Estimate[FloatArray], x: Column, levels: FloatArray, confidence: float
) -> Estimate[FloatArray]:
    """Let intervals contain Clopper and Pearson's, too, where fewer than `FEW` joints are on a side of a level."""
    count = x.above(levels)
    low, high = clopper_pearson(count, x.n, confidence)
    few = np.minimum(count, x.n - count) < FEW
    lower = np.where(few, np.minimum(estimate.lower, low), estimate.lower)
    return Estimate(estimate.estimate, lower, np.where(few, np.maximum(estimate.upper, high), estimate.upper))


def counts_by_group(x: Column, groups: NDArray[np.intp], levels: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Count the joints of each group above each level.

    Parameters
    ----------
    x : Column
        A number of each joint.
    groups : ndarray of int, shape (n,)
        Group of each joint, from 0.
    levels : array_like, shape (m,)
        Levels.

    Returns
    -------
    above : ndarray, shape (groups, m)
        Joints above each level.
    joints : ndarray, shape (groups,)
        Joints that count.
    """
    values = x.values
    counts = ~np.isnan(values)
    levels = np.asarray(levels, dtype=float)
    order = np.argsort(levels, kind="stable")
    number, steps = int(groups.max(initial=-1)) + 1, levels.size + 1
    below = np.searchsorted(levels[order], values[counts], side="left")  # number of levels that the joint is above
    table = np.bincount(groups[counts] * steps + below, minlength=number * steps).reshape(number, steps)
    above = np.empty((number, levels.size))
    above[:, order] = table[:, ::-1].cumsum(axis=1)[:, ::-1][:, 1:]
    return above, table.sum(axis=1).astype(float)
