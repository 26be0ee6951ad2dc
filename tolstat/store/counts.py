"""How far a campaign is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.tables import FAILED, UNSETTLED, Status


class Counts(NamedTuple):
    """How far a campaign is.

    Attributes
    ----------
    total : int
        Joints of the campaign.
    done : int
        Joints that are not pending.
    not_settled : int
        Joints among them whose last revolution does not close.
    failed : int
        Joints among them without results.
    """

    total: int
    done: int
    not_settled: int
    failed: int

    def after(self, status: NDArray[np.uint8]) -> Counts:
        """Count further joints that have ended with `status`, (m,)."""
        return Counts(
            self.total,
            self.done + int(np.count_nonzero(status != Status.PENDING)),
            self.not_settled + int(np.count_nonzero(np.isin(status, UNSETTLED))),
            self.failed + int(np.count_nonzero(np.isin(status, FAILED))),
        )
