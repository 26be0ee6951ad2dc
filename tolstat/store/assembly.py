"""Make one result file from others: merge the files of slices, or add pending rows to a file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.tables import Status
from tolstat.store import layout
from tolstat.store.hdf5 import BLOCK
from tolstat.store.metadata import Metadata
from tolstat.store.reader import Reader
from tolstat.store.writer import write_new

OTHER_FILE = "give another file: --out OTHER.h5"
"""Remedy where a file exists already."""
COPY_BYTES = 1 << 25
"""Approximate number of bytes of a column that are copied at a time."""


class DifferingResults(Exception):
    """Two files hold different results for the same joint.

    Attributes
    ----------
    row : int
        Row of the campaign.
    column : str
        The first column that differs.
    """

    def __init__(self, row: int, column: str) -> None:
        self.row, self.column = row, column
        super().__init__(f"row {row}: {column} differs")


def assemble(
    path: Path,
    metadata: Metadata,
    sources: Sequence[Reader],
    errors: Iterable[NDArray[np.void]],
    design: NDArray[np.void] | None = None,
    origin: Iterable[NDArray[np.void]] | None = None,
    overwrite: bool = False,
) -> None:
    """Create the result file of a whole campaign from files that hold parts of its rows.

    Parameters
    ----------
    path : Path
        The file to create. It is written under a temporary name and renamed when complete.
    metadata : Metadata
        Metadata of the new file.
    sources : sequence of Reader
        Files with rows of the campaign; for a row in several files, a finished result takes precedence over pending.
    errors, design, origin
        Of all rows, see `layout.create`.
    overwrite : bool
        Whether to replace a file at `path`.

    Raises
    ------
    DifferingResults
        When two sources hold different results of one row.
    StoreError
        When `path` exists and must not be replaced, or cannot be written.
    """

    def copy_all(file: h5py.File) -> None:
        for source in (one for whole in sources for one in whole.each()):
            _copy(file, source)

    write_new(path, metadata, OTHER_FILE, errors, design, origin, copy_all, overwrite)


def _copy(file: h5py.File, source: Reader) -> None:
    """Copy finished joints, and compare the results of those that the file has already."""
    place = layout.place_of(source.point or "") or "/"
    for first in range(0, source.n, BLOCK):
        own = slice(first, min(first + BLOCK, source.n))
        there = slice(source.row(own.start), source.row(own.stop))
        done = source.status(own) != Status.PENDING
        held = file[place]["results/status"][there] != Status.PENDING
        for group, name in _columns(source):
            dataset = file[place][group][name]
            for part in _parts(own, dataset):
                here = slice(part.start - own.start, part.stop - own.start)
                target = slice(source.row(part.start), source.row(part.stop))
                values, before = source.column(group, name, part), dataset[target]
                both, new = (done & held)[here], (done & ~held)[here]
                if group == "ledger":  # also pending joints have an attempt, the one to come
                    new = ~held[here]
                same = (_bytes(values[both]) == _bytes(before[both])).all(axis=1)
                if group != "ledger" and not same.all():
                    raise DifferingResults(int(target.start + np.flatnonzero(both)[np.argmin(same)]), name)
                before[new] = values[new]
                dataset[target] = before


def _columns(source: Reader) -> Iterator[tuple[str, str]]:
    """Yield group and name of the datasets of an operating point, the status last: it says what a file holds."""
    yield "ledger", "attempt"
    yield from (("histories", name) for name in source.history_specs)
    yield from (("results", c.name) for c in source.columns)


def _parts(rows: slice, dataset: h5py.Dataset) -> Iterator[slice]:
    size = max(1, COPY_BYTES // max(1, dataset.dtype.itemsize * int(np.prod(dataset.shape[1:]))))
    for first in range(rows.start, rows.stop, size):
        yield slice(first, min(first + size, rows.stop))


def _bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Bytes of each row, (m, size), so that a NaN compares equal to the same NaN."""
    size = values.dtype.itemsize * int(np.prod(values.shape[1:]))
    return np.ascontiguousarray(values).view(np.uint8).reshape(len(values), size)
