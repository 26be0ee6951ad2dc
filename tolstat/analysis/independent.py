"""Independent joints of equal weight: counts above a level are binomial."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import prediction
from tolstat.analysis.binomial import clopper_pearson
from tolstat.analysis.column import Column
from tolstat.analysis.design import Design
from tolstat.analysis.estimates import Estimate
from tolstat.common.loads import FloatArray


class Independent(Design):
    """Joints drawn one by one from the tolerances: every claim has an interval."""

    claims = frozenset(("share", "quantile", "mean", "difference", "index", "tail", "band", "delivery", "reweighting"))
    interval = "Clopper–Pearson's"
    covers = "bands: pointwise 95 % Clopper–Pearson intervals of the settled joints"

    def shares(self, x: Column, levels: FloatArray, confidence: float) -> Estimate[FloatArray]:
        """See `Design.shares`; the interval is exact (Clopper and Pearson 1934)."""
        return Estimate(self.estimate(x, levels), *clopper_pearson(x.above(levels), x.n, confidence))

    def only(self, joints: NDArray[np.intp] | NDArray[np.bool_]) -> Independent:
        """See `Design.only`."""
        return self

    def delivery(
        self, lower: Column, upper: Column, level: float, number: int, confidence: float
    ) -> tuple[float, float]:
        """See `Design.delivery`; exact (Thatcher 1964)."""
        at = np.array([level])
        least, most = int(lower.above(at)[0]), int(upper.above(at)[0])
        return prediction.of_counts(least, most, upper.n, number, confidence)
