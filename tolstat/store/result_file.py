"""Result files as HDF5: open one, replace one by a changed copy, read and write columns and attributes."""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5f, h5g, h5p, h5s, h5t
from numpy.typing import NDArray

from tolstat.common import draw_records, tables
from tolstat.common.columns import DESIGN_COLUMNS, Column
from tolstat.common.errors import Fault, StoreError
from tolstat.common.files import atomic_write, check_disk_space
from tolstat.store.integrity import seal

FILETYPE = "tolstat campaign"
MAX_FIXED_TEXT = 32_000
"""Largest size of a text stored as an attribute of fixed length, bytes: HDF5 allows some 64 kB."""
LINKED = ("row", "nominal")
"""Datasets of the file that every group with joints has as links: number of each row, mark of the nominal joint."""
BLOCK = 1 << 16
"""Rows read or written at a time, so that no table of a large campaign need be in memory."""
TOGETHER = 2048
"""Rows that lie between two others in a block of so many are read with them: a read takes as long as some 4000 rows."""
RUN_AGAIN = "run the campaign again: tolstat run STUDY --out OTHER.h5"
"""Remedy for a file that cannot be repaired."""


POINT_GROUPS = ("results", "ledger", "histories", "verify", "near")
"""Groups that a file has once for each operating point."""


class Handle:
    """An open result file; readers of its operating points share it, so that all follow when it is replaced."""

    def __init__(self, file: h5py.File) -> None:
        self.file = file

    @property
    def file(self) -> h5py.File:
        """The file."""
        return self._file

    @file.setter
    def file(self, file: h5py.File) -> None:
        self._file = file
        self._datasets: dict[str, h5py.Dataset] = {}

    def dataset(self, path: str) -> h5py.Dataset:
        """Look up a dataset; in a file open for reading once, since that takes longer than reading 65 536 numbers."""
        found = self._datasets.get(path)
        if found is None:
            found = self._file[path]
            if self._file.mode == "r":
                self._datasets[path] = found
        return found


def place_of(point: str) -> str:
    """Path of the group that holds `POINT_GROUPS` of an operating point: the root for the one without a name."""
    return f"/points/{point}" if point else "/"


def campaign_digest(file: h5py.File) -> str:
    """Hash that identifies a campaign: the study's identity, the software versions, and the rows in the file."""
    texts = [text(file.attrs, name) for name in ("identity", "versions")]
    if "first_row" in file.attrs:
        texts.append(f"{int(file.attrs['first_row'])} {file['row'].shape[0]}")
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:16]


def put_attributes(holder: h5py.Group | h5py.Dataset, values: Mapping[str, str | int | float]) -> None:
    """Write attributes; texts are fixed-length UTF-8, which MATLAB and Fortran can read, except very long ones."""
    for name, value in values.items():
        if isinstance(value, str) and len(value.encode()) <= MAX_FIXED_TEXT:
            put_text(holder.id, name, value)
        else:
            holder.attrs.create(name, value)


def put_text(held: h5d.DatasetID | h5g.GroupID, name: str, value: str) -> None:
    """Write a text of at most `MAX_FIXED_TEXT` bytes as an attribute, without h5py's objects: each column has two."""
    data, own = value.encode(), name.encode()
    size = max(1, len(data))
    stored = _text_type(size)
    if h5a.exists(held, own):
        h5a.delete(held, own)
    h5a.create(held, own, stored, h5s.create(h5s.SCALAR)).write(np.array(data, f"S{size}"), mtype=stored)


@lru_cache(256)
def _text_type(size: int) -> h5t.TypeID:
    return h5t.py_create(h5py.string_dtype("utf-8", size), logical=True)


def link_rows(file: h5py.Group, group: h5py.Group) -> None:
    """Link ``row`` and ``nominal`` of a file into one of its groups, so that it can be read on its own."""
    for name in LINKED:
        group[name] = file.file[name]


def text(attrs: h5py.AttributeManager, name: str) -> str:
    """Read a text attribute of fixed or variable length.

    Raises
    ------
    KeyError
        When there is no attribute of that name.
    ValueError
        When it is not a text in UTF-8.
    """
    value = attrs[name]
    if isinstance(value, bytes):
        return value.decode("utf-8")
    if isinstance(value, str):
        return value
    raise ValueError(f"attribute {name} is not a text")


def check_column(history: str) -> Column:
    """Column of the ledger with the checksums of a history."""
    return Column(f"{history}_check", "1", f"CRC-32 of the joint's {history}", "u4", f"{history}_check", ())


def descriptions(file: h5py.File) -> dict[str, tuple[tuple[Column, ...], np.dtype[np.void]]]:
    """Columns and dtypes of the tables that describe joints beside their errors, by HDF5 group.

    ``design`` has variant, case and group of each joint, ``origin`` how it was drawn; most campaigns have neither.
    """
    held = {"design": (DESIGN_COLUMNS, tables.DESIGN)} if "design" in file else {}
    if "origin" in file:
        sampling = json.loads(text(file.attrs, "sampling"))
        held["origin"] = (draw_records.columns(sampling), draw_records.dtype(sampling))
    return held


def get(dataset: h5py.Dataset, rows: NDArray[np.intp]) -> NDArray[Any]:
    """Values of the `rows` of a column, (m,)."""
    begin = rows.min()
    return np.asarray(dataset[begin : rows.max() + 1][rows - begin])


def put(group: h5py.Group, rows: NDArray[np.intp], columns: Mapping[str, NDArray[Any]]) -> None:
    """Overwrite the `rows` of columns of a group with values, (m,) each; consecutive rows are written in one piece.

    The functions of HDF5 are called directly: a block of joints has a hundred columns, and h5py's objects would take
    most of the time.
    """
    if not (len(rows) and columns):
        return
    opened = [(h5d.open(group.id, name.encode()), values) for name, values in columns.items()]
    there = opened[0][0].get_space()  # columns of a group have one length
    ends = [*(np.flatnonzero(np.diff(rows) != 1) + 1), len(rows)]
    for begin, end in pairwise([0, *ends]):
        some = h5s.create_simple((end - begin,))
        there.select_hyperslab((int(rows[begin]),), (end - begin,))
        for held, values in opened:
            held.write(some, there, np.ascontiguousarray(values[begin:end]))


def open_hdf5(path: Path, mode: str) -> h5py.File:
    """Open an HDF5 file.

    Raises
    ------
    StoreError
        When the file is missing, not HDF5, damaged, not permitted or locked by a writer; the message says which.
    """
    if path.is_dir():
        raise store_error(path, "is a folder", "give the path of a file")
    if path.exists() and not path.is_file():
        raise store_error(path, "is a pipe or a device, not a file", "give a result file made by tolstat run")
    if mode != "r" and path.is_file() and not h5py.is_hdf5(path):
        # h5py would turn an empty file that it opens for writing into an HDF5 file
        raise store_error(path, "is not an HDF5 file", "give a result file made by tolstat run")
    try:
        file = _for_reading(path) if mode == "r" else h5py.File(path, mode, locking="best-effort")
    except OSError as error:
        if not path.is_file():
            raise store_error(
                path, "does not exist", f"check the path, or create it: tolstat run STUDY --out {path}"
            ) from error
        if error.errno in (errno.EAGAIN, errno.EWOULDBLOCK) or "unable to lock" in str(error):
            raise store_error(
                path, "is being written by another process", "wait until that process ends, or stop it"
            ) from error
        if "already open" in str(error) or "don't match" in str(error):
            raise store_error(path, "is open in this process in another mode", "close it first") from error
        if not os.access(path, os.R_OK if mode == "r" else os.R_OK | os.W_OK):
            raise store_error(
                path, "cannot be opened: no permission", f"change its permissions: chmod u+rw {path}"
            ) from error
        if not h5py.is_hdf5(path):
            raise store_error(path, "is not an HDF5 file", "give a result file made by tolstat run") from error
        raise store_error(path, f"is damaged: {error}", RUN_AGAIN) from error
    if mode != "r" and not is_at(file, path):
        # another process replaced the file between opening and locking: the open file is not at `path`
        file.close()
        raise store_error(path, "is being written by another process", "wait until that process ends, or stop it")
    return file


def _for_reading(path: Path) -> h5py.File:
    """Open a file, also while a campaign writes it.

    It takes no lock, since a writer only changes numbers in place, and has no sieve buffer: with one, HDF5 would read
    a dataset that stays open from its memory, as it was before.
    """
    access = h5p.create(h5p.FILE_ACCESS)
    access.set_fclose_degree(h5f.CLOSE_STRONG)
    access.set_file_locking(False, False)
    access.set_sieve_buf_size(0)
    return h5py.File(h5f.open(os.fsencode(path), h5f.ACC_RDONLY, access))


def is_at(file: h5py.File, path: Path) -> bool:
    """Whether an open file is the one now at `path`."""
    return path.exists() and os.path.samestat(os.fstat(file.id.get_vfd_handle()), path.stat())


def copy_open(file: h5py.File, path: Path) -> None:
    """Copy an open file to `path`, even if its own name has been deleted."""
    file.flush()
    handle = file.id.get_vfd_handle()
    with open(path, "wb") as copy:
        offset = 0
        while chunk := os.pread(handle, 1 << 20, offset):
            copy.write(chunk)
            offset += len(chunk)


def is_locked(path: Path) -> bool:
    """Whether a process has locked the file for writing; tested by a shared lock that is released at once."""
    try:
        import fcntl
    except ImportError:  # a system without file locks: unknown, taken as not locked
        return False
    with open(path, "rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError as error:
            return error.errno in (errno.EAGAIN, errno.EWOULDBLOCK)
    return False


def replace(path: Path, held: h5py.File, change: Callable[[h5py.File], None], growth: int = 0) -> h5py.File:
    """Change the structure of a file by way of a copy; a kill leaves either the old or the changed file.

    No other process can write in between: `held` stays open and locked until the copy is locked and at `path`.

    Parameters
    ----------
    path : Path
        The file.
    held : h5py.File
        The same file, open for writing; closed afterwards.
    change : callable
        Called with the copy, open for writing.
    growth : int
        Approximate number of bytes by which `change` enlarges the copy.

    Returns
    -------
    h5py.File
        The file now at `path`, open for writing.
    """
    check_disk_space(path, held.id.get_filesize() + growth)
    with ExitStack() as opened:
        with atomic_write(path) as temporary:
            copy_open(held, temporary)
            with open_hdf5(temporary, "r+") as file:
                change(file)
                seal(file)
            copy = opened.enter_context(open_hdf5(temporary, "r+"))
        opened.pop_all()
    held.close()
    return copy


def pick(read: Callable[[slice], NDArray[Any]], slots: NDArray[np.intp]) -> NDArray[Any]:
    """Read file slots, (m,) and ascending, of a table that is read by slices: one for each block of `TOGETHER`."""
    runs = np.split(slots, np.flatnonzero(np.diff(slots // TOGETHER)) + 1)
    return np.concatenate([read(slice(int(run[0]), int(run[-1]) + 1))[run - run[0]] for run in runs])


def store_error(path: Path, found: str, remedy: str) -> StoreError:
    """Return the error of a file: what is wrong, and the remedy."""
    return StoreError(str(Fault(str(path), found, remedy)))
