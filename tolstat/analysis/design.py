"""What the joints of a campaign allow to conclude: the contract of a sampling design, and the plainest ones.

Independent joints, and joints that are no sample of a production: sweeps, cases, levels of a subset simulation.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import prediction
from tolstat.analysis.binomial import LOOK_CONFIDENCE, clopper_pearson
from tolstat.analysis.estimates import Column, Estimate
from tolstat.common.loads import FloatArray

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
        may rise with the level. The end is the innermost load at which shares exclude the quantile.
    """

    is_sample: ClassVar[bool] = True
    independent: ClassVar[bool] = False
    interval: str = ""
    covers: str = "no intervals: the joints are no sample of a production"
    of_quantiles: ClassVar[str] = "of order statistics"
    of_delivery: ClassVar[str] = ""
    ranks_at_once: ClassVar[int] = 16

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
        return Estimate(x.shares(levels), none, none)

    def level(self, confidence: float) -> float:
        """Confidence level with which intervals are computed, for them to hold with `confidence`; by default that."""
        return confidence

    def groups(self, n: int) -> NDArray[np.intp] | None:
        """Number of the group of each of the n joints, groups independent of each other; by default None: no groups."""
        return None

    def only(self, joints: NDArray[np.intp] | NDArray[np.bool_]) -> Design:
        """Return the design of some of the joints; by default the same."""
        return self

    def refuses(self) -> tuple[str, str] | None:
        """Return why the joints give no estimate, and the remedy, of file ``{path}``; None if they do."""
        return None

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
            Whole numbers, ends included; NaN without an interval, as by default.
        """
        return np.nan, np.nan


class Independent(Design):
    """Joints drawn one by one from the tolerances."""

    independent = True
    interval = "Clopper–Pearson's"
    covers = "bands: pointwise 95 % Clopper–Pearson intervals of the settled joints"

    def groups(self, n: int) -> NDArray[np.intp]:
        """See `Design.groups`: each joint by itself."""
        return np.arange(n)

    def shares(self, x: Column, levels: FloatArray, confidence: float) -> Estimate[FloatArray]:
        """See `Design.shares`; the interval is exact (Clopper and Pearson 1934)."""
        return Estimate(x.shares(levels), *clopper_pearson(x.above(levels), x.n, self.level(confidence)))

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
