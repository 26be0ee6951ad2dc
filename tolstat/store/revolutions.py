"""Loads of joints over the input angle, from the histories of a result file or by simulating the joints again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import Fault, StoreError
from tolstat.joint import perturb
from tolstat.solver.simulation import restore, simulate_rows, warm_up
from tolstat.store import ResultStore
from tolstat.store.recorded import joint_of, options_of
from tolstat.store.result_file import RUN_AGAIN

AGAIN = "simulated again"
ANGLES = 60
"""Default number of input angles per revolution to read, if the histories have as many samples."""
JOINTS_PER_BLOCK = 64
"""Joints whose histories are in memory at a time."""

JOINTS_PER_READ = 256
"""Largest number of joints whose loads a caller should read at a time: 9 MB at 180 samples a revolution."""

FloatArray = NDArray[np.float64]


class Revolutions(NamedTuple):
    """Moduli of the bushing loads of some joints over the last revolution.

    Attributes
    ----------
    rows : ndarray of int, shape (m,)
        File slots.
    angles : ndarray, shape (k,)
        Input angles, rad.
    F, T : ndarray, shape (m, k, 8)
        Moduli of force (N) and torque (N m), in the order of `tables.BUSHINGS`; NaN for joints without results.
    origin : str
        Source of the loads: ``"stored"``, ``"harmonics"`` or ``"simulated again"``.
    apart : float
        For joints simulated again, the largest relative difference of a largest load from the stored value: 0 on the
        machine and with the versions that made the file. 0 for loads from histories.
    """

    rows: NDArray[np.intp]
    angles: FloatArray
    F: FloatArray
    T: FloatArray
    origin: str
    apart: float


def held(store: ResultStore) -> str:
    """Kind of histories that a file holds, ``"stored"`` or ``"harmonics"``; empty if it holds no loads."""
    return (
        "stored"
        if "loads" in store.history_specs
        else "harmonics"
        if "coefficients_real" in store.history_specs
        else ""
    )


def read(store: ResultStore, rows: NDArray[np.intp], max_angles: int = ANGLES) -> Revolutions:
    """Return the loads of joints over the input angle.

    Parameters
    ----------
    store : ResultStore
        A campaign whose joints are drawn from tolerances.
    rows : ndarray of int, shape (m,)
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
    moduli = np.empty((2, len(rows), angles.size, 8))
    apart = 0.0
    if origin == AGAIN and len(rows):
        warm_up()
    for first in range(0, len(rows), JOINTS_PER_BLOCK):
        some = rows[first : first + JOINTS_PER_BLOCK]
        if origin == AGAIN:
            found, difference = _again(store, some)
            apart = max(apart, difference)
        else:
            found = loads(store, some)
        kept = found[:, ::every].astype(float)
        for k in (0, 1):
            moduli[k, first : first + len(some)] = np.linalg.norm(kept[..., 3 * k : 3 * k + 3], axis=-1)
    return Revolutions(rows, angles, moduli[0], moduli[1], origin, apart)


def loads(store: ResultStore, rows: NDArray[np.intp]) -> NDArray[Any]:
    """Bushing loads of joints over a revolution.

    Parameters
    ----------
    store : ResultStore
        The campaign.
    rows : ndarray of int, shape (m,)
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
        return store.histories("loads", rows)
    if "coefficients_real" not in store.history_specs:
        remedy = f'write histories = "harmonics" or "full" in [output] of the study, and {RUN_AGAIN}'
        raise StoreError(str(Fault(str(store.path), "holds no load histories", remedy)))
    real, imag = (store.histories(f"coefficients_{part}", rows) for part in ("real", "imag"))
    return np.moveaxis(restore(real, imag, int(store.options["steps_per_rev"])), 0, 1)


def _again(store: ResultStore, rows: NDArray[np.intp]) -> tuple[NDArray[np.float32], float]:
    """Simulate joints again: their loads, (m, samples, 8, 6), and `Revolutions.apart`."""
    params = perturb(joint_of(store, int(rows[0])), _pick(store.errors, rows))
    attempts = _pick(store.attempt, rows)
    stored = _pick(store.results, rows)
    loads = np.empty((len(rows), int(store.options["steps_per_rev"]), 8, 6), np.float32)
    apart = 0.0
    for attempt in np.unique(attempts):
        here = np.flatnonzero(attempts == attempt)
        found = simulate_rows(params[here], options_of(store, int(rows[here[0]])), "full")
        samples = found.histories["loads"]
        loads[here] = samples[:, :: max(1, samples.shape[1] // loads.shape[1])]
        for name in ("F_max", "T_max"):
            with np.errstate(invalid="ignore", divide="ignore"):
                off = np.abs(found.results[name] / stored[name][here] - 1.0)
            apart = max(apart, float(np.max(off, initial=0.0, where=np.isfinite(off))))
    return loads, apart


def _pick(read: Callable[[slice], NDArray[Any]], rows: NDArray[np.intp]) -> NDArray[Any]:
    """Read `rows` of a table that is read by slices; as one slice if they lie close together."""
    first, last = int(rows[0]), int(rows[-1]) + 1
    if last - first <= 8 * len(rows):
        return read(slice(first, last))[rows - first]
    return np.concatenate([read(slice(row, row + 1)) for row in rows.tolist()])
