"""Verdicts on the lives that a study requires: of the bearings, and of its parts."""

from __future__ import annotations

import math
from functools import partial

from tolstat.common.errors import TolstatError
from tolstat.common.tables import VALID
from tolstat.display.verdict import Verdict
from tolstat.questions.bearing_life import answer as bearing_life
from tolstat.questions.fatigue import answer as fatigue
from tolstat.store.view import View

SAMPLES = 1000
"""Maximum number of joints that are simulated again for the stresses of their parts."""


def life_verdicts(view: View, accepted: float = math.nan, samples: int | None = None) -> list[Verdict]:
    """Verdicts on the lives that the study of a campaign requires; none of joints that are no sample of a production.

    Parameters
    ----------
    view : View
        The campaign; it may be unfinished.
    accepted : float
        Accepted share: share of the joints that may have a shorter life; NaN if none is given.
    samples : int, optional
        Number of joints that may be simulated again; by default `SAMPLES`, and none while joints are pending.
    """
    if not (view.sampled and view.count(*VALID)):
        return []
    if samples is None:
        samples = SAMPLES if view.counts.done == view.counts.total else 0
    found: list[Verdict] = []
    of_parts = partial(fatigue.life_verdicts, samples=samples)
    for about, verdicts in (("bearing life", bearing_life.life_verdicts), ("failures of parts", of_parts)):
        try:
            found += verdicts(view, accepted)
        except TolstatError as error:
            reason = str(error).splitlines()[0].replace(str(view.path), view.path.name)
            found.append(Verdict(about, "none", f"{about}: {reason}"))
    return found
