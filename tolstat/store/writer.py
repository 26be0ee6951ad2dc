"""Writer of a result file: create it, open it to resume, write blocks of joints, finish.

All datasets have their full size when the file is created. From then on only numbers inside them change and none of
HDF5's own structures, so a process killed at any moment leaves a file that can be read. Values are on disk before the
status that declares them valid. Larger changes, such as editing limits between two runs, write a new file that replaces
the old one.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.fields import HistorySpec
from tolstat.common.files import atomic_write, check_disk_space, make_parent, reason
from tolstat.common.tables import Options, Simulation, Status
from tolstat.store import checksums, layout, metadata
from tolstat.store.checksums import ROWS, blocks_of
from tolstat.store.hdf5 import copy_open, is_at, open_hdf5, put, replace, store_error
from tolstat.store.layout import Tables
from tolstat.store.lock import writing
from tolstat.store.metadata import Metadata
from tolstat.store.reader import Reader
from tolstat.study import Study

STRUCTURES = 1 << 14
"""Bytes that HDF5 takes at a time for its structures: with its 2 kB, columns of a kB or more waste as much again."""
KEPT = "and run the same command again; finished joints are kept"


class Writer(Reader):
    """A result file that is open for writing, made by `create` or `open`; it reads as its base class does."""

    _written: NDArray[np.bool_]
    """Blocks whose checksums are out of date, at any operating point."""
    _held: ExitStack
    """The file's lock."""

    @classmethod
    def create(
        cls,
        path: str | Path,
        study: Study,
        errors: Iterable[NDArray[np.void]],
        histories: Mapping[str, HistorySpec] | None = None,
        rows: range | None = None,
        options: Options | None = None,
        fidelity: Mapping[str, Any] | None = None,
        origin: Iterable[NDArray[np.void]] | None = None,
    ) -> Self:
        """Create the file of a new campaign, or of a slice of it, all rows pending, and open it for writing.

        Parameters
        ----------
        path : str or Path
            The file; must not exist.
        study : Study
            The study; its text and settings become metadata of the file.
        errors : iterable of table ERROR
            Errors of every joint of the file, in consecutive blocks of rows.
        histories : mapping of str to HistorySpec, optional
            Load histories to keep.
        rows : range, optional
            Rows of the campaign that the file holds; all without it.
        options, fidelity : Options and mapping, optional
            Settings that ``solver.fidelity = "auto"`` chose, and the record of that choice.
        origin : iterable of tables, optional
            How the joints were drawn, in consecutive blocks, for methods that have `columns.drawn_columns`.

        Raises
        ------
        StoreError
            When the file exists or cannot be written.
        """
        rows = range(study.rows) if rows is None else rows
        document = metadata.of_study(study, rows, histories or {}, options, fidelity)
        tables = {"errors": errors}
        if study.variants:
            tables["design"] = [study.design[rows.start : rows.stop]]
        if origin is not None:
            tables["origin"] = origin
        exists = "resume it with its own study, or give another file: --out OTHER.h5"
        write_new(Path(path), document, exists, tables)
        return cls.open(path)

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Open a result file for writing, by one process at a time; joints with damaged results become pending.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises
        ------
        StoreError
            When it is not a result file of this schema version, is damaged, or is being written by another
            process.
        """
        with ExitStack() as held:
            held.enter_context(writing(Path(path)))
            store = cls._opened(Path(path), "r+")
            held.callback(lambda: store._checked.close())
            store._verify()
            store._held = held.pop_all()
        return store

    def _verify(self) -> None:
        """Compare everything with its checksums: errors must match, joints with damaged results become pending."""
        damaged_blocks = self._checked.check()
        self._written = np.full(blocks_of(self.n), self._checked.number % 2 == 1)
        for path in damaged_blocks:
            if not layout.is_at_point(path):
                self._refuse(path, damaged_blocks[path])
        block = np.arange(self.n) // ROWS
        for at_point in self.each():
            places = [layout.path_of(at_point.point or "", group, "") for group in layout.AT_POINTS]
            of_point = [blocks for path, blocks in damaged_blocks.items() if path.rpartition("/")[0] in places]
            damaged = np.unique(np.concatenate([np.empty(0, np.intp), *of_point]))
            if damaged.size:
                at_point._left_out.update(damaged.tolist())
                ledger = damaged_blocks.get(layout.path_of(at_point.point or "", "ledger", "attempt"), damaged[:0])
                rows, again = (np.flatnonzero(np.isin(block, which)) for which in (damaged, ledger))
                at_point._begin_writing(rows)
                put(at_point._place("results"), rows, {"status": np.full(rows.size, Status.PENDING, np.uint8)})
                # attempts that are damaged: again with the study's settings
                put(at_point._place("ledger"), again, {"attempt": np.zeros(again.size, np.int32)})
                at_point._sync()
        self._tell("pending again", "run its study to simulate these joints: tolstat run STUDY")

    def close(self) -> None:
        """Write the checksums if anything was written, and close the file."""
        with self._held:
            if self.is_open:
                self.finish()

    def release(self) -> None:
        """Close the file, which stays locked until `close`: Windows replaces no file that is open."""
        self._checked.close()

    def write(self, rows: NDArray[np.intp], simulation: Simulation) -> None:
        """Write the results of `rows` at the operating point; on return they are on disk and no longer pending.

        Parameters
        ----------
        rows : (m,) array of int
            File slots.
        simulation : Simulation
            Results of these joints, and their histories if the campaign keeps them.

        Raises
        ------
        StoreError
            When the file cannot be written, e.g. because the disk is full.
        """
        results, histories = simulation
        expected = {name: (len(rows), *spec.shape) for name, spec in self.history_specs.items()}
        shapes = {name: values.shape for name, values in histories.items()}
        if len(results) != len(rows) or shapes != expected or np.any(results["status"] == Status.PENDING):
            raise ValueError("each row of a block needs a result that is not pending, and the histories of the file")
        columns = {c.name: c.of(results) for c in self.columns}
        status = {"status": columns.pop("status")}
        with self._told("cannot be written", "free disk space, " + KEPT):
            self._begin_writing(rows)
            put(self._place("results"), rows, columns)
            if histories:
                put(self._place("histories"), rows, histories)
            self._sync()
            put(self._place("results"), rows, status)
            self._sync()
            self._check_path()

    def begin_session(self, done: int) -> None:
        """Record for readers of the file that a run begins with `done` joints finished."""
        self._begin_writing(np.empty(0, np.intp))
        self._put_session(done, time.time())

    def finish(self) -> None:
        """Record that the run is over, and write the checksums of what it has written."""
        if self._checked.number % 2:
            checksums.update(self._checked.file, self.metadata, True, np.flatnonzero(self._written))
            self._sync()
            self._written[:] = False
            self._put_session(0, np.nan, self._checked.number + 1)

    def change(self, change: Callable[[h5py.File], None] = lambda file: None, **values: Any) -> None:
        """Give the file other metadata, such as limits or the outcome of a stop rule, unless it has these already.

        Parameters
        ----------
        change : callable
            Called with the changed copy of the file, open for writing.
        values
            Fields of `Metadata`.

        Raises
        ------
        StoreError
            When there is no room for a second copy of the file.
        """
        document = self.metadata.model_copy(update=values)
        if document == self.metadata:
            return

        def both(file: h5py.File) -> None:
            layout.describe(file, document)
            change(file)

        self.replace(both)
        self._describe(document)

    def mark_pending(self, rows: Mapping[str, NDArray[np.intp]], entry: Mapping[str, Any]) -> None:
        """Mark joints as pending that are to be simulated again, with the settings of `entry`.

        Parameters
        ----------
        rows : mapping of str to (m,) array of int
            File slots, by operating point.
        entry : mapping
            Entry added to `retries`; ``options`` are the solver options.

        Raises
        ------
        StoreError
            When there is no room for a second copy of the file.
        """
        retries = (*self.retries, dict(entry))

        def mark(file: h5py.File) -> None:
            file["session"]["number"][()] = self._checked.number | 1  # its checksums no longer hold
            for point, slots in rows.items():
                number, pending = len(retries), np.full(slots.size, Status.PENDING, np.uint8)
                attempt = {"attempt": np.full(slots.size, number, np.int32)}
                put(file[layout.path_of(point, "ledger", "")], slots, attempt)
                put(file[layout.path_of(point, "results", "")], slots, {"status": pending})

        for slots in rows.values():
            self._written[slots // ROWS] = True
        self.change(mark, retries=retries)

    def replace(self, change: Callable[[h5py.File], None], growth: int = 0) -> None:
        """Change the structure of the file by way of a copy that takes its place.

        Parameters
        ----------
        change : callable
            Called with the copy, open for writing.
        growth : int
            Approximate number of bytes by which it enlarges the copy.

        Raises
        ------
        StoreError
            When there is no room for a second copy of the file.
        """
        with self._told("cannot be replaced", "free disk space for a second copy, " + KEPT):
            try:
                replace(self.path, self._checked.file, change, growth)
            finally:
                if not self._checked.is_open:
                    self._checked.use(open_hdf5(self.path, "r+"), self.metadata)

    def _begin_writing(self, rows: NDArray[np.intp]) -> None:
        """Tell readers, on the disk, that checksums of results do not hold until `finish`."""
        self._written[np.unique(rows // ROWS)] = True
        if self._checked.number % 2 == 0:
            self._put_session(0, np.nan, self._checked.number + 1)

    def _put_session(self, done: int, started: float, number: int | None = None) -> None:
        session = self._checked.file["session"]
        session["done"][()], session["started"][()] = done, started
        if number is not None:
            session["number"][()] = number
        self._sync()

    def _place(self, group: str) -> h5py.Group:
        return self._checked.file[layout.path_of(self._point(), group, "")]

    def _sync(self) -> None:
        self._checked.file.flush()
        os.fsync(self._checked.file.id.get_vfd_handle())

    def _check_path(self) -> None:
        """Restore the file if it was deleted or replaced; its contents exist as long as it is open.

        Raises
        ------
        StoreError
            When the file was deleted or replaced.
        """
        if is_at(self._checked.file, self.path):
            return
        taken = self.path.exists()
        path = self.path.with_name(f"{self.path.stem}.saved{self.path.suffix}") if taken else self.path
        with atomic_write(path, overwrite=False) as temporary:
            copy_open(self._checked.file, temporary)
        found = "was replaced by another file" if taken else "was deleted"
        remedy = f"{path} holds all finished joints; to resume, run the same command again"
        remedy += f" with --out {path}" if taken else ""
        raise store_error(self.path, f"{found} during the campaign", remedy)

    @contextmanager
    def _told(self, found: str, remedy: str) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise store_error(self.path, f"{found}: {reason(error)}", remedy) from error


def write_new(
    path: Path,
    document: Metadata,
    exists: str,
    tables: Tables,
    fill: Callable[[h5py.File], None] | None = None,
    overwrite: bool = False,
) -> None:
    """Write a whole result file under a temporary name and rename it when it is complete.

    Parameters
    ----------
    path : Path
        The file.
    document : Metadata
        Its metadata.
    exists : str
        Remedy if the file exists.
    tables : Tables
        See `layout.create`.
    fill : callable, optional
        Called with the file, to write results to it; their checksums are written then.
    overwrite : bool
        Whether to replace a file at `path`.

    Raises
    ------
    StoreError
        When the file exists and must not be replaced, or cannot be written.
    """
    if not overwrite:
        check_free(path, exists)
    try:
        make_parent(path)
        check_disk_space(path, layout.size_of(document))
        with (
            atomic_write(path, overwrite=overwrite) as temporary,
            h5py.File(temporary, "w", meta_block_size=STRUCTURES) as file,
        ):
            layout.create(file, document, tables)
            checksums.create(file, document)
            if fill is not None:
                fill(file)
                checksums.update(file, document, True, np.arange(blocks_of(document.n)))
                file["session"]["number"][()] = 2
    except FileExistsError as error:
        raise store_error(path, "exists already", exists) from error
    except OSError as error:
        remedy = "check that the folder is writable and the disk has space"
        raise store_error(path, f"cannot be written: {reason(error)}", remedy) from error


def check_free(path: Path, remedy: str) -> None:
    """Refuse a path of an existing file before anything is done that takes long.

    Raises
    ------
    StoreError
        When there is a file.
    """
    if path.exists():
        raise store_error(path, "exists already", remedy)
