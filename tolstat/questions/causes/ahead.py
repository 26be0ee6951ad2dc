"""Joints whose loads over the revolution the page shows: simulated again while the rest of the page is made."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from tolstat.common.channels import CHANNELS, histories_of
from tolstat.common.errors import TolstatError
from tolstat.display.asked import Asked
from tolstat.questions.causes.revolution import evaluated
from tolstat.questions.causes.worst import drawn
from tolstat.store import revolutions
from tolstat.store.view import View


def begin(view: View, asked: Asked) -> None:
    """Begin to simulate again the joints whose loads over the revolution the page shows; see `revolutions.ahead`."""
    if not asked.replay or len(view.points) > 1 or view.method == "sweep":
        return
    with suppress(TolstatError):  # the questions say what is wrong
        followed = [load for load in view.leading if load in CHANNELS]
        slots = [view.slots(np.sort(drawn(view, load))) for load in followed]
        if slots and not revolutions.held(view.store, histories_of(followed)):
            with suppress(TolstatError):
                nominal, samples = evaluated(view, asked.replay)
                slots += [nominal, view.slots(samples)]
            revolutions.ahead(view.store, np.unique(np.concatenate(slots)), asked.processes)
