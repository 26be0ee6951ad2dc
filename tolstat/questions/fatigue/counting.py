"""Rainflow cycles of the joints of a campaign or a duty cycle, from the file or from their loads over the angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import cycles
from tolstat.analysis.cycles import Cycles, Transitions
from tolstat.analysis.design import Design
from tolstat.common.channels import BUSHING_LOADS, Signal, components, load_histories
from tolstat.common.loads import FloatArray
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Status
from tolstat.display.text import percent
from tolstat.solver import histories
from tolstat.store import reader, recorded, revolutions
from tolstat.store.view import View
from tolstat.study.fatigue import Fatigue, of_text

ANY = "any of them"
"""Name of the row for all points or channels together."""
CONFIDENCE = 0.95
HOUR = 3600.0


@dataclass(frozen=True)
class Joints:
    """Joints of one campaign or of a duty cycle, and the settings of their evaluation.

    Attributes
    ----------
    status : ndarray, shape (n,)
        `tables.Status`; with several operating points the worst, see `tables.worst_status`.
    design : Design
        How the joints were drawn.
    settings : Fatigue
        Section ``[fatigue]`` of the study, see `settings_of`.
    mechanism : Mechanism
        What is simulated.
    total : int
        Number of samples of the campaign, those not evaluated included.
    duty : tuple of (str, float)
        Operating points and their shares of the revolutions; one entry with share 1 for a single point.
    """

    status: NDArray[np.uint8]
    design: Design
    settings: Fatigue
    mechanism: Mechanism
    total: int
    duty: tuple[tuple[str, float], ...]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Which joints settled to a motion that repeats at all operating points, (n,)."""
        return np.asarray(self.status == Status.OK)

    @property
    def settled(self) -> str:
        """Words on the number of these joints."""
        return f"{int(self.valid.sum())} of {self.status.size} joints settled"

    @property
    def duty_in_words(self) -> list[str]:
        """Sentences on the shares of a duty cycle and its sequence; none for a single operating point."""
        shares = ", ".join(f"{percent(share)} at {name}" for name, share in self.duty)
        if len(self.duty) < 2:
            return []
        between = "not counted are cycles between the points: the study gives no [fatigue.sequence]"
        if self.visits:
            between = f"cycles between the points: {len(self.visits)} visits in {self.settings.turns:g} revolutions"
            if missed := [name for p, (name, _) in enumerate(self.duty) if p not in self.visits]:
                between += f"; no visit of {', '.join(missed)}"
        return [f"over a duty cycle: {shares}, shares of the revolutions", between]

    @property
    def visits(self) -> list[int]:
        """Points of `duty` in the order of their visits; empty where the study gives no sequence of several of them."""
        names = [name for name, _ in self.duty]
        visited = [names.index(name) for name in self.settings.visits if name in names]
        return visited if len(set(visited)) > 1 else []

    def transitions(self, low: FloatArray, high: FloatArray) -> Transitions | None:
        """Cycles that the sequence of operating points closes.

        Parameters
        ----------
        low, high : ndarray, shape (n, channels, points)
            Smallest and largest load at each point of `duty`; NaN for joints without results.

        Returns
        -------
        Transitions, optional
            None without `visits`.
        """
        if not self.visits:
            return None
        levels = (table.reshape(-1, len(self.duty)) for table in (low, high))
        tables = histories.between(self.visits, *levels)
        ranges, means, numbers, replaced = (table.reshape(*low.shape[:2], -1) for table in tables)
        return Transitions(ranges, means, numbers / self.settings.turns, replaced / self.settings.turns)


def joints_of(view: View, samples: int | None) -> Joints:
    """First samples of a campaign, whose operating points are the duty cycle if it has several; all without a number.

    Raises
    ------
    InputError
        When the shares of the operating points are not known.
    """
    several = len(view.parts) > 1
    shares = view.shares_of_revolutions.tolist() if several else [1.0]
    return Joints(
        status=view.status[:samples],
        design=view.design if samples is None else view.design.only(np.arange(min(samples, view.n))),
        settings=settings_of(view),
        mechanism=view.mechanism,
        total=view.n,
        duty=tuple(zip(view.points if several else (view.points[0] or view.path.name,), shares, strict=True)),
    )


def settings_of(view: View) -> Fatigue:
    """Section ``[fatigue]`` of the study of a campaign, with the service life in revolutions over the duty cycle."""
    bearing = (view.study.joint if view.study_path else recorded.joint_of(view.store, 0)).bearing
    hours = np.nan if bearing is None or bearing.required_life is None else bearing.required_life / HOUR
    shares = view.shares_of_revolutions if len(view.parts) > 1 else (1.0,)
    turns = (2.0 * np.pi / abs(part.store.operation.speed) for part in view.parts)
    turn = sum(share * each for share, each in zip(shares, turns, strict=True))
    return section(view).within(hours, HOUR / turn, str(view.path))


def section(view: View) -> Fatigue:
    """Section ``[fatigue]`` of the study in a file, or of the one that is read in its place.

    Of the text in the file the section alone is read, like limits: it is at hand even where the study refers to files
    that are not.
    """
    return view.study.fatigue if view.study_path else of_text(view.store.study_text, str(view.path))


def only(values: FloatArray) -> float:
    """Value of the nominal joint; NaN if there is none."""
    return float(values[0]) if values.size else np.nan


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
    view: View,
    joints: Joints,
    signals: Sequence[Signal],
    chosen: NDArray[np.bool_],
    kept: int = histories.KEPT,
) -> Counted:
    """Count the cycles of joints at each operating point, between them, and of starts.

    Parameters
    ----------
    view : View
        The campaign.
    joints : Joints
        Its first n samples.
    signals : sequence of Signal
        What cycles are counted of. Where a file does not hold it, the joints are simulated again.
    chosen : ndarray of bool, shape (n,)
        Samples that are evaluated; the others have NaN.
    kept : int
        Maximum number of cycles of a signal at an operating point, the largest ones.
    """
    both = int(all((part.nominal["status"] == Status.OK).any() for part in view.parts))
    rows = np.append(np.zeros(both, np.intp), 1 + np.flatnonzero(chosen))
    parts, apart = list[Cycles](), 0.0
    for at in view.parts:
        slots = np.append(at.nominal_slots[:both], at.slots(rows[both:] - 1))
        part, difference = of_slots(at.store, slots, signals, kept)
        parts.append(part.spread(rows, 1 + joints.status.size))
        apart = max(apart, difference)
    low, high = (np.stack([getattr(part, end) for part in parts], axis=2) for end in ("low", "high"))
    whole = cycles.duty_cycle(parts, [share for _, share in joints.duty], joints.transitions(low, high))
    whole = whole.with_starts(joints.settings.starts / joints.settings.revolutions)
    return Counted(**vars(joints), cycles=whole.rows(slice(1, None)), nominal=whole.rows(slice(both)), apart=apart)


def held(store: reader.Reader, signals: Sequence[Signal]) -> bool:
    """Whether a file holds cycles of these signals, or the loads that they are counted from."""
    of_loads = tuple(load_histories(store.mechanism).values())
    return revolutions.held(store, of_loads) != "" or all(_is_stored(store, signal) for signal in signals)


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
    return signal.name in components(store.mechanism) and f"{signal.history.prefix}cycles" in store.history_specs


def _stored(
    store: reader.Reader, slots: NDArray[np.intp], signals: Sequence[Signal]
) -> tuple[NDArray[np.floating], FloatArray]:
    """Cycles that workers stored, (m, signals, k, 2), and their numbers, (m, signals)."""
    tables, numbers, found = [], [], load_histories(store.mechanism).values()
    for history in found:
        of_history = [name for name, signal in components(store.mechanism).items() if signal.history == history]
        columns = [of_history.index(signal.name) for signal in signals if signal.history == history]
        if columns:
            tables.append(store.histories(f"{history.prefix}cycles", slots)[:, columns])
            numbers.append(store.histories(f"{history.prefix}cycle_count", slots)[:, columns])
    order = np.argsort([i for h in found for i, signal in enumerate(signals) if signal.history == h])
    table, number = (np.concatenate(each, axis=1)[:, order] for each in (tables, numbers))
    return table[:, :, : max(1, int(number.max(initial=0)))], number.astype(float)


def _counted(
    store: reader.Reader, slots: NDArray[np.intp], signals: tuple[Signal, ...], kept: int
) -> tuple[tuple[NDArray[np.floating], FloatArray], float]:
    """Cycles as in `_stored`, counted from loads that the file holds or from joints simulated again."""
    found = load_histories(store.mechanism)
    used = [h for h in found.values() if h.name == BUSHING_LOADS or any(s.history == h for s in signals)]
    tables, numbers, apart = list[FloatArray](), list[FloatArray](), 0.0
    for _, loads, difference in revolutions.of_components(store, slots, used):
        apart = max(apart, difference)
        for joint in range(len(loads[BUSHING_LOADS])):
            own = {name: values[joint] for name, values in loads.items()}
            ranges, means, number = histories.count(own, signals, kept, store.mechanism)
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
