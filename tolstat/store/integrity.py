"""Checksums that detect rows and attributes that changed after they were written.

Each row has two checksums in the group ``ledger``, one of its errors and one of its results; each history has one
checksum per row, and all attributes together have one. The row number enters the checksum of the errors, which in turn
enters the checksum of the results, so that swapped or mixed rows are detected.

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
    state = errors_check ^ attempt.astype(np.uint64)
    _mix(state)
    _fold(state, columns, results)
    return state


def history_checks(history: NDArray[Any], rows: NDArray[np.intp]) -> NDArray[np.uint32]:
    """CRC-32 of each joint's history of one kind, (m,); `rows` are rows of the campaign."""
    joints = np.ascontiguousarray(history)
    checks = (zlib.crc32(joints[i], int(row) & 0xFFFFFFFF) for i, row in enumerate(rows))
    return np.fromiter(checks, np.uint32, len(rows))


def seal(file: h5py.File) -> None:
    """Write the checksum of a file's attributes; call this after every change of an attribute."""
    file.attrs[DIGEST] = np.bytes_(_digest(file))


def is_sealed(file: h5py.File) -> bool:
    """Whether the attributes of a file match their checksum."""
    return _plain(file.attrs.get(DIGEST)) == _digest(file)


def _digest(file: h5py.File) -> str:
    held = {name: _plain(value) for name, value in file.attrs.items() if name != DIGEST}
    return hashlib.sha256(json.dumps(held, sort_keys=True).encode()).hexdigest()


def _plain(value: object) -> str:
    """Value of an attribute as text, independent of how HDF5 stores it."""
    if isinstance(value, bytes):
        return value.decode("utf-8")
    return value if isinstance(value, str) else repr(np.asarray(value).tolist())


def _fold(state: Hash, columns: tuple[Column, ...], table: NDArray[np.void]) -> None:
    for column in columns:
        values = np.ascontiguousarray(column.of(table))
        state ^= values.view(np.uint64) if values.dtype == np.float64 else values.astype(np.uint64)
        _mix(state)


def _mix(state: Hash) -> None:
    state *= FACTOR
    state ^= state >> HALF
