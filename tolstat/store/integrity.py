"""Checksums that detect rows and attributes that changed after they were written: by accident, not by intent.

Each row has three checksums in the group ``ledger``, of its errors, of its attempt and of its results; each history has
one checksum per row, the values of a verification have one, and all attributes of the file together have one. The row
number enters the checksum of the errors, which in turn enters those of the attempt and of the results, so that swapped
or mixed rows are detected.

The hash of the rows is updated column by column on whole arrays: state = (state xor word) * odd number, then xor with
its upper half. Each update is invertible for a given word, so that a change of a single number is always detected; any
other change goes undetected with a probability of 2^-64. The CRC-32 of zlib would need contiguous bytes of each row,
but tables are stored by column.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import ERROR_COLUMNS, Column
from tolstat.store import layout

Hash = NDArray[np.uint64]
Described = tuple[tuple[Column, ...], NDArray[np.void]]
"""Columns of a table, and the table."""

FACTOR = np.uint64(0x9E3779B97F4A7C15)
"""2^64 divided by the golden ratio, odd (Knuth 1998, The Art of Computer Programming 3, 6.4)."""
HALF = np.uint64(32)
DIGEST = "digest"
"""Name of the attribute that holds the checksum of the others."""


def errors_hash(first_row: int, errors: NDArray[np.void], described: Sequence[Described] = ()) -> Hash:
    """Checksum of each row's number, errors and further descriptions, (m,).

    Parameters
    ----------
    first_row : int
        Row of the campaign of the first entry.
    errors : (m,) table ERROR
        Errors.
    described : sequence of (columns, (m,) table)
        Further tables that describe each joint, see `result_file.descriptions`.
    """
    state = np.arange(first_row + 1, first_row + 1 + len(errors), dtype=np.uint64)
    for columns, table in described:
        _fold(state, columns, table)
    _fold(state, ERROR_COLUMNS, errors)
    return state


def results_hash(
    errors_check: Hash, attempt: NDArray[np.int32], results: NDArray[np.void], columns: tuple[Column, ...]
) -> Hash:
    """Checksum of the results of each row, (m,).

    Parameters
    ----------
    errors_check : (m,) array
        Checksum of the errors of each row.
    attempt : (m,) array
        Number of the attempt that gave the results.
    results : (m,) table RESULT
        Results, status included.
    columns : tuple of Column
        Columns of the results that are kept.
    """
    state = attempt_hash(errors_check, attempt)
    _fold(state, columns, results)
    return state


def attempt_hash(errors_check: Hash, attempt: NDArray[np.int32]) -> Hash:
    """Checksum of the attempt of each row, (m,), from the checksum of its errors: pending rows have it, too."""
    state = errors_check ^ attempt.astype(np.uint64)
    _mix(state)
    return state


def history_checks(history: NDArray[Any], rows: NDArray[np.intp]) -> NDArray[np.uint32]:
    """CRC-32 of each joint's history of one kind, (m,); `rows` are rows of the campaign."""
    joints = np.ascontiguousarray(history)
    checks = (zlib.crc32(joints[i], int(row) & 0xFFFFFFFF) for i, row in enumerate(rows))
    return np.fromiter(checks, np.uint32, len(rows))


def seal(file: h5py.File) -> None:
    """Write the checksum of all attributes of a file; call this after every change of an attribute."""
    file.attrs[DIGEST] = np.bytes_(_digest(layout.values(file)))


def is_sealed(file: h5py.File, values: list[tuple[str, str, str]]) -> bool:
    """Whether the attributes of a file, as `layout.check` finds them, match their checksum."""
    return _read(file) == _digest(values)


def seal_values(group: h5py.Group) -> None:
    """Write the checksum of the values of all datasets in a group that is never written to again, as attribute."""
    group.attrs[DIGEST] = np.bytes_(_digest_of_values(group)[0])


def sealed_values(group: h5py.Group) -> dict[str, NDArray[Any]]:
    """Values of the datasets in a group by path, such as ``/rows``; none if they do not match their checksum."""
    digest, values = _digest_of_values(group)
    return values if _read(group) == digest else {}


def _read(holder: h5py.Group) -> str:
    value = holder.attrs.get(DIGEST, b"")
    return value.decode("ascii", "replace") if isinstance(value, bytes) else str(value)


def _digest(values: list[tuple[str, str, str]]) -> str:
    held = [one for one in values if one[:2] != ("/", DIGEST)]
    return hashlib.sha256(json.dumps(held).encode()).hexdigest()


def _digest_of_values(group: h5py.Group) -> tuple[str, dict[str, NDArray[Any]]]:
    """Checksum and values of all datasets in a group; read by HDF5 itself, since h5py takes ten times as long."""
    digest, values = hashlib.sha256(), {}
    for path, held in layout.objects(group):
        if isinstance(held, h5py.h5d.DatasetID):
            values[path] = own = np.empty(held.shape, held.dtype)
            if own.size:
                held.read(h5py.h5s.ALL, h5py.h5s.ALL, own)
            digest.update(f"{path} {own.dtype.str} {own.shape}".encode())
            digest.update(own.tobytes())
    return digest.hexdigest(), values


def _fold(state: Hash, columns: tuple[Column, ...], table: NDArray[np.void]) -> None:
    for column in columns:
        values = np.ascontiguousarray(column.of(table))
        state ^= values.view(np.uint64) if values.dtype == np.float64 else values.astype(np.uint64)
        _mix(state)


def _mix(state: Hash) -> None:
    state *= FACTOR
    state ^= state >> HALF
