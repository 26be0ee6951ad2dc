"""Rainflow cycles of the joints of a result file: read, or counted from the loads over a revolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.cycles import Cycles
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.load_kinds import CHANNELS
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import SIMULATED
from tolstat.solver import rainflow
from tolstat.store.revolutions import blocks, loads
from tolstat.study.selection import select

if TYPE_CHECKING:
    from tolstat.store.reader import Reader


def channels(patterns: Sequence[str]) -> tuple[str, ...]:
    """Names of the channels that any of the patterns selects, in the order of `load_kinds.CHANNELS`.

    Raises
    ------
    InputError
        With every pattern that selects nothing.
    """
    found = {pattern: select(pattern, CHANNELS) for pattern in patterns}
    faults = [
        Fault(f"channel {pattern!r}", "selects nothing", did_you_mean(pattern, list(CHANNELS)[:8]))
        for pattern, names in found.items()
        if not names
    ]
    if faults:
        raise InputError(faults)
    return tuple(name for name in CHANNELS if any(name in names for names in found.values()))


def cycles_of(store: Reader, slots: NDArray[np.intp], names: Sequence[str] | None = None) -> Cycles:
    """Rainflow cycles of joints over one revolution.

    Cycles stored by the workers (``histories = "cycles"``) are read. Otherwise they are counted now, from the load
    histories or from the loads restored from harmonics.

    Parameters
    ----------
    store : Reader
        The campaign.
    slots : ndarray of int, shape (m,)
        File slots, ascending.
    names : sequence of str, optional
        Channels to keep; by default all 64: some 8 kB per joint.

    Returns
    -------
    Cycles
        Row i is the joint ``slots[i]``; NaN for joints without results.

    Raises
    ------
    StoreError
        When the file holds no histories.
    """
    if not store.history_specs:
        remedy = 'set histories = "cycles" in [output] of the study and run it anew'
        raise StoreError(str(Fault(str(store.path), "holds neither cycles nor load histories", remedy)))
    names = tuple(CHANNELS) if names is None else tuple(names)
    place = [list(CHANNELS).index(name) for name in names]
    table = np.empty((len(slots), len(names), rainflow.KEPT, 2), np.float32)
    number = np.empty((len(slots), len(names)))
    for part in blocks(len(slots)):
        counted = _count(store, slots[part])
        table[part], number[part] = counted["cycles"][:, place], counted["cycle_count"][:, place]
    status = store.status(slice(int(slots.max(initial=-1)) + 1))[slots]
    without = ~np.isin(status, SIMULATED)
    table[without], number[without] = np.nan, np.nan
    used = max(1, int(np.max(number, initial=0.0, where=np.isfinite(number))))
    table = table[..., :used, :]
    return Cycles.of_revolution(names, table[..., 0], table[..., 1], number)


def _count(store: Reader, slots: NDArray[np.intp]) -> dict[str, NDArray[Any]]:
    """Cycles of a few joints, by name of `rainflow.SPECS`."""
    if "cycles" in store.history_specs:
        return {name: store.histories(name, slots) for name in rainflow.SPECS}
    joints = [rainflow.count(load) for load in loads(store, slots)]
    return {name: np.stack([joint[name] for joint in joints]) for name in rainflow.SPECS}
