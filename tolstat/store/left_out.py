"""Warning about joints that were left out because their results are damaged."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np

from tolstat.common.errors import Fault

if TYPE_CHECKING:
    from tolstat.store.reader import Reader

MAX_TOLD = 5
"""Most damaged rows that a warning lists."""
LOG = logging.getLogger("tolstat.store")


def tell(store: Reader, done: str, remedy: str) -> None:
    """Warn of the joints that were found damaged so far, once; silent if there are none.

    Parameters
    ----------
    store : Reader
        The file.
    done : str
        What becomes of the results, ``"are left out"``.
    remedy : str
        What to do about it.
    """
    slots = np.flatnonzero(store._left_out)
    if slots.size:
        joints = "1 joint" if slots.size == 1 else f"{slots.size} joints"
        rows = ", ".join(map(str, store.row(slots[:MAX_TOLD]).tolist())) + ", ..." * (slots.size > MAX_TOLD)
        found = f"the results of {joints} are damaged and {done}: row {rows}"
        LOG.warning("warning: %s", Fault(str(store.path), found, remedy))
        store._left_out[:] = False
