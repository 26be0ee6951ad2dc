"""Checksums that detect numbers that changed after they were written: one for each column and block of rows.

They find accidents, such as a flipped bit of a disk; they are no signatures. Columns that are complete when the file is
created (errors, how joints were drawn) have theirs from then on. Those of results and histories hold while ``session/
number`` is even: a run makes it odd before its first write, and even again once it has written the checksums. A run
that was killed leaves it odd, and the results unchecked.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from h5py import h5d
from numpy.typing import NDArray

from tolstat.store import layout
from tolstat.store.hdf5 import put_attributes, put_scale, read_rows, store_error, told_as_damage
from tolstat.store.layout import Stored
from tolstat.store.metadata import Metadata

GROUP = "checksums"
ROWS = 4096
"""Rows of a block that have one checksum a column."""
READ_BYTES = 1 << 22
"""Approximate number of bytes read at a time."""
KNOWN = 1 << 32
"""Added to each CRC-32, so that zero stands for a checksum that was never written."""


UNKNOWN, SOUND, DAMAGED = 0, 1, 2
"""What is known of a block."""


class Integrity(NamedTuple):
    """What the checksums of a whole file say.

    Attributes
    ----------
    checked : bool
        Whether results and histories have checksums: not while a run is under way, nor after one that was killed.
    damaged : dict of str to list of str
        Rows of the campaign that do not match their checksum, ``"4096:8192"``, by dataset.
    """

    checked: bool
    damaged: dict[str, list[str]]


class CheckedFile:
    """An open result file whose blocks are compared with their checksums when they are first asked for.

    Readers at its operating points share it, also when another file takes its place.
    """

    def __init__(self, path: Path, file: h5py.File, metadata: Metadata) -> None:
        self.path = path
        self.use(file, metadata)

    def use(self, file: h5py.File, metadata: Metadata) -> None:
        """Use another file in the place of the one before."""
        self._file = file
        self.stored = {stored.path: stored for stored in layout.datasets(metadata)}
        self._index = {path: k for k, path in enumerate(self.stored)}
        self._datasets: dict[str, h5d.DatasetID] = {}
        self._known: dict[tuple[str, ...], NDArray[np.uint8]] = {}
        self._number = -1

    @property
    def is_open(self) -> bool:
        """Whether the file has not been closed."""
        return bool(self._file)

    @property
    def file(self) -> h5py.File:
        """The file; a `StoreError` if it has been closed."""
        if not self.is_open:
            raise store_error(self.path, "is closed", "ask inside its with block, or open it again")
        return self._file

    def close(self) -> None:
        """Close the file."""
        self._datasets.clear()
        self._file.close()

    def read(self, path: str, begin: int, end: int) -> NDArray[Any]:
        """Read rows of a dataset with a row for each joint, (end - begin, ...)."""
        stored = self.stored[path]
        values = np.empty((max(0, end - begin), *stored.shape[1:]), stored.dtype)
        with told_as_damage(self.path):
            read_rows(self._dataset(path), begin, values)
        return values

    def _dataset(self, path: str) -> h5d.DatasetID:
        """Look up a dataset; its type and shape must be those that the metadata imply."""
        dataset = self._datasets.get(path)
        if dataset is None:
            with told_as_damage(self.path):
                dataset, stored = h5d.open(self.file.id, path.encode()), self.stored[path]
                if dataset.shape != stored.shape or dataset.dtype != stored.dtype:
                    expected = f"{stored.shape} of {stored.dtype}"
                    raise ValueError(f"{path} is {dataset.shape} of {dataset.dtype}, not {expected}")
            self._datasets[path] = dataset
        return dataset

    @property
    def number(self) -> int:
        """Session number: odd while results have no checksums."""
        with told_as_damage(self.path):
            return int(self.file["session"]["number"][()])

    def damaged(self, paths: tuple[str, ...], begin: int, end: int) -> NDArray[np.intp]:
        """Blocks of the rows from `begin` to `end` in which at least one of the datasets `paths` is damaged.

        Either all of them change in a run (results, ledger, histories), or none does. Without checksums no block counts
        as damaged.
        """
        blocks, changes = np.arange(begin // ROWS, blocks_of(max(begin, end))), layout.is_at_point(paths[0])
        number = self.number if changes else self._number
        if changes and number % 2:
            return blocks[:0]
        if number != self._number:
            self._known = {group: known for group, known in self._known.items() if not layout.is_at_point(group[0])}
            self._number = number
        known = self._known.setdefault(paths, np.full(blocks_of(self.stored[paths[0]].shape[0]), UNKNOWN, np.uint8))
        new = blocks[known[blocks] == UNKNOWN]
        if new.size:
            wrong = self._differ(paths, new).any(axis=0)
            if changes and self.number != number:  # a run has begun meanwhile
                return blocks[:0]
            known[new] = np.where(wrong, DAMAGED, SOUND)
        return np.asarray(blocks[known[blocks] == DAMAGED])

    def _differ(self, paths: Sequence[str], blocks: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether datasets do not match their checksums, (paths, blocks)."""
        for path in paths:
            self._dataset(path)
        with told_as_damage(self.path):
            written = self.file[GROUP]["crc"][:, blocks[0] : blocks[-1] + 1][[self._index[path] for path in paths]]
            actual = computed(self.file, [self.stored[path] for path in paths], blocks)
            return np.asarray(written[:, blocks - blocks[0]] != actual)

    def check(self) -> dict[str, NDArray[np.intp]]:
        """Compare everything that has a checksum with it, histories included; damaged blocks by dataset."""
        blocks, number = np.arange(blocks_of(next(iter(self.stored.values())).shape[0])), self.number
        paths = [path for path in self.stored if number % 2 == 0 or not layout.is_at_point(path)]
        damaged_blocks = {path: blocks[wrong] for path, wrong in zip(paths, self._differ(paths, blocks), strict=True)}
        if self.number != number:  # a run has begun meanwhile
            paths = [path for path in paths if not layout.is_at_point(path)]
        return {path: wrong for path in paths if (wrong := damaged_blocks[path]).size}


def blocks_of(n: int) -> int:
    """Number of blocks of `n` rows."""
    return -(-n // ROWS)


def create(file: h5py.File, metadata: Metadata) -> None:
    """Create the group of the checksums in a file that is complete but for them; those of errors are known then."""
    stored, blocks = layout.datasets(metadata), np.arange(0, metadata.n, ROWS)
    group = file.create_group(GROUP)
    crc = group.create_dataset("crc", data=np.zeros((len(stored), len(blocks)), "u8"))
    put_attributes(group, {"description": "CRC-32 of each column and block of rows, plus 2^32; 0 if never computed"})
    put_attributes(crc, {"units": "1", "description": "of path, type, shape and first slot as text, then the bytes"})
    columns = np.array([dataset.path.encode() for dataset in stored])
    crc.dims[0].attach_scale(put_scale(group, "column", columns, "1", "path of the dataset in this file"))
    crc.dims[1].attach_scale(put_scale(group, "block", blocks, "1", "first file slot of the block"))
    update(file, metadata, False, np.arange(len(blocks)))


def update(file: h5py.File, metadata: Metadata, at_points: bool, blocks: NDArray[np.intp]) -> None:
    """Write the checksums of some blocks, ascending, as they are now: of all results and histories, or all others."""
    each = list(enumerate(layout.datasets(metadata)))
    chosen = {k: column for k, column in each if layout.is_at_point(column.path) == at_points}  # consecutive
    if chosen and blocks.size:
        file[GROUP]["crc"][min(chosen) : max(chosen) + 1, blocks] = computed(file, list(chosen.values()), blocks)


def computed(file: h5py.File, stored: Sequence[Stored], blocks: NDArray[np.intp]) -> NDArray[np.uint64]:
    """Checksums of some blocks of datasets, (datasets, blocks), from what is in the file now."""
    checksums = np.empty((len(stored), len(blocks)), np.uint64)
    runs = np.split(np.arange(len(blocks)), np.flatnonzero(np.diff(blocks) != 1) + 1) if len(blocks) else []
    for k, dataset in enumerate(stored):
        for run in runs:
            checksums[k, run] = _of_run(file, dataset, int(blocks[run[0]]), int(blocks[run[-1]]) + 1)
    return checksums


def _of_run(file: h5py.File, stored: Stored, first: int, last: int) -> list[int]:
    """Checksums of consecutive blocks; several are read together, or one in pieces if it is large."""
    n, stop = stored.shape[0], min(last * ROWS, stored.shape[0])
    # a power of two, as ROWS: one divides the other
    step = 1 << ((READ_BYTES // stored.row_bytes) or 1).bit_length() - 1
    dataset, checksums, crc = h5d.open(file.id, stored.path.encode()), [], 0
    for begin in range(first * ROWS, stop, step):
        values = np.empty((min(step, stop - begin), *stored.shape[1:]), stored.dtype)
        read_rows(dataset, begin, values)
        for start in range(begin, begin + len(values), ROWS):
            if start % ROWS == 0:
                shape = (min(start + ROWS, n) - start, *stored.shape[1:])
                crc = zlib.crc32(f"{stored.path} {stored.dtype.str} {shape} {start}".encode())
            end = min(start + ROWS, begin + len(values))
            crc = zlib.crc32(values[start - begin : end - begin].data, crc)
            if end % ROWS == 0 or end == n:
                checksums.append(crc + KNOWN)
    return checksums
