"""The result file of a campaign: errors, results and status of every joint; pending rows are the ones still to do.

Everything except histories lies in datasets of fixed size, written in full when the file is created. From then
on only numbers inside these datasets change and none of HDF5's own structures, so a process killed at any moment
leaves a file that can be read. Values are on disk before the status that declares them valid. Larger changes, such as
adding histories at the end or editing limits between two runs, write a new file that replaces the old one.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common import selected_results
from tolstat.common.files import atomic_write, check_disk_space, make_parent, reason
from tolstat.common.tables import HistorySpec, Options, Simulation, Status
from tolstat.store import left_out
from tolstat.store.histories import HISTORY_BYTES, parts_folder
from tolstat.store.integrity import attempt_hash, history_checks, results_hash, seal
from tolstat.store.new_file import attributes, fill, size_of_new, study_attributes
from tolstat.store.reader import Reader
from tolstat.store.result_file import copy_open, get, is_at, put, put_attributes, replace, store_error, text

if TYPE_CHECKING:
    from tolstat.study import Study


class ResultStore(Reader):
    """A result file that is open for writing, made by `create` or `open_to_write`.

    It reads as its base class `Reader` does.
    """

    @classmethod
    def create(
        cls,
        path: str | Path,
        study: Study,
        errors: NDArray[np.void] | Iterable[NDArray[np.void]],
        histories: Mapping[str, HistorySpec] | None = None,
        dimensions: Mapping[str, int] | None = None,
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
            The study; its text and settings become attributes of the file.
        errors : (n,) table ERROR, or iterable of tables
            Errors of every joint of the file, as one table or as consecutive blocks of rows.
        histories : mapping of str to HistorySpec, optional
            Load histories to keep.
        dimensions : mapping of str to int, optional
            Dimension of the sampling sequence that each error is drawn from.
        rows : range, optional
            Rows of the campaign that the file holds; all without it.
        options, fidelity : Options and mapping, optional
            Settings that ``solver.fidelity = "auto"`` chose, and the record of that choice.
        origin : iterable of tables, optional
            How the joints were drawn, in consecutive blocks, for methods that have `draw_records.columns`.

        Raises
        ------
        StoreError
            When the file or the parts of an earlier one exist, or the file cannot be written.
        """
        path = Path(path)
        specs = {name: HistorySpec(*spec) for name, spec in (histories or {}).items()}
        parts = parts_folder(path)
        if parts.exists():
            raise store_error(parts, "holds histories of another campaign", "give another file: --out OTHER.h5")
        held = range(study.rows) if rows is None else rows
        try:
            make_parent(path)
            kept = selected_results.columns(study.identity())
            check_disk_space(path, size_of_new(len(held), kept, len(study.points)))
            with atomic_write(path, overwrite=False) as temporary, h5py.File(temporary, "w") as file:
                blocks = [errors] if isinstance(errors, np.ndarray) else errors
                design = study.design[held.start : held.stop] if study.variants else None
                attrs = attributes(study, specs, dimensions or {}, options, fidelity)
                fill(file, attrs, held, blocks, design, origin)
                seal(file)
        except FileExistsError as error:
            raise store_error(
                path, "exists already", "resume it with its own study, or give another file: --out OTHER.h5"
            ) from error
        except OSError as error:
            why = reason(error)
            remedy = "check that the folder is writable and the disk has space"
            raise store_error(path, f"cannot be written: {why}", remedy) from error
        return cls.open_to_write(path)

    @classmethod
    def open_to_write(cls, path: str | Path) -> Self:
        """Open a result file for writing, by one process at a time.

        Rows with damaged results or missing histories become pending.

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
        store = cls._opened(Path(path), "r+")
        for one in store.each():
            damaged = one.damaged()
            store._left_out[damaged] = True
            one._make_pending(damaged)
            one._reset_rows_without_histories()
        left_out.tell(store, "pending again", "run its study to simulate these joints: tolstat run STUDY")
        return store

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
        results = simulation.results
        if len(results) != len(rows):
            raise ValueError(f"{len(results)} results for {len(rows)} rows")
        if np.any(results["status"] == Status.PENDING):
            raise ValueError("a simulated joint must not have the status PENDING")
        try:
            if self.history_specs:
                self._parts.add(rows, simulation.histories)
            kept = {c.name: c.of(results) for c in self.columns}
            status = {"status": kept.pop("status")}
            put(self._held()["results"], rows, kept)
            self._put_checksums(rows, simulation)
            self._sync()
            put(self._held()["results"], rows, status)
            self._sync()
            self._check_path()
        except OSError as error:
            why = reason(error)
            remedy = "free disk space, and run the same command again; finished joints are kept"
            raise store_error(self.path, f"cannot be written: {why}", remedy) from error

    def begin_session(self, done: int) -> None:
        """Record for readers of the file that a run begins with `done` joints finished."""
        session = self._file["session"]
        session["done"][()] = done
        session["started"][()] = time.time()
        self._sync()

    def end_session(self) -> None:
        """Record that the run is over; after a killed run, readers infer this from the missing lock (`session`)."""
        session = self._file["session"]
        session["started"][()] = np.nan
        session["done"][()] = 0
        self._sync()

    def finish(self) -> None:
        """Copy the histories of a complete campaign into the file and delete the parts.

        Does nothing while rows are pending, or when the histories are in the file already.

        Raises
        ------
        StoreError
            When the disk has no room for the histories, or some of them are missing.
        """
        if not self.history_specs or not self.complete:
            return
        left = [one for one in self.each() if "histories" not in one._held()]

        def gather(file: h5py.File) -> None:
            for one in left:
                one._parts.gather_into(file[one._held().name])

        if left:
            self._replace(gather, sum(one._parts.size() for one in left))
        for one in self.each():
            one._parts.remove()

    def update_study(self, study: Study) -> None:
        """Replace the attributes that do not affect results (limits, text, name) by those of a study of equal identity.

        Does nothing if the file has them already.

        Raises
        ------
        StoreError
            When there is no room for a second copy of the file.
        """
        wanted = study_attributes(study)
        if any(text(self._file.attrs, name) != value for name, value in wanted.items()):
            self._replace(lambda file: put_attributes(file, wanted))
            self._read_study_attributes()

    def record_stop(self, stop: Mapping[str, Any]) -> None:
        """Record why the campaign ends before all rows are simulated; does nothing if `stop` is recorded already.

        Raises
        ------
        StoreError
            When there is no room for a second copy of the file.
        """
        if self.stop != stop:
            self._replace(lambda file: put_attributes(file, {"stop": json.dumps(stop, allow_nan=False)}))
            self.stop = dict(stop)

    def begin_retry(self, rows: Mapping[str, NDArray[np.intp]], entry: Mapping[str, Any]) -> None:
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
        retries = [*self.retries, dict(entry)]
        each = [(self.at(point), slots) for point, slots in rows.items() if slots.size]

        def change(file: h5py.File) -> None:
            put_attributes(file, {"retries": json.dumps(retries, allow_nan=False)})
            for one, slots in each:
                held = file[one._held().name]
                ledger, attempt = held["ledger"], np.full(slots.size, len(retries), np.int32)
                check = attempt_hash(get(ledger["errors_check"], slots), attempt)
                put(ledger, slots, {"attempt": attempt, "attempt_check": check})
                put(held["results"], slots, {"status": np.full(slots.size, Status.PENDING, np.uint8)})
                if "histories" in held:
                    del held["histories"]

        for one, _ in each:
            one._move_histories_beside()
        self._replace(change)
        self.retries = retries

    def _move_histories_beside(self) -> None:
        """Copy the histories inside the file, if they are there, to the folder of parts."""
        if "histories" not in self._held():
            return
        self._parts.remove()  # left by an earlier call that was interrupted
        size = max(1, HISTORY_BYTES // sum(spec.blank(1).nbytes for spec in self.history_specs.values()))
        for first in range(0, self.n, size):
            some = np.arange(first, min(first + size, self.n))
            self._parts.add(some, {name: self.histories(name, some) for name in self.history_specs})

    def _replace(self, change: Callable[[h5py.File], None], growth: int = 0) -> None:
        try:
            self._handle.file = replace(self.path, self._file, change, growth)
        except OSError as error:
            why = reason(error)
            remedy = "free disk space for a second copy, and run the same command again; finished joints are kept"
            raise store_error(self.path, f"cannot be replaced: {why}", remedy) from error

    def _check_path(self) -> None:
        """Restore the file if it was deleted or replaced; its contents exist as long as it is open.

        Raises
        ------
        StoreError
            When the file was deleted or replaced.
        """
        if is_at(self._file, self.path):
            return
        taken = self.path.exists()
        path = self.path.with_name(f"{self.path.stem}.saved{self.path.suffix}") if taken else self.path
        with atomic_write(path, overwrite=False) as temporary:
            copy_open(self._file, temporary)
        found = "was replaced by another file" if taken else "was deleted"
        remedy = f"{path} holds all finished joints; to resume, run the same command again"
        remedy += f" with --out {path}" if taken else ""
        raise store_error(self.path, f"{found} during the campaign", remedy)

    def _put_checksums(self, rows: NDArray[np.intp], simulation: Simulation) -> None:
        ledger = self._held()["ledger"]
        histories, own = simulation.histories, self.row(rows)
        checks: dict[str, Any] = {f"{name}_check": history_checks(histories[name], own) for name in self.history_specs}
        errors, attempt = (get(ledger[name], rows) for name in ("errors_check", "attempt"))
        checks["results_check"] = results_hash(errors, attempt, simulation.results, self.columns)
        put(ledger, rows, checks)

    def _sync(self) -> None:
        self._file.flush()
        os.fsync(self._file.id.get_vfd_handle())

    def _reset_rows_without_histories(self) -> None:
        """Mark rows as pending whose histories are missing, e.g. because the file was moved without its parts."""
        if not self.history_specs or "histories" in self._held():
            return
        part = self._parts.index().part
        self._make_pending(np.flatnonzero((part < 0) & (self.status() != Status.PENDING)))

    def _make_pending(self, rows: NDArray[np.intp]) -> None:
        if rows.size:
            put(self._held()["results"], rows, {"status": np.full(rows.size, Status.PENDING, np.uint8)})
            self._sync()
