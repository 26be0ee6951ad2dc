"""The group ``verify`` of a result file: joints simulated again with other settings or another solver."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import Column, blank_others
from tolstat.common.tables import tables
from tolstat.store import layout
from tolstat.store.hdf5 import pick, put_attributes, put_scale, text, told_as_damage
from tolstat.store.metadata import CHECKSUM
from tolstat.store.reader import Reader
from tolstat.store.writer import Writer

VERIFY, NEAR = "verify", "near"
"""Groups of joints: chosen at random, and those nearest to limits."""


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
        By name: ``finer``, or ``half_step``, ``newton``, ``settling``, ``method``, ``reference``; and ``fidelity``.
    """

    seed: int
    rows: NDArray[np.intp]
    base: NDArray[np.void]
    checks: dict[str, Check]

    def only(self, here: NDArray[Any]) -> Verification:
        """Some of the joints: by a mask, (m,), or by indices in their order."""
        checks = {name: check._replace(results=check.results[here]) for name, check in self.checks.items()}
        return self._replace(rows=self.rows[here], base=self.base[here], checks=checks)


def read(store: Reader, name: str = VERIFY) -> Verification | None:
    """Read the verification of a group from a result file; None if it holds none."""
    group = store.group(name)
    if group is None:
        return None
    again = f"tolstat verify {store.path}" + (" --near LIMIT" if name == NEAR else "")
    with told_as_damage(store.path, "is damaged: its verification cannot be used", f"make it anew: {again}"):
        rows, seed, stored = np.asarray(group["rows"][:], np.intp), int(group.attrs["seed"]), dict[str, _Stored]()
        for check in text(group.attrs, "checks").split():
            attrs = group[check].attrs
            stored[check] = _Stored(text(attrs, "description"), text(attrs, "options"), group[check][:])
        if text(group.attrs, CHECKSUM) != _checksum(seed, rows, stored):
            raise ValueError("its values do not match their checksum")
        checks = {check: held.check(store) for check, held in stored.items()}
        return Verification(seed, rows, pick(store.results, np.asarray(store.slot(rows))), checks)


def read_each(stores: Sequence[Reader], name: str) -> list[Verification]:
    """Verifications of a group at those of the operating points that have one."""
    return [found for store in stores if (found := read(store, name)) is not None]


class _Stored(NamedTuple):
    """A check as the file has it: options as JSON, and the columns kept as floats, (m, columns)."""

    description: str
    options: str
    values: NDArray[np.float64]

    def check(self, store: Reader) -> Check:
        results = np.empty(len(self.values), tables(store.mechanism).RESULT)
        blank_others(results, store.columns, store.mechanism)
        for column, values in zip(store.columns, self.values.T, strict=True):
            column.of(results)[:] = values
        return Check(self.description, json.loads(self.options), results)


def _stored(check: Check, columns: Sequence[Column]) -> _Stored:
    values = np.column_stack([column.of(check.results).astype("f8") for column in columns])
    return _Stored(check.description, json.dumps(check.options, allow_nan=False), values)


def _checksum(seed: int, rows: NDArray[np.intp], stored: dict[str, _Stored]) -> str:
    """SHA-256 of the rows of a verification and of its checks, names and descriptions included."""
    digest = hashlib.sha256(rows.astype("i8").tobytes())
    digest.update(f"{seed} {' '.join(stored)}".encode())
    for name, check in stored.items():
        digest.update(f"{name} {check.description} {check.options}".encode() + check.values.tobytes())
    return digest.hexdigest()


def together(parts: Sequence[Verification]) -> Verification:
    """Verifications as one, joints one after the other, with the checks that all of them have."""
    first = parts[0]
    checks = {
        name: check._replace(results=np.concatenate([part.checks[name].results for part in parts]))
        for name, check in first.checks.items()
        if all(name in part.checks for part in parts)
    }
    rows, base = np.concatenate([part.rows for part in parts]), np.concatenate([part.base for part in parts])
    return Verification(first.seed, rows, base, checks)


def write(parts: Sequence[tuple[Writer, str, Verification]]) -> None:
    """Write groups of verifications at operating points of one file, replacing earlier ones; the file is replaced once.

    Raises
    ------
    StoreError
        When there is no room for a second copy of the file.
    """

    def change(file: h5py.File) -> None:
        for store, name, verification in parts:
            holder = file[layout.place_of(store.point or "") or "/"]
            if name in holder:
                del holder[name]
            group = holder.create_group(name)
            about = "joints of the campaign simulated again in other ways, to know its numerical error"
            checks = " ".join(verification.checks)
            put_attributes(group, {"description": about, "seed": verification.seed, "checks": checks})
            about = "rows of the joints in the campaign, counted from 0"
            axes = [put_scale(group, "rows", verification.rows.astype("i8"), "1", about)]
            names = np.array([column.name for column in store.columns], dtype=object)
            axes.append(put_scale(group, "column", names, "1", "columns of the results"))
            stored = {check: _stored(made, store.columns) for check, made in verification.checks.items()}
            for check, held in stored.items():
                dataset = group.create_dataset(check, data=held.values)
                for axis, scale in zip(dataset.dims, axes, strict=True):
                    axis.attach_scale(scale)
                put_attributes(dataset, {"description": held.description, "options": held.options})
            put_attributes(group, {CHECKSUM: _checksum(verification.seed, verification.rows, stored)})

    parts[0][0].replace(change)
