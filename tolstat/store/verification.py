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
        rows = np.asarray(group["rows"][:], np.intp)
        checks = {}
        for check in text(group.attrs, "checks").split():
            table = np.empty(len(rows), tables(store.mechanism).RESULT)
            blank_others(table, store.columns, store.mechanism)
            for c in store.columns:
                c.of(table)[:] = group[check][c.name][:]
            attrs = group[check].attrs
            checks[check] = Check(text(attrs, "description"), json.loads(text(attrs, "options")), table)
        seed = int(group.attrs["seed"])
        if text(group.attrs, CHECKSUM) != _checksum(seed, rows, checks, store.columns):
            raise ValueError("its values do not match their checksum")
        return Verification(seed, rows, pick(store.results, np.asarray(store.slot(rows))), checks)


def read_each(stores: Sequence[Reader], name: str) -> list[Verification]:
    """Verifications of a group at those of the operating points that have one."""
    return [found for store in stores if (found := read(store, name)) is not None]


def _checksum(seed: int, rows: NDArray[np.intp], checks: dict[str, Check], columns: Sequence[Column]) -> str:
    """SHA-256 of the rows of a verification and of the results of its checks, names and descriptions included."""
    digest = hashlib.sha256(rows.astype("i8").tobytes())
    digest.update(f"{seed} {' '.join(checks)}".encode())
    for name, check in checks.items():
        digest.update(f"{name} {check.description} {json.dumps(check.options, allow_nan=False)}".encode())
        for c in columns:
            digest.update(c.name.encode() + c.of(check.results).astype(c.dtype).tobytes())
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
            rows = put_scale(group, "rows", verification.rows.astype("i8"), "1", about)
            for check_name, check in verification.checks.items():
                layout.create_table(group, check_name, store.columns, len(rows), [check.results], scale=rows)
                options = json.dumps(check.options, allow_nan=False)
                put_attributes(group[check_name], {"description": check.description, "options": options})
            checksum = _checksum(verification.seed, verification.rows, verification.checks, store.columns)
            put_attributes(group, {CHECKSUM: checksum})

    parts[0][0].replace(change)
