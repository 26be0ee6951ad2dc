"""Copy the results of files with rows of a campaign to the new file of the whole campaign."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import Fault, InputError
from tolstat.common.tables import Status
from tolstat.store import layout
from tolstat.store.hdf5 import BLOCK
from tolstat.store.reader import Reader

COPY_BYTES = 1 << 25
"""Approximate number of bytes of a column that are copied at a time."""


def copy_results(file: h5py.File, sources: Sequence[Reader]) -> None:
    """Copy finished joints from files with rows of a campaign to the new file of the whole campaign.

    For a row in several of them, a finished result takes precedence over pending.

    Raises
    ------
    InputError
        When two of them hold different results of one row.
    """
    for source in sources:
        for one in source.each():
            for row, column in _copy(file, one):
                holding = [str(store.path) for store in sources if row in store.rows]
                found = f"hold different results of row {row}: {column} differs"
                remedy = f"find the file that is wrong, and leave it out: tolstat replay {holding[0]} --row {row}"
                raise InputError([Fault(" and ".join(holding), found, remedy)])


def _copy(file: h5py.File, source: Reader) -> Iterator[tuple[int, str]]:
    """Copy finished joints; yield row and column of those that the file has already with another result."""
    place = layout.place_of(source.point or "") or "/"
    columns = [("ledger", "attempt"), *(("histories", name) for name in source.history_specs)]
    columns += [("results", c.name) for c in source.columns]  # the status last: it says what a file holds
    for first in range(0, source.n, BLOCK):
        own = slice(first, min(first + BLOCK, source.n))
        there = slice(source.row(own.start), source.row(own.stop))
        done = source.status(own) != Status.PENDING
        held = file[place]["results/status"][there] != Status.PENDING
        for group, name in columns:
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
                    yield int(target.start + np.flatnonzero(both)[np.argmin(same)]), name
                before[new] = values[new]
                dataset[target] = before


def _parts(rows: slice, dataset: h5py.Dataset) -> Iterator[slice]:
    size = max(1, COPY_BYTES // max(1, dataset.dtype.itemsize * int(np.prod(dataset.shape[1:]))))
    for first in range(rows.start, rows.stop, size):
        yield slice(first, min(first + size, rows.stop))


def _bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Bytes of each row, (m, size), so that a NaN compares equal to the same NaN."""
    size = values.dtype.itemsize * int(np.prod(values.shape[1:]))
    return np.ascontiguousarray(values).view(np.uint8).reshape(len(values), size)
