"""Rainflow cycles of the joints of a campaign or a duty cycle, from the file or from their loads over the angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import cycles
from tolstat.analysis.cycles import Cycles
from tolstat.common.channels import BUSHING_LOADS, COMPONENTS, LOAD_HISTORIES, LoadHistory, Signal
from tolstat.common.loads import FloatArray
from tolstat.common.tables import Status
from tolstat.questions.fatigue.duty import Joints
from tolstat.solver import histories
from tolstat.store import reader, revolutions
from tolstat.store.view import View


@dataclass(frozen=True)
class Counted(Joints):
    """Cycles of joints.

    Attributes
    ----------
    cycles : Cycles
        Cycles of the n samples, those between operating points and those of starts included.
    nominal : Cycles
        Cycles of the nominal joint; no rows if there is none that settled at all operating points.
    apart : float
        As in `revolutions.Revolutions`.
    """

    cycles: Cycles
    nominal: Cycles
    apart: float


def count(
    views: Sequence[View],
    shares: Sequence[float],
    joints: Joints,
    signals: Sequence[Signal],
    chosen: NDArray[np.bool_],
    kept: int = histories.KEPT,
) -> Counted:
    """Count the cycles of joints at each operating point, between them, and of starts.

    Parameters
    ----------
    views, shares : sequence of View, sequence of float
        The `duty.members`.
    joints : Joints
        Their first n samples.
    signals : sequence of Signal
        What cycles are counted of. Where a file does not hold it, the joints are simulated again.
    chosen : ndarray of bool, shape (n,)
        Samples that are evaluated; the others have NaN.
    kept : int
        Maximum number of cycles of a signal at an operating point, the largest ones.
    """
    both = int(all((view.nominal["status"] == Status.OK).any() for view in views))
    rows = np.append(np.zeros(both, np.intp), 1 + np.flatnonzero(chosen))
    parts, apart = list[Cycles](), 0.0
    for view in views:
        slots = np.append(view.nominal_slots[:both], view.slots(rows[both:] - 1))
        part, difference = of_slots(view.store, slots, signals, kept)
        parts.append(part.spread(rows, 1 + joints.status.size))
        apart = max(apart, difference)
    low, high = (np.stack([getattr(part, end) for part in parts], axis=2) for end in ("low", "high"))
    whole = cycles.duty_cycle(parts, shares, joints.transitions(low, high))
    whole = whole.with_starts(joints.settings.starts / joints.settings.revolutions)
    return Counted(**vars(joints), cycles=whole.rows(slice(1, None)), nominal=whole.rows(slice(both)), apart=apart)


def held(store: reader.Reader, signals: Sequence[Signal]) -> bool:
    """Whether a file holds cycles of these signals, or the loads that they are counted from."""
    return revolutions.held(store, LOAD_HISTORIES) != "" or all(_is_stored(store, signal) for signal in signals)


def of_slots(
    store: reader.Reader, slots: NDArray[np.intp], signals: Sequence[Signal], kept: int = histories.KEPT
) -> tuple[Cycles, float]:
    """Cycles of joints over one revolution, row i of the joint ``slots[i]``, and `Revolutions.apart`.

    Parameters
    ----------
    store : ResultFile
        The campaign, at one operating point.
    slots : ndarray of int, shape (m,)
        File slots of joints with results, ascending.
    signals, kept
        As in `count`. Cycles of components that workers stored (``histories = "cycles"``) are read.
    """
    stored = np.array([_is_stored(store, signal) for signal in signals], bool)
    others, apart = tuple(signal for signal, is_stored in zip(signals, stored, strict=True) if not is_stored), 0.0
    tables: list[tuple[NDArray[np.floating], FloatArray]] = []
    if stored.any():
        tables.append(_stored(store, slots, [signal for signal in signals if signal not in others]))
    if others:
        counted, apart = _counted(store, slots, others, kept)
        tables.append(counted)
    order = np.argsort(np.append(np.flatnonzero(stored), np.flatnonzero(~stored)))
    number = np.concatenate([number for _, number in tables], axis=1)[:, order]
    table = _joined([table for table, _ in tables], axis=1)[:, order]
    return Cycles.of_revolution(tuple(s.name for s in signals), table[..., 0], table[..., 1], number), apart


def _is_stored(store: reader.Reader, signal: Signal) -> bool:
    return signal.name in COMPONENTS and f"{signal.history.prefix}cycles" in store.history_specs


def _stored(
    store: reader.Reader, slots: NDArray[np.intp], signals: Sequence[Signal]
) -> tuple[NDArray[np.floating], FloatArray]:
    """Cycles that workers stored, (m, signals, k, 2), and their numbers, (m, signals)."""
    tables, numbers = [], []
    for history in LOAD_HISTORIES:
        of_history = [signal.name for signal in COMPONENTS.values() if signal.history == history]
        columns = [of_history.index(signal.name) for signal in signals if signal.history == history]
        if columns:
            tables.append(store.histories(f"{history.prefix}cycles", slots)[:, columns])
            numbers.append(store.histories(f"{history.prefix}cycle_count", slots)[:, columns])
    order = np.argsort([i for h in LOAD_HISTORIES for i, signal in enumerate(signals) if signal.history == h])
    table, number = (np.concatenate(each, axis=1)[:, order] for each in (tables, numbers))
    return table[:, :, : max(1, int(number.max(initial=0)))], number.astype(float)


def _counted(
    store: reader.Reader, slots: NDArray[np.intp], signals: tuple[Signal, ...], kept: int
) -> tuple[tuple[NDArray[np.floating], FloatArray], float]:
    """Cycles as in `_stored`, counted from loads that the file holds or from joints simulated again."""
    used: list[LoadHistory] = [h for h in LOAD_HISTORIES if h == BUSHING_LOADS or any(s.history == h for s in signals)]
    tables, numbers, apart = list[FloatArray](), list[FloatArray](), 0.0
    for _, loads, difference in revolutions.of_components(store, slots, used):
        apart = max(apart, difference)
        for joint in range(len(loads[BUSHING_LOADS.name])):
            own = {name: values[joint] for name, values in loads.items()}
            ranges, means, number = histories.count(own, signals, kept)
            table = np.stack([ranges, means], axis=-1)[None, :, : max(1, int(number.max(initial=0)))]
            finite = all(np.isfinite(values).all() for values in own.values())  # else it failed, simulated again
            tables.append(table if finite else np.full_like(table, np.nan))
            numbers.append(number[None].astype(float) if finite else np.full((1, len(signals)), np.nan))
    none = np.zeros((0, len(signals), 1, 2)), np.zeros((0, len(signals)))
    return (_joined([none[0], *tables], axis=0), np.concatenate([none[1], *numbers])), apart


def _joined(tables: Sequence[NDArray[np.floating]], axis: int) -> NDArray[np.floating]:
    """Join tables (m, signals, k, 2) of cycles along an axis; those with fewer places get empty ones."""
    most = max(table.shape[2] for table in tables)
    return np.concatenate([np.pad(t, ((0, 0), (0, 0), (0, most - t.shape[2]), (0, 0))) for t in tables], axis=axis)
