"""How far a campaign is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.tables import FAILED, Status


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
    not_resolved : int
        Joints among them whose results finer steps would not repeat.
    """

    total: int
    done: int
    not_settled: int
    failed: int
    not_resolved: int = 0

    @classmethod
    def of(cls, status: NDArray[np.uint8]) -> Counts:
        """Count joints by their `status`, (m,)."""
        return cls(len(status), 0, 0, 0).after(status)

    @property
    def shortfall(self) -> str:
        """``"1 failed, 0 not settled"``, and how many are not resolved if any are."""
        words = f"{self.failed} failed, {self.not_settled} not settled"
        return words + (f", {self.not_resolved} not resolved" if self.not_resolved else "")

    def after(self, status: NDArray[np.uint8]) -> Counts:
        """Count further joints that have ended with `status`, (m,)."""

        def count(*states: Status) -> int:
            return int(np.count_nonzero(np.isin(status, states)))

        return Counts(
            self.total,
            self.done + len(status) - count(Status.PENDING),
            self.not_settled + count(Status.NOT_SETTLED, Status.NOT_PERIODIC),
            self.failed + count(*FAILED),
            self.not_resolved + count(Status.NOT_RESOLVED),
        )
