"""Joints that are listed: sweeps, cases, designs, and one set of Sobol' points or one Latin hypercube."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.design import SAMPLE, Claim, Design

WITHOUT_INTERVAL = {"sobol": "Sobol' points", "lhs": "a Latin hypercube"}
"""Sampling methods of a production whose joints are not independent."""


def without_interval(method: str) -> str:
    """Return why shares of one set of joints have no interval, and the remedy; empty if they have one."""
    if method not in WITHOUT_INTERVAL:
        return ""
    remedy = 'set sampling.replicates = 8, or sampling.method = "random"'
    return f"shares of {WITHOUT_INTERVAL[method]} have no interval: {remedy} for a verdict"


class Listed(Design):
    """Joints that depend on each other, so that no claim has an interval.

    Parameters
    ----------
    method : str
        Sampling method.
    """

    def __init__(self, method: str = "") -> None:
        self._method = method
        self.is_sample = method in (*WITHOUT_INTERVAL, "random")

    def only(self, joints: NDArray[np.intp] | NDArray[np.bool_]) -> Listed:
        """See `Design.only`."""
        return self

    def refuses(self, claim: Claim) -> tuple[str, str] | None:
        """See `Design.refuses`."""
        if self._method == "subset":
            remedy = "print its probability: tolstat rare {path}"
            return "holds the levels of a subset simulation, no random sample", remedy
        if self._method in ("cases", "sweep"):
            return "holds joints that are no sample of a production", SAMPLE
        return None

    def without_interval(self, claim: Claim) -> str:
        """See `Design.without_interval`."""
        return without_interval(self._method) or super().without_interval(claim)
