"""Progress of a campaign: numbers of joints by status."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.shown import shown
from tolstat.common.tables import FAILED, Status


@shown
class Counts(NamedTuple):
    """Numbers of joints by status.

    Attributes
    ----------
    total : int
        All joints.
    done : int
        Joints that are not pending.
    not_settled : int
        Joints whose status is NOT_SETTLED or NOT_PERIODIC.
    failed : int
        Joints without results.
    not_resolved : int
        Joints whose largest loads still change with finer steps.
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
        """Return these counts plus those of further joints with the given `status`, (m,)."""

        def count(*states: Status) -> int:
            return int(np.count_nonzero(np.isin(status, states)))

        return Counts(
            self.total,
            self.done + len(status) - count(Status.PENDING),
            self.not_settled + count(Status.NOT_SETTLED, Status.NOT_PERIODIC),
            self.failed + count(*FAILED),
            self.not_resolved + count(Status.NOT_RESOLVED),
        )
