"""Results of the evaluation of a campaign: everything that its page shows, as numbers."""

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
        Load histories of the first of these joints, rows ascending; None if the page shows no histories.
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
        The joints with their status and largest loads; with their errors only for a sweep.
    question : str
        Question of the study, from its opening comment; empty if there is none.
    accepted : float
        Accepted share: share of the joints that may exceed a limit; NaN if none is given.
    counts : dict of str to int
        Joints by status, in the order of `tables.Status`.
    modes : ndarray, shape (4, 4)
        Mean share of the revolution of each pin in each contact mode, over the settled joints; NaN if not kept.
    leading : tuple of str
        Leading load of each kind, see `page.leading`.
    logarithmic : frozenset of str
        Leading loads with a tail so long that a few joints dominate the variance: their causes refer to the logarithm.
    causes, angles, worst : tuple
        Results for the leading loads.
    loading : Loading, optional
        Load cycles, if the file holds cycles or histories.
    lost : tuple of Lost
        The first joints without a valid result.
    lost_errors : DataFrame, optional
        ``error``, and ``direction`` and ``size`` as in `causes.Causes.table`: errors of joints without a valid result
        compared with those of settled joints; None if there are too few of either.
    facts : tuple of (str, str)
        Provenance of the numbers, as names and values.
    study : str
        Text of the study.
    notes : tuple of str
        Remarks that concern the whole page.
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
        """Whether an accepted share is given."""
        return bool(np.isfinite(self.accepted))

    @property
    def sampled(self) -> bool:
        """Whether the joints are a sample of a production, not a grid or a design."""
        return self.campaign.method in ("random", "sobol", "lhs", "importance")

    @property
    def alike(self) -> bool:
        """Whether all joints have the same weight."""
        return self.campaign.weights is None
