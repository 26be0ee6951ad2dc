"""The group ``verify`` of a result file: joints simulated again with other settings or another solver."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common import selected_results, tables
from tolstat.common.columns import Column
from tolstat.common.shown import shown
from tolstat.store import metadata
from tolstat.store.checks import DAMAGE_ERRORS
from tolstat.store.integrity import seal_values, sealed_values
from tolstat.store.new_file import create_table
from tolstat.store.result_file import pick, put_attributes, store_error, text

if TYPE_CHECKING:
    from tolstat.store.reader import Reader
    from tolstat.store.result_store import ResultStore

VERIFY, NEAR = "verify", "near"
"""Groups of joints: chosen at random, and those nearest to limits."""


@shown
class Check(NamedTuple):
    """Results of the joints with other settings or another solver.

    Attributes
    ----------
    description : str
        What differs from the campaign, in words.
    options : dict
        Solver options that were used; those of the first joint, if joints differ.
    results : ndarray of RESULT, shape (m,)
        Results of the joints.
    """

    description: str
    options: dict[str, Any]
    results: NDArray[np.void]


@shown
class Verification(NamedTuple):
    """Some joints of a campaign: their results in the campaign and in each check.

    Attributes
    ----------
    seed : int
        Seed of the random choice of the joints.
    rows : ndarray, shape (m,)
        Rows of the joints in the campaign, ascending.
    base : ndarray of RESULT, shape (m,)
        Their results in the campaign.
    checks : dict of str to Check
        By name: ``half_step``, ``newton``, ``settling``, ``method``, ``reference``, ``fidelity``.
    """

    seed: int
    rows: NDArray[np.intp]
    base: NDArray[np.void]
    checks: dict[str, Check]


def read(store: Reader, name: str = VERIFY) -> Verification | None:
    """Read the verification of a group from a result file; None if it holds none."""
    held = store._held()
    if name not in held:
        return None
    try:
        rows, checks = _read(held[name], store)
        seed = int(held[name].attrs["seed"])
    except DAMAGE_ERRORS as error:
        found = f"is damaged: its verification cannot be used: {error}"
        again = f"tolstat verify {store.path}" + (" --near LIMIT" if name == NEAR else "")
        raise store_error(store.path, found, f"make it anew: {again}") from error
    return Verification(seed, rows, pick(store.results, np.asarray(store.slot(rows))), checks)


def _read(group: h5py.Group, store: Reader) -> tuple[NDArray[np.intp], dict[str, Check]]:
    values = sealed_values(group)
    if not values:
        raise ValueError("its values do not match their checksum")
    rows = np.asarray(values["/rows"], np.intp)
    if rows.ndim != 1 or not len(rows) <= store.n:
        raise ValueError(f"its rows have the shape {rows.shape}")
    if np.any(np.diff(rows) <= 0) or not np.isin(rows[[0, -1]] if len(rows) else rows, store.rows).all():
        raise ValueError("its rows are no ascending rows of the campaign")
    checks = {}
    for check in text(group.attrs, "checks").split():
        table = np.empty(len(rows), tables.RESULT)
        selected_results.blank_others(table, store.columns)
        for c in store.columns:
            held = values[f"/{check}/{c.name}"]
            if held.shape != rows.shape or held.dtype != np.dtype(c.dtype):
                raise ValueError(f"{check}/{c.name} is {held.shape} of {held.dtype}")
            c.of(table)[:] = held
        if table["status"].size and table["status"].max() > max(tables.Status):
            raise ValueError(f"{check} has an unknown status")
        options = metadata.read(group[check], "options", {})
        checks[check] = Check(text(group[check].attrs, "description"), options, table)
    return rows, checks


def write(store: ResultStore, verification: Verification, name: str = VERIFY) -> None:
    """Write a verification to a group of a result file, replacing an earlier one; otherwise as `write_all`."""
    write_all([(store, verification)], name)


def write_all(found: Sequence[tuple[ResultStore, Verification]], name: str = VERIFY) -> None:
    """Write verifications at operating points of one file, replacing earlier ones; the file is replaced once for all.

    Raises
    ------
    StoreError
        When there is no room for a second copy of the file.
    """
    places = [(store._held().name, verification) for store, verification in found]
    store = found[0][0]

    def change(file: h5py.File) -> None:
        for where, verification in places:
            _write(file[where], name, verification, store.columns)

    store._replace(change)


def _write(holder: h5py.Group, place: str, verification: Verification, columns: tuple[Column, ...]) -> None:
    if place in holder:
        del holder[place]
    group = holder.create_group(place)
    about = "joints of the campaign simulated again in other ways, to know its numerical error"
    names = " ".join(verification.checks)
    put_attributes(group, {"description": about, "seed": verification.seed, "checks": names})
    rows = group.create_dataset("rows", data=verification.rows.astype("i8"))
    rows.make_scale("rows")
    put_attributes(rows, {"units": "1", "description": "rows of the joints in the campaign, counted from 0"})
    for name, check in verification.checks.items():
        create_table(group, name, columns, len(rows), [check.results], scale=rows)
        put_attributes(
            group[name], {"description": check.description, "options": json.dumps(check.options, allow_nan=False)}
        )
    seal_values(group)
