"""Joints whose loads over the revolution the page shows: simulated again while the rest of the page is made."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from tolstat.common.channels import CHANNELS, histories_of
from tolstat.common.errors import Fault, StoreError, TolstatError
from tolstat.common.tables import Status
from tolstat.display.asked import Asked
from tolstat.questions.causes.tail import worst_samples
from tolstat.store import revolutions
from tolstat.store.view import View

JOINTS = 1000
"""Default number of joints evaluated, the first settled ones: some 2 s if they are simulated again."""
MIN_JOINTS = 100
"""Minimum number of joints for shares to be given."""
DRAWN = 3
"""Number of the worst joints drawn for each load."""


def begin(view: View, asked: Asked) -> None:
    """Begin to simulate again the joints whose loads over the revolution the page shows; see `revolutions.ahead`."""
    if not asked.replay or len(view.points) > 1 or view.method == "sweep":
        return
    with suppress(TolstatError):  # the sections say what is wrong
        followed = [load for load in view.leading if load in CHANNELS]
        slots = [view.slots(drawn(view, load)) for load in followed]
        if slots and not revolutions.held(view.store, histories_of(followed)):
            with suppress(TolstatError):
                nominal, samples = evaluated(view, asked.replay)
                slots += [nominal, view.slots(samples)]
            revolutions.ahead(view.store, np.unique(np.concatenate(slots)), asked.processes)


def drawn(view: View, load: str) -> NDArray[np.intp]:
    """Samples of the worst joints whose loads over the revolution are drawn, ascending."""
    return np.unique(worst_samples(view, load, DRAWN))


def evaluated(view: View, joints: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """File slots of the nominal joint, (1,), if it settled, else (0,); and the samples that `against_angle` evaluates.

    Raises
    ------
    StoreError
        As `against_angle`.
    """
    view.check_drawn()
    view.check("index")
    if view.study.groups:
        remedy = 'give the file of a study with sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(view.path), "holds a pick-freeze design", remedy)))
    samples = np.flatnonzero(view.status == Status.OK)[:joints]
    if len(samples) < MIN_JOINTS:
        too_few = f"has {len(samples)} settled joints to evaluate"
        raise StoreError(str(Fault(str(view.path), too_few, f"{MIN_JOINTS} are needed: run more joints")))
    return view.nominal_slots[view.nominal["status"] == Status.OK], samples
