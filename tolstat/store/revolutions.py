"""Loads of joints over the input angle, from the histories of a result file or by simulating the joints again."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.aside import Aside
from tolstat.common.errors import Fault, StoreError
from tolstat.common.load_kinds import BUSHINGS, COMPONENTS, FOLLOWED
from tolstat.common.shown import shown
from tolstat.common.tables import Options
from tolstat.joint import perturb
from tolstat.solver.compilation import is_compiled, warm_up
from tolstat.solver.simulation import restore, simulate_rows
from tolstat.store.recorded import joint_of, options_of, parameters
from tolstat.store.result_file import RUN_AGAIN, pick

if TYPE_CHECKING:
    from tolstat.store.reader import Reader

AGAIN = "simulated again"
ANGLES = 60
"""Default number of input angles per revolution to read, if the histories have as many samples."""
JOINTS_PER_BLOCK = 256
"""Maximum number of joints whose loads are read at a time: 9 MB at 180 samples per revolution."""
LARGEST = [f"{kind.key}_max" for kind in FOLLOWED]
"""Fields of the results that joints simulated again are compared in."""

FloatArray = NDArray[np.float64]
Again = tuple[NDArray[np.float32], FloatArray]
"""Loads of joints, (m, samples, 8, 6), and the largest relative difference of each from the stored values, (m,)."""


@shown
class Revolutions(NamedTuple):
    """Bushing loads of some joints over the last revolution.

    Attributes
    ----------
    angles : ndarray, shape (k,)
        Input angles, rad.
    loads : ndarray, shape (m, k, 8, 6)
        Components of force (N) and torque (N m) as `load_kinds.Channel.of` takes them; NaN for joints without results.
    origin : str
        Source of the loads: ``"stored"``, ``"harmonics"`` or ``"simulated again"``.
    apart : float
        For joints simulated again, the largest relative difference of a largest load from the stored value: 0 on the
        machine and with the versions that made the file. 0 for loads from histories.
    """

    angles: FloatArray
    loads: NDArray[Any]
    origin: str
    apart: float


def held(store: Reader) -> str:
    """Kind of histories that a file holds, ``"stored"`` or ``"harmonics"``; empty if it holds no loads."""
    return (
        "stored"
        if "loads" in store.history_specs
        else "harmonics"
        if "coefficients_real" in store.history_specs
        else ""
    )


def blocks(n: int) -> Iterator[slice]:
    """Yield consecutive parts of `n` joints, each of at most `JOINTS_PER_BLOCK`, to read their loads part by part."""
    for first in range(0, n, JOINTS_PER_BLOCK):
        yield slice(first, min(first + JOINTS_PER_BLOCK, n))


def read(store: Reader, slots: NDArray[np.intp], max_angles: int = ANGLES) -> Revolutions:
    """Return the loads of joints over the input angle.

    Parameters
    ----------
    store : Reader
        A campaign whose joints are drawn from tolerances.
    slots : ndarray of int, shape (m,)
        File slots, ascending; none pending.
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
    origin = held(store) or AGAIN
    steps = int(store.options["steps_per_rev"])
    every = max(1, steps // max_angles)
    angles = 2.0 * np.pi * np.arange(0, steps, every) / steps
    loads = np.empty((len(slots), angles.size, len(BUSHINGS), len(COMPONENTS)))
    apart = 0.0
    for part, found, difference in of_components(store, slots):
        apart = max(apart, difference)
        loads[part] = found[:, ::every]
    return Revolutions(angles, loads, origin, apart)


def of_components(store: Reader, slots: NDArray[np.intp]) -> Iterator[tuple[slice, NDArray[Any], float]]:
    """Yield the bushing loads of joints part by part: the part of `slots`, its `loads`, and `Revolutions.apart`.

    Arguments and exceptions as in `read`; joints are simulated again where the file holds no loads.
    """
    again = not held(store)
    if again and len(slots) and store.ahead is None:
        warm_up()
    for part in blocks(len(slots)):
        if again:
            yield part, *_again(store, slots[part])
        else:
            yield part, loads(store, slots[part]), 0.0


def loads(store: Reader, slots: NDArray[np.intp]) -> NDArray[Any]:
    """Bushing loads of joints over a revolution.

    Parameters
    ----------
    store : Reader
        The campaign.
    slots : ndarray of int, shape (m,)
        File slots.

    Returns
    -------
    ndarray, shape (m, samples, 8, 6)
        Force and torque of each bushing along e, t, z, N and N m, from full histories or restored from harmonics.

    Raises
    ------
    StoreError
        When the file holds neither.
    """
    if "loads" in store.history_specs:
        return store.histories("loads", slots)
    if "coefficients_real" not in store.history_specs:
        remedy = f'write histories = "harmonics" or "full" in [output] of the study, and {RUN_AGAIN}'
        raise StoreError(str(Fault(str(store.path), "holds no load histories", remedy)))
    real, imag = (store.histories(f"coefficients_{part}", slots) for part in ("real", "imag"))
    return np.moveaxis(restore(real, imag, int(store.options["steps_per_rev"])), 0, 1)


def on_shafts(store: Reader, slots: NDArray[np.intp]) -> tuple[list[FloatArray], str, float]:
    """Return the loads on the shafts of a few joints of any campaign over the input angle.

    Parameters
    ----------
    store : Reader
        A result file, at one operating point.
    slots : ndarray of int, shape (m,)
        File slots; none pending. Without full histories each is simulated again, one after the other.

    Returns
    -------
    loads : list of ndarray, shape (k, 2, 6)
        Of each joint force (N) and moment about O (N m) on input and output shaft, components
        `load_kinds.SHAFT_COMPONENTS`, in axes that do not turn, at k equally spaced input angles from zero.
    origin : str
    apart : float
        As in `Revolutions`.

    Raises
    ------
    InputError
        When a joint has to be simulated again and this version cannot read the file's joint or options.
    """
    if "shafts" in store.history_specs:
        return list(store.histories("shafts", slots).astype(float)), "stored", 0.0
    if len(slots):
        warm_up()
    loads, apart = [], 0.0
    for i, slot in enumerate(slots.tolist()):
        found = simulate_rows(parameters(store, slots[i : i + 1]), options_of(store, slot), "full")
        loads.append(found.histories["shafts"][0].astype(float))
        apart = max(apart, float(_apart(found.results, store.results(slice(slot, slot + 1)))[0]))
    return loads, AGAIN, apart


class Ahead(NamedTuple):
    """Joints that are simulated again before anyone asks for them, and once for all who do.

    Attributes
    ----------
    slots : ndarray, shape (m,)
        File slots, ascending.
    parts : list of Aside
        Simulations of `blocks` of them, every other one in the same process if these are two.
    """

    slots: NDArray[np.intp]
    parts: list[Aside[list[Again]]]

    def of(self, slots: NDArray[np.intp]) -> Again | None:
        """Loads of some of the joints; None unless all are among them."""
        place = np.searchsorted(self.slots, slots)
        if not np.array_equal(self.slots[np.minimum(place, len(self.slots) - 1)], slots):
            return None
        found = [part.result() for part in self.parts]
        pieces = [found[i % len(found)][i // len(found)] for i in range(sum(map(len, found)))]
        block, own = np.divmod(place, JOINTS_PER_BLOCK)
        loads = np.stack([pieces[b][0][k] for b, k in zip(block, own, strict=True)])
        return loads, np.array([pieces[b][1][k] for b, k in zip(block, own, strict=True)])


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
    if processes > 1 and not is_compiled():
        warm_up()  # one process compiles
    parts = [slots[part] for part in blocks(len(slots))]
    number = min(max(1, processes - 1), len(parts))
    store.ahead = Ahead(
        slots, [Aside(partial(_all, store, parts[first::number]), processes > 1) for first in range(number)]
    )


def _all(store: Reader, parts: list[NDArray[np.intp]]) -> list[Again]:
    return [_simulated(store, part) for part in parts]


def _again(store: Reader, slots: NDArray[np.intp]) -> tuple[NDArray[np.float32], float]:
    """Loads of joints that are simulated again, (m, samples, 8, 6), and `Revolutions.apart`."""
    found = None if store.ahead is None else store.ahead.of(slots)
    loads, off = found or _simulated(store, slots)
    return loads, float(np.max(off, initial=0.0))


def _simulated(store: Reader, slots: NDArray[np.intp]) -> Again:
    """Read from the file what it takes to simulate joints again, and do so."""
    params = perturb(joint_of(store, int(slots[0])), store.operation, pick(store.errors, slots))
    attempts = pick(store.attempt, slots)
    stored = pick(store.results, slots)[LARGEST].copy()
    settings = [(here, options_of(store, int(slots[here[0]]))) for here in _alike(attempts)]
    return _simulate(params, settings, stored, int(store.options["steps_per_rev"]))


def _alike(attempts: NDArray[np.int32]) -> list[NDArray[np.intp]]:
    return [np.flatnonzero(attempts == attempt) for attempt in np.unique(attempts)]


def _simulate(
    params: NDArray[np.void], settings: list[tuple[NDArray[np.intp], Options]], stored: NDArray[np.void], steps: int
) -> Again:
    loads, apart = np.empty((len(params), steps, 8, 6), np.float32), np.zeros(len(params))
    for here, options in settings:
        found = simulate_rows(params[here], options, "full")
        samples = found.histories["loads"]
        loads[here] = samples[:, :: max(1, samples.shape[1] // steps)]
        apart[here] = _apart(found.results, stored[here])
    return loads, apart


def _apart(now: NDArray[np.void], stored: NDArray[np.void]) -> FloatArray:
    """Largest relative difference of the fields `LARGEST` from the stored values of each joint, (m,)."""
    apart = np.zeros(len(stored))
    for name in LARGEST:
        with np.errstate(invalid="ignore", divide="ignore"):
            off = np.abs(now[name] / stored[name] - 1.0)
        apart = np.maximum(apart, off.max(axis=1, initial=0.0, where=np.isfinite(off)))
    return apart
