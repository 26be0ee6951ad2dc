"""What was found out about a campaign: all that its page shows, as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd

from tolstat.analysis.exceedance import FloatArray
from tolstat.store.view import Campaign

if TYPE_CHECKING:
    from tolstat.questions.causes.angles import AgainstAngle
    from tolstat.questions.causes.query import Causes
    from tolstat.questions.causes.tail import TailJoint
    from tolstat.questions.fatigue.query import Loading
    from tolstat.store.revolutions import Revolutions


class Worst(NamedTuple):
    """The joints with the largest value of a load.

    Attributes
    ----------
    load, unit : str
        The load, and its SI unit.
    joints : sequence of TailJoint
        The largest first.
    revolutions : Revolutions, optional
        Of the first of them, rows ascending; None where the page is to be made without.
    """

    load: str
    unit: str
    joints: Sequence[TailJoint]
    revolutions: Revolutions | None


class Lost(NamedTuple):
    """A joint without a valid result: its row in the campaign, its status and what to do about it."""

    row: int
    status: str
    remedy: str


@dataclass(frozen=True)
class Findings:
    """Everything that a page shows.

    Attributes
    ----------
    campaign : Campaign
        The joints; of the results only status and largest loads, of the errors none but for a sweep.
    question : str
        What the study asks, from the comment that opens it; empty where it does not say.
    accepted : float
        Share of the joints that may exceed a limit; NaN where nothing is asked.
    counts : dict of str to int
        Joints by status, in the order of `tables.Status`.
    modes : ndarray, shape (4, 4)
        Mean share of the revolution of each pin in each contact mode, over the settled joints; NaN where not kept.
    leading : tuple of str
        Of each kind of load the one that counts most, see `page.leading`.
    logarithmic : frozenset of str
        Those of them with so long a tail that the variance would be that of a few joints: causes are of the logarithm.
    causes, angles, worst : tuple
        Of the leading loads.
    loading : Loading, optional
        Load cycles, where the file holds them or histories.
    lost : tuple of Lost
        The first joints without a valid result.
    lost_errors : DataFrame, optional
        ``error``, and ``direction`` and ``size`` as in `causes.Causes.table`: whether joints without a valid result
        have other errors than the settled ones; None where too few are lost.
    facts : tuple of (str, str)
        Where the numbers come from.
    study : str
        Text of the study.
    notes : tuple of str
        What the reader must know of the whole.
    """

    campaign: Campaign
    question: str
    accepted: float
    counts: dict[str, int]
    modes: FloatArray
    leading: tuple[str, ...]
    logarithmic: frozenset[str]
    causes: tuple[Causes, ...]
    angles: tuple[AgainstAngle, ...]
    worst: tuple[Worst, ...]
    loading: Loading | None
    lost: tuple[Lost, ...]
    lost_errors: pd.DataFrame | None
    facts: tuple[tuple[str, str], ...]
    study: str
    notes: tuple[str, ...]

    @property
    def judged(self) -> bool:
        """Whether a share is asked for."""
        return bool(np.isfinite(self.accepted))

    @property
    def sampled(self) -> bool:
        """Whether the joints are a sample of a production, and neither a grid nor a design."""
        return self.campaign.method in ("random", "sobol", "lhs", "importance")

    @property
    def alike(self) -> bool:
        """Whether every joint counts the same."""
        return self.campaign.weights is None
