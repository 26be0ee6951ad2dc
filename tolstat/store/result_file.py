"""The layout of a result file, docs/result_format.md: how a new one is filled and how any is opened."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat import tables
from tolstat.errors import Fault, StoreError
from tolstat.store.provenance import git_commit, versions
from tolstat.tables import HistorySpec

if TYPE_CHECKING:
    from tolstat.study import Study

FILETYPE = "tolstat campaign"
SCHEMA_VERSION = 1


def attributes(study: Study, specs: Mapping[str, HistorySpec], dimensions: Mapping[str, int]) -> dict[str, Any]:
    """Make the attributes of a new file: all that a reader needs beyond the tables.

    Parameters
    ----------
    study : Study
        The study.
    specs : mapping of str to HistorySpec
        Histories that the campaign keeps.
    dimensions : mapping of str to int
        Which dimension of the sequence each error is drawn from.
    """
    sampling = study.sampling.model_dump(mode="json")
    structured = {
        "identity": study.identity(),
        "joint": study.joint.model_dump(mode="json"),
        "options": study.solver.options()._asdict(),
        "limits": study.limits,
        "design": {"cases": study.case_names, "variants": [variant._asdict() for variant in study.variants]},
        "sampling": sampling | {"dimensions": dict(dimensions)},
        "versions": versions(),
        "histories": specs,
    }
    plain = {
        "filetype": FILETYPE,
        "schema_version": SCHEMA_VERSION,
        "study": study.text,
        "study_name": study.name,
        "git_commit": git_commit(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    return plain | {name: json.dumps(value, allow_nan=False) for name, value in structured.items()}


def pending_results(n: int) -> NDArray[np.void]:
    """Make the table RESULT of joints not simulated yet: status PENDING, floats NaN."""
    table = np.zeros(n, tables.RESULT)
    for field in tables.RESULT_FIELDS:
        if np.dtype(field.dtype).kind == "f":
            table[field.name] = np.nan
    return table


def create_table(group: h5py.Group, columns: tuple[tables.Column, ...], table: NDArray[np.void]) -> None:
    """Write a table column by column, each a contiguous dataset that can be overwritten in place.

    Parameters
    ----------
    group : h5py.Group
        Where the datasets go.
    columns : tuple of Column
        Columns of the table.
    table : (n,) structured array
        Its values.
    """
    for c in columns:
        dataset = group.create_dataset(c.name, data=c.of(table), dtype=c.dtype)
        dataset.attrs["units"] = c.unit
        dataset.attrs["description"] = c.description


def open_hdf5(path: Path, mode: str) -> h5py.File:
    """Open an HDF5 file.

    Raises
    ------
    StoreError
        When it is not there, not HDF5, damaged, without permission, or held by a writer; it says which.
    """
    if path.is_dir():
        raise fault(path, "is a folder", "give the path of a file")
    if mode != "r" and path.is_file() and not h5py.is_hdf5(path):
        # opening an empty file for writing would make it one
        raise fault(path, "is not an HDF5 file", "give a file that tolstat run has made")
    try:
        # Readers take no lock: the writer changes numbers only, so they may look at a campaign under way.
        return h5py.File(path, mode, locking=False if mode == "r" else "best-effort")
    except OSError as error:
        if not path.is_file():
            raise fault(path, "is not there", "check the path, or make it with: tolstat run") from error
        if error.errno in (errno.EAGAIN, errno.EWOULDBLOCK) or "unable to lock" in str(error):
            raise fault(path, "is being written by another process", "wait for it or stop it") from error
        if "already open" in str(error) or "don't match" in str(error):
            raise fault(path, "is open in this process in another way", "close that one first") from error
        if not os.access(path, os.R_OK if mode == "r" else os.R_OK | os.W_OK):
            raise fault(path, "cannot be opened: no permission", "change its permissions") from error
        if not h5py.is_hdf5(path):
            raise fault(path, "is not an HDF5 file", "give a file that tolstat run has made") from error
        raise fault(path, f"is damaged: {error}", "run the campaign again with another --out") from error


def check_schema(path: Path, file: h5py.File) -> None:
    """Check that an HDF5 file is a result file that this version can read.

    Raises
    ------
    StoreError
        When it is not.
    """
    filetype = file.attrs.get("filetype")
    if filetype != FILETYPE:
        found = f"is HDF5, but of type {filetype!r} instead of {FILETYPE!r}"
        raise fault(path, found, "give a file that tolstat run has made")
    version = int(file.attrs["schema_version"])
    if version > SCHEMA_VERSION:
        found = f"has schema version {version}, this tolstat reads up to {SCHEMA_VERSION}"
        raise fault(path, found, "use a newer tolstat")


def fault(path: Path, found: str, remedy: str) -> StoreError:
    """Make the error that says what is wrong with a file and what to do about it."""
    return StoreError(str(Fault(str(path), found, remedy)))
