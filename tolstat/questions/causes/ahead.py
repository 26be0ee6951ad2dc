"""Joints whose loads over the revolution the page shows: simulated again while the rest of the page is made."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import TolstatError
from tolstat.common.loads import BUSHING_LOADS
from tolstat.display.asked import Asked
from tolstat.questions.causes.angles import evaluated
from tolstat.questions.causes.tail import worst_joints
from tolstat.store import revolutions
from tolstat.store.view import View

DRAWN = 3
"""Number of the worst joints drawn for each load."""


def begin(view: View, asked: Asked) -> None:
    """Begin to simulate again the joints whose loads over the revolution the page shows; see `revolutions.ahead`."""
    if not asked.replay or len(view.points) > 1 or view.method == "sweep" or revolutions.held(view.store):
        return
    with suppress(TolstatError):  # the sections say what is wrong
        slots = [view.slots(drawn(view, load)) for load in view.leading if load in BUSHING_LOADS]
        if slots:
            with suppress(TolstatError):
                nominal, samples = evaluated(view, asked.replay)
                slots += [nominal, view.slots(samples)]
            revolutions.ahead(view.store, np.unique(np.concatenate(slots)), asked.processes)


def drawn(view: View, load: str) -> NDArray[np.intp]:
    """Samples of the worst joints whose loads over the revolution are drawn, ascending."""
    return np.unique(worst_joints(view, load, DRAWN).samples)
