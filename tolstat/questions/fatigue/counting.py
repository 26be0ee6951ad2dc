"""Rainflow cycles of the joints of a result file: read, or counted from the loads over a revolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.cycles import Cycles
from tolstat.common.channels import BUSHING_LOADS, CHANNELS, LoadHistory, channels_of, histories_of
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import SIMULATED
from tolstat.solver import rainflow
from tolstat.store.hdf5 import RUN_AGAIN
from tolstat.store.revolutions import blocks, held, loads
from tolstat.study.selection import select

if TYPE_CHECKING:
    from tolstat.store.reader import Reader


SHOWN = tuple(channel.name for channel in CHANNELS.values() if channel.kind.shown)
"""Channels that are evaluated unless others are asked for: those of the loads that every report shows."""


def channels(patterns: Sequence[str]) -> tuple[str, ...]:
    """Names of the channels that any of the patterns selects, in the order of `channels.CHANNELS`.

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
    store : ResultFile
        The campaign.
    slots : ndarray of int, shape (m,)
        File slots, ascending.
    names : sequence of str, optional
        Channels to keep; by default those `SHOWN`, 64 of bushings: some 8 kB per joint.

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
        remedy = 'set histories = "cycles" in [output] of the study: tolstat run STUDY --out OTHER.h5'
        raise StoreError(str(Fault(str(store.path), "holds neither cycles nor load histories", remedy)))
    names = SHOWN if names is None else tuple(names)
    histories = histories_of(names)
    order = [channel.name for history in histories for channel in channels_of(history)]
    place = [order.index(name) for name in names]
    lacking = [name for h in histories if (name := f"{h.prefix}cycles") not in store.history_specs]
    if lacking and "cycles" in store.history_specs and not held(store, histories):
        raise StoreError(str(Fault(str(store.path), f"holds no {', '.join(lacking)}", RUN_AGAIN)))
    table = np.empty((len(slots), len(names), rainflow.KEPT, 2), np.float32)
    number = np.empty((len(slots), len(names)))
    for part in blocks(len(slots)):
        cycles, counts = _count(store, slots[part], histories)
        table[part], number[part] = cycles[:, place], counts[:, place]
    status = store.status(slice(int(slots.max(initial=-1)) + 1))[slots]
    without = ~np.isin(status, SIMULATED)
    table[without], number[without] = np.nan, np.nan
    used = max(1, int(np.max(number, initial=0.0, where=np.isfinite(number))))
    table = table[..., :used, :]
    return Cycles.of_revolution(names, table[..., 0], table[..., 1], number)


def _count(
    store: Reader, slots: NDArray[np.intp], histories: Sequence[LoadHistory]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Cycles of a few joints, and their numbers, as `rainflow.count` gives them; history after history."""
    names = [[f"{history.prefix}{name}" for history in histories] for name in ("cycles", "cycle_count")]
    if set(names[0]) <= set(store.history_specs):
        counted = {name: store.histories(name, slots) for own in names for name in own}
    else:
        found = loads(store, slots, [BUSHING_LOADS, *(h for h in histories if h != BUSHING_LOADS)])
        joints = [rainflow.count({name: own[i] for name, own in found.items()}) for i in range(len(slots))]
        counted = {name: np.stack([joint[name] for joint in joints]) for own in names for name in own}
    cycles, counts = (np.concatenate([counted[name] for name in own], axis=1) for own in names)
    return cycles, counts
