"""HDF5 as a result file uses it: open and lock a file, replace it by a changed copy, write columns in place."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5f, h5p, h5s
from numpy.typing import NDArray

from tolstat.common.errors import Fault, StoreError
from tolstat.common.files import atomic_write, check_disk_space
from tolstat.store.lock import being_written

BLOCK = 1 << 16
"""Rows read or written at a time, so that no table of a large campaign need be in memory."""
TOGETHER = 2048
"""Rows that lie between two others in a block of so many are read with them: a read takes as long as some 4000 rows."""
MAX_FIXED_TEXT = 32_000
"""Largest size of a text stored as an attribute of fixed length, bytes: HDF5 allows some 64 kB."""
RUN_AGAIN = "run the campaign again: tolstat run STUDY --out OTHER.h5"
"""Remedy for a file that cannot be repaired."""
DAMAGED = "is damaged or no tolstat result file"
DAMAGE_ERRORS = (KeyError, ValueError, TypeError, AttributeError, IndexError, RuntimeError, OSError)
"""Exceptions that h5py, or code that relies on what a file states, raises where the file is damaged."""


def store_error(path: Path, found: str, remedy: str) -> StoreError:
    """Return the error of a file: what is wrong, and the remedy."""
    return StoreError(str(Fault(str(path), found, remedy)))


@contextmanager
def told_as_damage(path: Path, found: str = DAMAGED, remedy: str = RUN_AGAIN) -> Iterator[None]:
    """Turn what a damaged file raises into one sentence."""
    try:
        yield
    except StoreError:
        raise
    except DAMAGE_ERRORS as error:
        raise store_error(path, f"{found}: {error}", remedy) from error


def open_hdf5(path: Path, mode: str) -> h5py.File:
    """Open an HDF5 file, ``"r"`` without a lock, ``"r+"`` with one.

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
        if mode == "r":
            # no lock: a writer only changes numbers in place; with a sieve buffer, HDF5 would read a dataset that stays
            # open from its memory, as it was before
            access = h5p.create(h5p.FILE_ACCESS)
            access.set_fclose_degree(h5f.CLOSE_STRONG)
            access.set_file_locking(False, False)
            access.set_sieve_buf_size(0)
            return h5py.File(h5f.open(os.fsencode(path), h5f.ACC_RDONLY, access))
        file = h5py.File(path, mode, locking="best-effort")
    except OSError as error:
        raise _not_opened(path, mode, error) from error
    if not is_at(file, path):
        # another process replaced the file between opening and locking: the open file is not at `path`
        file.close()
        raise being_written(path)
    return file


def _not_opened(path: Path, mode: str, error: OSError) -> StoreError:
    if not path.is_file():
        return store_error(path, "does not exist", f"check the path, or create it: tolstat run STUDY --out {path}")
    if error.errno in (errno.EAGAIN, errno.EWOULDBLOCK) or "unable to lock" in str(error):
        return being_written(path)
    if "already open" in str(error) or "don't match" in str(error):
        return store_error(path, "is open in this process in another mode", "close it first")
    if not os.access(path, os.R_OK if mode == "r" else os.R_OK | os.W_OK):
        return store_error(path, "cannot be opened: no permission", "change its permissions, or those of its folder")
    if isinstance(error, PermissionError):
        return store_error(path, "is open in another program", "close it there")
    if not h5py.is_hdf5(path):
        return store_error(path, "is not an HDF5 file", "give a result file made by tolstat run")
    return store_error(path, f"{DAMAGED}: {error}", RUN_AGAIN)


def is_at(file: h5py.File, path: Path) -> bool:
    """Whether an open file is the one now at `path`."""
    return path.exists() and os.path.samestat(os.fstat(file.id.get_vfd_handle()), path.stat())


def copy_open(file: h5py.File, path: Path) -> None:
    """Copy an open file to `path`, even if its own name has been deleted, which Windows does not allow."""
    file.flush()
    if not hasattr(os, "pread"):
        shutil.copyfile(file.filename, path)
        return
    handle = file.id.get_vfd_handle()
    with open(path, "wb") as copy:
        offset = 0
        while chunk := os.pread(handle, 1 << 20, offset):
            copy.write(chunk)
            offset += len(chunk)


def replace(path: Path, file: h5py.File, change: Callable[[h5py.File], None], growth: int = 0) -> None:
    """Change the structure of a file by way of a copy; a kill leaves either the old or the changed file.

    Parameters
    ----------
    path : Path
        The file.
    file : h5py.File
        The same file, open for writing; closed before the copy takes its place, which Windows asks for.
    change : callable
        Called with the copy, open for writing.
    growth : int
        Approximate number of bytes by which `change` enlarges the copy.
    """
    check_disk_space(path, file.id.get_filesize() + growth)
    with atomic_write(path) as temporary:
        copy_open(file, temporary)
        with open_hdf5(temporary, "r+") as changed:
            change(changed)
        file.close()


def read_rows(dataset: h5d.DatasetID, first: int, values: NDArray[Any]) -> None:
    """Fill `values`, (m, ...), with rows of a dataset from `first` on; calls HDF5 directly, as `put` does."""
    there = dataset.get_space()
    there.select_hyperslab((first, *(0,) * (values.ndim - 1)), values.shape)
    dataset.read(h5s.create_simple(values.shape), there, values)


def put(group: h5py.Group, rows: NDArray[np.intp], columns: Mapping[str, NDArray[Any]]) -> None:
    """Overwrite the `rows` of datasets of a group, (m, ...) each; consecutive rows are written in one piece.

    The functions of HDF5 are called directly: a block of joints has a hundred columns, and h5py's objects would take
    most of the time.
    """
    if not (len(rows) and columns):
        return
    opened = [(h5d.open(group.id, name.encode()), values) for name, values in columns.items()]
    ends = [*(np.flatnonzero(np.diff(rows) != 1) + 1), len(rows)]
    for begin, end in pairwise([0, *ends]):
        for dataset, values in opened:
            part = np.ascontiguousarray(values[begin:end])
            there = dataset.get_space()
            zeros = (0,) * (part.ndim - 1)
            there.select_hyperslab((int(rows[begin]), *zeros), part.shape)
            dataset.write(h5s.create_simple(part.shape), there, part)


def put_attributes(holder: h5py.Group | h5py.Dataset, values: Mapping[str, str | int | float]) -> None:
    """Write attributes; texts are fixed-length UTF-8, which MATLAB and Fortran can read, except very long ones."""
    for name, value in values.items():
        if isinstance(value, str) and len(data := value.encode()) <= MAX_FIXED_TEXT:
            holder.attrs.create(name, np.bytes_(data), dtype=h5py.string_dtype("utf-8", max(1, len(data))))
        else:
            holder.attrs.create(name, value)


def put_scale(group: h5py.Group, name: str, values: NDArray[Any], unit: str, description: str) -> h5py.Dataset:
    """Create a dimension scale: the values along an axis of other datasets."""
    scale = group.create_dataset(name, data=values, dtype=h5py.string_dtype() if values.dtype.kind == "O" else None)
    scale.make_scale(name)
    put_attributes(scale, {"units": unit, "description": description})
    return scale


def text(attrs: h5py.AttributeManager, name: str) -> str:
    """Read a text attribute of fixed or variable length; `KeyError` without one, `ValueError` if it is not UTF-8."""
    value = attrs[name]
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)


def pick(read: Callable[[slice], NDArray[Any]], slots: NDArray[np.intp], size: int = TOGETHER) -> NDArray[Any]:
    """Read file slots, (m,) and ascending, of a table that is read by slices: one for each block of `size` rows."""
    runs = np.split(slots, np.flatnonzero(np.diff(slots // size)) + 1)
    return np.concatenate([read(slice(int(run[0]), int(run[-1]) + 1))[run - run[0]] for run in runs])
