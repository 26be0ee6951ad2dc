"""The layout of a result file, docs/result_format.md: how a new one is filled and how any is opened."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat import tables
from tolstat.errors import Fault, StoreError
from tolstat.files import writing
from tolstat.store.provenance import git_commit, versions
from tolstat.tables import HistorySpec

if TYPE_CHECKING:
    from tolstat.study import Study

FILETYPE = "tolstat campaign"
SCHEMA_VERSION = 1


def campaign_digest(file: h5py.File) -> str:
    """Hash of what tells a campaign from others: the study's identity and the code that began it."""
    texts = (str(file.attrs[name]) for name in ("identity", "versions"))
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:16]


def judgement(study: Study) -> dict[str, str]:
    """Make the attributes of a study that decide no number and may change while a campaign goes on."""
    return {"study": study.text, "study_name": study.name, "limits": json.dumps(study.limits, allow_nan=False)}


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
        "design": {"cases": study.case_names, "variants": [variant._asdict() for variant in study.variants]},
        "sampling": sampling | {"dimensions": dict(dimensions)},
        "versions": versions(),
        "histories": specs,
    }
    plain = {
        "filetype": FILETYPE,
        "schema_version": SCHEMA_VERSION,
        "git_commit": git_commit(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    plain |= judgement(study)
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


def put(dataset: h5py.Dataset, rows: NDArray[np.intp], values: NDArray[Any]) -> None:
    """Overwrite the `rows` of a column with `values`, (m,); rows that follow one another go in one piece."""
    ends = [*(np.flatnonzero(np.diff(rows) != 1) + 1), len(rows)]
    for begin, end in pairwise([0, *ends]):
        dataset[rows[begin] : rows[end - 1] + 1] = values[begin:end]


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
        file = h5py.File(path, mode, locking=False if mode == "r" else "best-effort")
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
    if mode != "r" and not _is_at(file, path):
        # opened before another process replaced it and locked after: nobody else will ever see this file
        file.close()
        raise fault(path, "is being written by another process", "wait for it or stop it")
    return file


def _is_at(file: h5py.File, path: Path) -> bool:
    return path.exists() and os.path.samestat(os.fstat(file.id.get_vfd_handle()), path.stat())


def replace(path: Path, held: h5py.File, change: Callable[[h5py.File], None]) -> h5py.File:
    """Change more of a file than numbers, by way of a copy: a kill leaves the file as it was or as it shall be.

    No other process can write in between: `held` stays open and locked until the copy has its lock and the name.

    Parameters
    ----------
    path : Path
        The file.
    held : h5py.File
        The same, open for writing; closed afterwards.
    change : callable
        Told the copy, open for writing.

    Returns
    -------
    h5py.File
        What is now at `path`, open for writing.
    """
    held.flush()
    with ExitStack() as opened:
        with writing(path) as temporary:
            shutil.copyfile(path, temporary)
            with open_hdf5(temporary, "r+") as file:
                change(file)
            copy = opened.enter_context(open_hdf5(temporary, "r+"))
        opened.pop_all()
    held.close()
    return copy


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
