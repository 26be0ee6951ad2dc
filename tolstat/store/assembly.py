"""Make one result file from others: merge the files of slices, or add pending rows to a file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.files import atomic_write, check_disk_space, make_parent, reason
from tolstat.common.tables import Status
from tolstat.store.axes import attach_scales
from tolstat.store.histories import (
    HISTORY_BYTES,
    HistoryParts,
    create_dataset,
    create_group,
    parts_folder,
    rows_per_chunk,
)
from tolstat.store.integrity import seal
from tolstat.store.new_file import fill, size_of_new
from tolstat.store.reader import Reader
from tolstat.store.result_file import BLOCK, LINKED, campaign_digest, store_error


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
    attrs: Mapping[str, str | int],
    n: int,
    sources: Sequence[Reader],
    errors: Iterable[NDArray[np.void]],
    design: NDArray[np.void] | None = None,
    overwrite: bool = False,
    origin: Iterable[NDArray[np.void]] | None = None,
) -> None:
    """Create the result file of a whole campaign from files that hold parts of its rows.

    Parameters
    ----------
    path : Path
        The file to create. It is written under a temporary name and renamed when complete.
    attrs : mapping
        Attributes of the new file.
    n : int
        Number of rows of the campaign.
    sources : sequence of Reader
        Files with rows of the campaign; for a row in several files, a finished result takes precedence over pending.
    errors : iterable of table ERROR
        Errors of all rows, in consecutive blocks.
    design : (n,) table DESIGN, optional
        Variant, case and group of each row, for a study that lists its joints.
    overwrite : bool
        Whether to replace a file at `path`. If true, histories are written to the folder of parts beside the file,
        since rows are still pending; if false, into the file, and with histories every row must be finished.
    origin : iterable of tables, optional
        How each row was drawn, in consecutive blocks, for methods that have `draw_records.columns`.

    Raises
    ------
    DifferingResults
        When two sources hold different results of one row.
    StoreError
        When `path` exists and must not be replaced, or cannot be written.
    """
    new = max(0, n - sum(source.n for source in sources))
    size = size_of_new(new, sources[0].columns, len(sources[0].points)) + sum(
        one._file.id.get_filesize() for one in sources
    )
    try:
        make_parent(path)
        check_disk_space(path, size)
        with atomic_write(path, overwrite=overwrite) as temporary, h5py.File(temporary, "w") as file:
            fill(file, attrs, range(n), errors, design, origin)
            for source in (one for whole in sources for one in whole.each()):
                _copy_results(file, source)
            if overwrite:
                _histories_beside(path, file, n, sources)
            else:
                _histories_inside(file, n, sources)
            seal(file)
    except FileExistsError as error:
        raise store_error(path, "exists already", "give another file: --out OTHER.h5") from error
    except OSError as error:
        why = reason(error)
        raise store_error(
            path, f"cannot be written: {why}", "check that the folder is writable and the disk has space"
        ) from error


def _copy_results(file: h5py.File, source: Reader) -> None:
    """Copy finished rows, and compare the results of rows that are already finished in the file."""
    for first in range(0, source.n, BLOCK):
        own = slice(first, min(first + BLOCK, source.n))
        there = slice(source.row(own.start), source.row(own.stop))
        done = source.status(own) != Status.PENDING
        target = file[source._held().name]
        held = target["results/status"][there] != Status.PENDING
        both, new = done & held, done & ~held
        for name in (c.name for c in source.columns):
            dataset = target["results"][name]
            values, before = source.column("results", name, own), dataset[there]
            same = _bytes(values[both]) == _bytes(before[both])
            if not same.all():
                row = np.flatnonzero(both)[np.argmin(same.all(axis=1))]
                raise DifferingResults(int(there.start + row), name)
            before[new] = values[new]
            dataset[there] = before
        for name, dataset in target["ledger"].items():
            if name not in ("errors_check", *LINKED):
                dataset[there] = np.where(new, source.column("ledger", name, own), dataset[there])


def _bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Bytes of each value, (m, size), so that a NaN compares equal to the same NaN."""
    return values.view(np.uint8).reshape(len(values), values.itemsize)


def _history_blocks(source: Reader) -> Iterator[tuple[str, NDArray[np.intp]]]:
    """Yield the name of a history and file slots of `source`, about `HISTORY_BYTES` of data at a time."""
    for name, spec in source.history_specs.items():
        chunk = rows_per_chunk(spec, source.n)
        size = chunk * max(1, HISTORY_BYTES // (chunk * spec.blank(1).nbytes))
        for first in range(0, source.n, size):
            yield name, np.arange(first, min(first + size, source.n))


def _histories_inside(file: h5py.File, n: int, sources: Sequence[Reader]) -> None:
    specs = sources[0].history_specs
    if not specs:
        return
    for of_point in zip(*(source.each() for source in sources), strict=True):
        group = create_group(file[of_point[0]._held().name])
        for name, spec in specs.items():
            attach_scales(create_dataset(group, name, n, spec), file["row"], spec)
        for source in of_point:
            for name, slots in _history_blocks(source):
                begin = source.row(int(slots[0]))
                group[name][begin : begin + len(slots)] = source.histories(name, slots)


def _histories_beside(path: Path, file: h5py.File, n: int, sources: Sequence[Reader]) -> None:
    specs = sources[0].history_specs
    if not specs:
        return
    size = max(1, HISTORY_BYTES // sum(spec.blank(1).nbytes for spec in specs.values()))
    for of_point in zip(*(source.each() for source in sources), strict=True):
        parts = HistoryParts(parts_folder(path) / (of_point[0].point or ""), n, specs, campaign_digest(file))
        parts.remove()  # left by an attempt that was killed: the file at `path` has its histories inside
        for source in of_point:
            for first in range(0, source.n, size):
                slots = np.arange(first, min(first + size, source.n))
                parts.add(source.row(slots), {name: source.histories(name, slots) for name in specs})


def check_free(path: Path) -> None:
    """Check that a new result file can be made.

    Raises
    ------
    StoreError
        When the file or a folder of its histories exists.
    """
    if path.exists():
        raise store_error(path, "exists already", "give another file: --out OTHER.h5")
    if parts_folder(path).exists():
        raise store_error(
            parts_folder(path), "holds histories of another campaign", "give another file: --out OTHER.h5"
        )
