"""Layout of a result file (docs/result_format.md): fill a new file, open or replace an existing one."""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common import draw_records, selected_results, tables
from tolstat.common.columns import DESIGN_COLUMNS, ERROR_COLUMNS, LEDGER_COLUMNS, Column
from tolstat.common.errors import Fault, StoreError
from tolstat.common.files import atomic_write, check_disk_space
from tolstat.common.tables import SCHEMA_VERSION, HistorySpec, Options
from tolstat.store.integrity import errors_hash, seal
from tolstat.store.provenance import git_commit, versions

if TYPE_CHECKING:
    from tolstat.study import Study

FILETYPE = "tolstat campaign"
MAX_FIXED_TEXT = 32_000
"""Largest size of a text stored as an attribute of fixed length, bytes: HDF5 allows some 64 kB."""
COLUMN_OVERHEAD = 800
"""Bytes that HDF5 needs per column beside its values."""
BLOCK = 1 << 16
"""Rows read or written at a time, so that no table of a large campaign need be in memory."""
RUN_AGAIN = "run the campaign again: tolstat run STUDY --out OTHER.h5"
"""Remedy for a file that cannot be repaired."""


def campaign_digest(file: h5py.File) -> str:
    """Hash that identifies a campaign: the study's identity, the software versions, and the rows in the file."""
    texts = [text(file.attrs, name) for name in ("identity", "versions")]
    if "first_row" in file.attrs:
        texts.append(f"{int(file.attrs['first_row'])} {file['results/status'].shape[0]}")
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:16]


def study_attributes(study: Study) -> dict[str, str]:
    """Return the attributes of a study that do not affect results and may change between runs of a campaign."""
    return {"study": study.text, "study_name": study.name, "limits": json.dumps(study.limits, allow_nan=False)}


def attributes(
    study: Study,
    specs: Mapping[str, HistorySpec],
    dimensions: Mapping[str, int],
    options: Options | None = None,
    fidelity: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the attributes of a new file: all that a reader needs beyond the tables.

    Parameters
    ----------
    study : Study
        The study.
    specs : mapping of str to HistorySpec
        Histories that the campaign keeps.
    dimensions : mapping of str to int
        Dimension of the sampling sequence that each error is drawn from.
    options, fidelity : Options and mapping, optional
        Settings that ``solver.fidelity = "auto"`` chose, and the record of that choice.
    """
    sampling = study.sampling.model_dump(mode="json")
    structured = {
        "identity": study.identity(),
        "joint": study.joint.given("json"),
        "options": (options or study.solver.options())._asdict(),
        "fidelity": dict(fidelity or {}),
        "design": {"cases": study.case_names, "variants": [variant._asdict() for variant in study.variants]},
        "sampling": sampling | {"dimensions": dict(dimensions)},
        "versions": versions(),
        "histories": specs,
        "retries": [],
    }
    plain = {
        "filetype": FILETYPE,
        "schema_version": SCHEMA_VERSION,
        "campaign_rows": study.rows,
        "git_commit": git_commit(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    plain |= study_attributes(study)
    return plain | {name: json.dumps(value, allow_nan=False) for name, value in structured.items()}


def size_of_new(n: int, results: tuple[Column, ...]) -> int:
    """Approximate upper bound on the size of a new file of `n` rows, bytes, without long attributes."""
    groups = (DESIGN_COLUMNS, ERROR_COLUMNS, results, LEDGER_COLUMNS)
    columns = [np.dtype(c.dtype).itemsize for group in groups for c in group]
    return n * sum(columns) + COLUMN_OVERHEAD * len(columns)


def put_attributes(holder: h5py.Group | h5py.Dataset, values: Mapping[str, str | int | float]) -> None:
    """Write attributes; texts are fixed-length UTF-8, which MATLAB and Fortran can read, except very long ones."""
    for name, value in values.items():
        data: Any = value
        dtype = None
        if isinstance(value, str) and len(value.encode()) <= MAX_FIXED_TEXT:
            data = value.encode()
            dtype = h5py.string_dtype("utf-8", max(1, len(data)))
        holder.attrs.create(name, data, dtype=dtype)


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


def fill(
    file: h5py.File,
    attrs: Mapping[str, str | int | float],
    rows: range,
    errors: Iterable[NDArray[np.void]],
    design: NDArray[np.void] | None,
    origin: Iterable[NDArray[np.void]] | None = None,
) -> None:
    """Fill an empty file with everything but histories, all rows pending.

    Parameters
    ----------
    file : h5py.File
        The file.
    attrs : mapping
        See `attributes`.
    rows : range
        Rows of the campaign that the file holds.
    errors : iterable of table ERROR
        Errors of these rows, in consecutive blocks.
    design : (len(rows),) table DESIGN, optional
        Variant, case and group of each row, for a study that lists its joints.
    origin : iterable of tables, optional
        How each row was drawn, in consecutive blocks, for methods that have `draw_records.columns`.
    """
    n = len(rows)
    put_attributes(file, dict(attrs) | {"first_row": rows.start})
    scale = file.create_dataset("row", (n,), "i8", dcpl=_allocated(None))
    for first in range(0, n, BLOCK):
        last = min(first + BLOCK, n)
        scale[first:last] = np.arange(rows.start + first, rows.start + last)
    scale.make_scale("row")
    put_attributes(scale, {"units": "1", "description": "row of the campaign: the joint's number"})
    if design is not None:
        create_table(file, "design", DESIGN_COLUMNS, n, [design])
    drawn = draw_records.columns(json.loads(str(attrs["sampling"])))
    if bool(drawn) != (origin is not None):
        raise ValueError("how the joints were drawn must be given for the methods that have columns for it, only")
    if drawn:
        create_table(file, "origin", drawn, n, origin)
    create_table(file, "results", selected_results.columns(json.loads(str(attrs["identity"]))), n)
    create_table(file, "ledger", (*LEDGER_COLUMNS, *history_check_columns(attrs)), n)
    session = file.create_dataset("session", (2,), "f8", dcpl=_allocated("f8", 0.0))
    put_attributes(session, {"units": "s, 1", "description": "of the run under way: start (Unix time), joints done"})
    create_table(file, "errors", ERROR_COLUMNS, n, _checked(file, rows, errors))
    seal(file)


def history_check_columns(attrs: Mapping[str, Any]) -> tuple[Column, ...]:
    """Columns of the ledger with the checksums of the kept histories."""
    return tuple(check_column(name) for name in json.loads(attrs["histories"]))


def check_column(history: str) -> Column:
    """Column of the ledger with the checksums of a history."""
    return Column(f"{history}_check", "1", f"CRC-32 of the joint's {history}", "u4", f"{history}_check", ())


def _checked(file: h5py.File, rows: range, errors: Iterable[NDArray[np.void]]) -> Iterator[NDArray[np.void]]:
    """Yield the blocks of `errors` unchanged, after writing their checksums."""
    first = 0
    for block in errors:
        here = slice(first, first + len(block))
        described = []
        for group, (columns, dtype) in descriptions(file).items():
            table = np.empty(len(block), dtype)
            for c in columns:
                c.of(table)[:] = file[group][c.name][here]
            described.append((columns, table))
        file["ledger/errors_check"][here] = errors_hash(rows.start + first, block, described)
        yield block
        first = here.stop


def descriptions(file: h5py.File) -> dict[str, tuple[tuple[Column, ...], np.dtype[np.void]]]:
    """Columns and dtypes of the tables that describe joints beside their errors, by HDF5 group.

    ``design`` has variant, case and group of each joint, ``origin`` how it was drawn; most campaigns have neither.
    """
    held = {"design": (DESIGN_COLUMNS, tables.DESIGN)} if "design" in file else {}
    if "origin" in file:
        sampling = json.loads(text(file.attrs, "sampling"))
        held["origin"] = (draw_records.columns(sampling), draw_records.dtype(sampling))
    return held


def create_table(
    file: h5py.File,
    name: str,
    columns: tuple[Column, ...],
    n: int,
    blocks: Iterable[NDArray[np.void]] | None = None,
    scale: h5py.Dataset | None = None,
) -> None:
    """Create a table: one contiguous dataset per column, which can be overwritten in place.

    Parameters
    ----------
    file : h5py.File
        File with the dimension scale ``row``.
    name : str
        Group of the datasets.
    columns : tuple of Column
        Columns of the table.
    n : int
        Number of rows.
    blocks : iterable of structured array, optional
        Values, in consecutive blocks of rows; without them floats are NaN and integers 0.
    scale : h5py.Dataset, optional
        Dimension scale of the rows; ``row`` of the file without it.
    """
    group, row = file.create_group(name), scale or file["row"]
    for c in columns:
        blank = np.nan if np.dtype(c.dtype).kind == "f" else 0
        dataset = group.create_dataset(
            c.name, (n,), c.dtype, dcpl=_allocated(c.dtype, blank if blocks is None else None)
        )
        dataset.dims[0].attach_scale(row)
        put_attributes(dataset, {"units": c.unit, "description": c.description})
    first = 0
    for block in blocks or ():
        for c in columns:
            group[c.name][first : first + len(block)] = c.of(block)
        first += len(block)
    if blocks is not None and first != n:
        raise ValueError(f"{first} rows of {name} given, {n} expected")


def _allocated(dtype: str | None, fill: float | None = None) -> h5py.h5p.PropDCID:
    """Creation properties of a dataset that is allocated, and filled with `fill` if given, when it is created."""
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER if fill is None else h5py.h5d.FILL_TIME_ALLOC)
    if fill is not None:
        properties.set_fill_value(np.array(fill, dtype))
    return properties


def get(dataset: h5py.Dataset, rows: NDArray[np.intp]) -> NDArray[Any]:
    """Values of the `rows` of a column, (m,)."""
    begin = rows.min()
    return np.asarray(dataset[begin : rows.max() + 1][rows - begin])


def put(dataset: h5py.Dataset, rows: NDArray[np.intp], values: NDArray[Any]) -> None:
    """Overwrite the `rows` of a column with `values`, (m,); consecutive rows are written in one piece."""
    ends = [*(np.flatnonzero(np.diff(rows) != 1) + 1), len(rows)]
    for begin, end in pairwise([0, *ends]):
        dataset[rows[begin] : rows[end - 1] + 1] = values[begin:end]


def open_hdf5(path: Path, mode: str) -> h5py.File:
    """Open an HDF5 file.

    Raises
    ------
    StoreError
        When the file is missing, not HDF5, damaged, not permitted or locked by a writer; the message says which.
    """
    if path.is_dir():
        raise store_error(path, "is a folder", "give the path of a file")
    if mode != "r" and path.is_file() and not h5py.is_hdf5(path):
        # h5py would turn an empty file that it opens for writing into an HDF5 file
        raise store_error(path, "is not an HDF5 file", "give a result file made by tolstat run")
    try:
        # Readers take no lock: a writer only changes numbers in place, so a campaign under way can be read.
        file = h5py.File(path, mode, locking=False if mode == "r" else "best-effort")
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


def store_error(path: Path, found: str, remedy: str) -> StoreError:
    """Return the error of a file: what is wrong, and the remedy."""
    return StoreError(str(Fault(str(path), found, remedy)))
