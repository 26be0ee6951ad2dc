"""Loads of joints over the input angle, from the histories of a result file or by simulating the joints again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.channels import BUSHING_LOADS, LoadHistory, channels, followed, histories_of, load_histories
from tolstat.common.cores import Forked, begun, in_order
from tolstat.common.loads import FloatArray
from tolstat.joint import perturb
from tolstat.solver.compilation import is_compiled, warm_up
from tolstat.solver.histories import restore
from tolstat.solver.simulation import simulate_rows
from tolstat.store.hdf5 import RUN_AGAIN, pick, store_error
from tolstat.store.reader import Reader
from tolstat.store.recorded import joint_of, operation_of, options_of

AGAIN = "simulated again"
ANGLES = 60
"""Default number of input angles per revolution to read, if the histories have as many samples."""
JOINTS_PER_BLOCK = 256
"""Maximum number of joints whose loads are read at a time: 9 MB at 180 samples per revolution."""

Loads = dict[str, NDArray[Any]]
"""Loads of m joints by name of `channels.load_histories`, (m, samples, places, components), N and N m."""
Again = tuple[Loads, FloatArray]
"""Loads of joints, and the largest relative difference of each joint's from the stored values, (m,)."""


class Revolutions(NamedTuple):
    """Loads of some joints over the last revolution.

    Attributes
    ----------
    angles : ndarray, shape (k,)
        Input angles, rad.
    loads : dict of str to ndarray, shape (m, k)
        Values of each channel, N or N m; NaN for joints without results.
    origin : str
        Source of the loads: ``"stored"``, ``"harmonics"`` or ``"simulated again"``.
    apart : float
        For joints simulated again, the largest relative difference of a largest load from the stored value: 0 on the
        machine and with the versions that made the file. 0 for loads from histories.
    """

    angles: FloatArray
    loads: dict[str, FloatArray]
    origin: str
    apart: float


def held(store: Reader, histories: Sequence[LoadHistory] = ()) -> str:
    """Kind of histories that a file holds of loads, ``"stored"`` or ``"harmonics"``; empty if it lacks any of them.

    Without `histories` those of the bushings.
    """
    histories = histories or (load_histories(store.mechanism)[BUSHING_LOADS],)
    if all(history.name in store.history_specs for history in histories):
        return "stored"
    if all(f"{history.prefix}coefficients_real" in store.history_specs for history in histories):
        return "harmonics"
    return ""


def blocks(n: int) -> Iterator[slice]:
    """Yield consecutive parts of `n` joints, each of at most `JOINTS_PER_BLOCK`, to read their loads part by part."""
    for first in range(0, n, JOINTS_PER_BLOCK):
        yield slice(first, min(first + JOINTS_PER_BLOCK, n))


def read(store: Reader, slots: NDArray[np.intp], names: Sequence[str], max_angles: int = ANGLES) -> Revolutions:
    """Return the loads of joints over the input angle.

    Parameters
    ----------
    store : Reader
        A result file, at one operating point.
    slots : ndarray of int, shape (m,)
        File slots, ascending; none pending. Of one variant: of a sweep one joint at a time.
    names : sequence of str
        Channels to return, keys of `channels.channels`.
    max_angles : int
        Approximate number of samples per revolution to keep; the samples are thinned evenly.

    Returns
    -------
    Revolutions

    Raises
    ------
    InputError
        When a joint has to be simulated again and this version cannot read the file's joint or options.
    """
    histories = histories_of(names, store.mechanism)
    origin = held(store, histories) or AGAIN
    steps = int(store.options["steps_per_rev"])
    every = max(1, steps // max_angles)
    angles = 2.0 * np.pi * np.arange(0, steps, every) / steps
    loads = {name: np.empty((len(slots), angles.size)) for name in names}
    apart = 0.0
    for part, histories_of_part, difference in of_components(store, slots, histories):
        apart = max(apart, difference)
        thinned = {name: values[:, ::every] for name, values in histories_of_part.items()}
        for name, values in loads.items():
            values[part] = channels(store.mechanism)[name].of(thinned)
    return Revolutions(angles, loads, origin, apart)


def of_components(
    store: Reader, slots: NDArray[np.intp], histories: Sequence[LoadHistory]
) -> Iterator[tuple[slice, Loads, float]]:
    """Yield the loads of joints part by part: the part of `slots`, its `loads`, and `Revolutions.apart`.

    Arguments and exceptions as in `read`; joints are simulated again where the file lacks any of the histories.
    """
    again = not held(store, histories)
    if again and len(slots) and store.ahead is None:
        warm_up(mechanism=store.mechanism)
    for part in blocks(len(slots)):
        if again:
            ready = None if store.ahead is None else store.ahead.of(slots[part])
            simulated, apart = ready or _simulated(store, slots[part])
            yield part, simulated, float(np.max(apart, initial=0.0))
        else:
            yield part, loads(store, slots[part], histories), 0.0


def loads(store: Reader, slots: NDArray[np.intp], histories: Sequence[LoadHistory]) -> Loads:
    """Loads of joints over a revolution.

    Parameters
    ----------
    store : Reader
        The campaign.
    slots : ndarray of int, shape (m,)
        File slots.
    histories : sequence of LoadHistory
        What to read: from full histories, or restored from harmonics.

    Raises
    ------
    StoreError
        When the file holds neither of any of them.
    """
    return {history.name: _loads(store, slots, history) for history in histories}


def _loads(store: Reader, slots: NDArray[np.intp], history: LoadHistory) -> NDArray[Any]:
    origin = held(store, [history])
    if origin == "stored":
        return store.histories(history.name, slots)
    if not origin:
        if held(store):
            found, remedy = f"holds no histories of {history.name}", RUN_AGAIN
        else:
            found = "holds no load histories"
            remedy = f'write histories = "harmonics" or "full" in [output] of the study, and {RUN_AGAIN}'
        raise store_error(store.path, found, remedy)
    real, imag = (store.histories(f"{history.prefix}coefficients_{part}", slots) for part in ("real", "imag"))
    return np.moveaxis(restore(real, imag, int(store.options["steps_per_rev"])), 0, 1)


class Ahead(NamedTuple):
    """Joints that are simulated again before anyone asks for them, and once for all who do.

    Attributes
    ----------
    slots : ndarray, shape (m,)
        File slots, ascending.
    parts : list of Forked
        Simulations of `blocks` of them.
    """

    slots: NDArray[np.intp]
    parts: list[Forked[list[Again]]]

    def of(self, slots: NDArray[np.intp]) -> Again | None:
        """Loads of some of the joints; None unless all are among them."""
        position = np.searchsorted(self.slots, slots)
        if not np.array_equal(self.slots[np.minimum(position, len(self.slots) - 1)], slots):
            return None
        pieces = in_order(self.parts)
        loads = {name: np.concatenate([piece[name] for piece, _ in pieces])[position] for name in pieces[0][0]}
        return loads, np.concatenate([apart for _, apart in pieces])[position]


def ahead(store: Reader, slots: NDArray[np.intp], processes: int) -> None:
    """Begin to simulate joints again, for all who ask `store` for their loads later.

    Parameters
    ----------
    store : Reader
        A campaign without load histories.
    slots : ndarray of int, shape (m,)
        File slots, ascending; none pending.
    processes : int
        Number of processes; with 1 the joints are simulated when they are asked for.
    """
    if processes > 1 and not is_compiled(mechanism=store.mechanism):
        warm_up(mechanism=store.mechanism)  # one process compiles
    each = [partial(_simulated, store, slots[part]) for part in blocks(len(slots))]
    store.ahead = Ahead(slots, begun(each, max(1, processes - 1), here=int(processes == 1)))


def _simulated(store: Reader, slots: NDArray[np.intp]) -> Again:
    """Simulate joints again with what the file holds of them, and compare with its results."""
    first, steps = int(slots[0]), int(store.options["steps_per_rev"])
    params = perturb(joint_of(store, first), operation_of(store, first), pick(store.errors, slots))
    histories = load_histories(store.mechanism).values()
    largest = [f"{kind.key}_max" for kind in followed(store.mechanism) if not kind.measure]
    attempts, stored = pick(store.attempt, slots), pick(store.results, slots)[largest].copy()
    loads = {h.name: np.empty((len(slots), steps, *h.shape), np.float32) for h in histories}
    apart = np.zeros(len(slots))
    for attempt in np.unique(attempts):
        here = np.flatnonzero(attempts == attempt)
        options = options_of(store, int(slots[here[0]]), int(attempt))
        again = simulate_rows(params[here], options, mechanism=store.mechanism, histories="full")
        for name, values in loads.items():
            samples = again.histories[name]
            values[here] = samples[:, np.arange(steps) * samples.shape[1] // steps]
        for name in largest:
            with np.errstate(invalid="ignore", divide="ignore"):
                off = np.abs(again.results[name] / stored[name][here] - 1.0)
            apart[here] = np.maximum(apart[here], off.max(axis=1, initial=0.0, where=np.isfinite(off)))
    return loads, apart
