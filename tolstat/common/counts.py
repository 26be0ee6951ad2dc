"""Progress of a campaign: numbers of joints by status, and the run under way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.tables import FAILED, UNSETTLED, Status

POWER = 0.9
"""Share of the campaigns that decide with the number of joints that is said to decide."""


class Counts(NamedTuple):
    """Numbers of joints by status.

    Attributes
    ----------
    total : int
        All joints.
    done : int
        Joints that are not pending.
    unsettled : int
        Joints whose status is in `tables.UNSETTLED`.
    failed : int
        Joints without results.
    not_resolved : int
        Those of the unsettled joints whose largest loads still change with finer steps.
    points : int
        Operating points; a joint counts once at each.
    noun : str
        What joints are called.
    """

    total: int
    done: int = 0
    unsettled: int = 0
    failed: int = 0
    not_resolved: int = 0
    points: int = 1
    noun: str = "joints"

    @classmethod
    def of(cls, status: NDArray[np.uint8]) -> Counts:
        """Count joints by their `status`, (m,)."""
        return cls(len(status)).after(status)

    @property
    def counted(self) -> str:
        """``"joints"``, or ``"simulations of joints at 2 operating points"``."""
        return self.noun if self.points == 1 else f"simulations of {self.noun} at {self.points} operating points"

    @property
    def shortfall(self) -> str:
        """``"1 failed, 0 not settled"``, and how many are not resolved if any are."""
        words = f"{self.failed} failed, {self.unsettled - self.not_resolved} not settled"
        return words + (f", {self.not_resolved} not resolved" if self.not_resolved else "")

    def after(self, status: NDArray[np.uint8]) -> Counts:
        """Return these counts plus those of further joints with the given `status`, (m,)."""

        def count(*states: Status) -> int:
            return int(np.count_nonzero(np.isin(status, states)))

        return self._replace(
            done=self.done + len(status) - count(Status.PENDING),
            unsettled=self.unsettled + count(*UNSETTLED),
            failed=self.failed + count(*FAILED),
            not_resolved=self.not_resolved + count(Status.NOT_RESOLVED),
        )


class Session(NamedTuple):
    """A run under way: when it started (Unix time, s), and how many joints were done by then."""

    started: float
    done: int
