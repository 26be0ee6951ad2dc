"""The sampling designs, and which of them a campaign has."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.clustered import Clustered
from tolstat.analysis.design import Design
from tolstat.analysis.independent import Independent
from tolstat.analysis.listed import Listed
from tolstat.analysis.replicated import Replicated
from tolstat.analysis.weighted import Weighted
from tolstat.common.loads import FloatArray


class Drawn(NamedTuple):
    """How the joints of a file were drawn.

    Attributes
    ----------
    method : str
        Sampling method.
    samples : range
        Number of each joint among the random joints of the campaign, (n,).
    joints_per_lot, replicates : int
        Joints that share a lot; replicates of the campaign, 1 if the file holds a part of it only.
    weights, heaviest : ndarray, shape (n,), optional, and float
        Weights of importance sampling, and the largest that a joint can have.
    from_tolerances : ndarray of bool, shape (n,), optional
        See `Weighted`.
    """

    method: str
    samples: range
    joints_per_lot: int = 1
    replicates: int = 1
    weights: FloatArray | None = None
    heaviest: float = np.inf
    from_tolerances: NDArray[np.bool_] | None = None


def design_of(drawn: Drawn) -> Design:
    """Return the design of a campaign: the first that recognises how its joints were drawn."""
    if drawn.weights is not None:
        return Weighted(drawn.weights, drawn.heaviest, drawn.from_tolerances)
    if drawn.joints_per_lot > 1:
        return Clustered(np.asarray(drawn.samples) // drawn.joints_per_lot)
    if drawn.replicates > 1:
        return Replicated(len(drawn.samples), drawn.replicates, drawn.method)
    return Independent() if drawn.method == "random" else Listed(drawn.method)
