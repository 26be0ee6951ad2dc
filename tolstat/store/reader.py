"""Reading a result file: its attributes, its tables and the status of its joints."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common import selected_results, tables
from tolstat.common.columns import ERROR_COLUMNS, LEDGER_COLUMNS, Column
from tolstat.common.errors import StoreError
from tolstat.common.tables import Status, Variant
from tolstat.store import checks, integrity
from tolstat.store.counts import Counts
from tolstat.store.frame import to_pandas, to_xarray
from tolstat.store.histories import HistoryParts
from tolstat.store.numbering import Numbering
from tolstat.store.result_file import (
    BLOCK,
    RUN_AGAIN,
    campaign_digest,
    descriptions,
    is_locked,
    open_hdf5,
    store_error,
    text,
)

if TYPE_CHECKING:
    import pandas as pd
    import xarray


class Session(NamedTuple):
    """A run under way: when it started (Unix time, s), and how many joints were done by then."""

    started: float
    done: int


class Reader(Numbering):
    """Read access to an open result file; see `ResultStore`."""

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path = path
        self._file = file
        attrs = file.attrs
        checks.check_schema(path, file)
        self._read_study_attributes()
        self.created = text(attrs, "created")
        self.git_commit = text(attrs, "git_commit")
        self.identity = checks.mapping(file, "identity")
        self.columns = selected_results.columns(self.identity)
        self.joint = checks.mapping(file, "joint")
        self.options = checks.mapping(file, "options")
        self.sampling = checks.mapping(file, "sampling")
        self.fidelity = checks.mapping(file, "fidelity") if "fidelity" in attrs else {}
        self.versions: dict[str, str] = checks.mapping(file, "versions")
        self.retries: list[dict[str, Any]] = json.loads(text(attrs, "retries"))
        self.stop: dict[str, Any] = checks.mapping(file, "stop") if "stop" in attrs else {}
        design = checks.mapping(file, "design")
        self.case_names: tuple[str, ...] = tuple(design["cases"])
        self.variants = tuple(Variant(**variant) for variant in design["variants"])
        self.history_specs = checks.history_specs(file)
        self.n = checks.check_tables(file)
        first = checks.integer(file, "first_row", 0)
        self.rows = range(first, first + self.n)
        self.campaign_rows = checks.integer(file, "campaign_rows", self.n)
        if self.rows.stop > self.campaign_rows:
            raise ValueError(f"rows {first}:{self.rows.stop} of a campaign of {self.campaign_rows}")
        checks.check_histories(file, self.history_specs, self.n)
        self._parts = HistoryParts(parts_folder(path), self.n, self.history_specs, campaign_digest(file))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def complete(self) -> bool:
        """Whether no row is pending."""
        return next(self.pending_blocks(), None) is None

    @property
    def whole(self) -> bool:
        """Whether the file holds all rows of its campaign, not a slice."""
        return self.rows == range(self.campaign_rows)

    def status(self, rows: slice = slice(None)) -> NDArray[np.uint8]:
        """Status of the joints, (n,), or of a slice of file slots; joints whose row is damaged are PENDING.

        Raises
        ------
        StoreError
            When a status is unknown to this version.
        """
        if self._file.mode != "r":
            return self._status(rows)  # opening for writing has already marked damaged rows as pending
        first, last, _ = rows.indices(self.n)
        blocks = (slice(begin, min(begin + BLOCK, last)) for begin in range(first, last, BLOCK))
        return np.concatenate([np.empty(0, np.uint8), *map(self._status_if_intact, blocks)])

    def damaged(self) -> NDArray[np.intp]:
        """File slots whose results do not match their checksums, as after an interrupted write or a disk fault."""
        found = [np.empty(0, np.intp)]
        for first in range(0, self.n, BLOCK):
            rows = slice(first, first + BLOCK)
            done = self._status(rows) != Status.PENDING
            if done.any():
                found.append(first + np.flatnonzero(done & ~self._intact(rows, self._results(rows))))
        return np.concatenate(found)

    def counts(self) -> Counts:
        """Count the joints of the file by status."""
        counts = Counts(self.n, 0, 0, 0)
        for first in range(0, self.n, BLOCK):
            counts = counts.after(self.status(slice(first, first + BLOCK)))
        return counts

    def session(self) -> Session | None:
        """Return the run under way; None if no process is writing the file."""
        if "session" not in self._file or not is_locked(self.path):
            return None
        started, done = np.asarray(self._file["session"][:])
        return Session(float(started), int(done)) if started > 0 else None

    def pending(self) -> NDArray[np.intp]:
        """File slots still to be simulated, ascending."""
        return np.concatenate([np.empty(0, np.intp), *self.pending_blocks()])

    def pending_blocks(self) -> Iterator[NDArray[np.intp]]:
        """Yield the file slots still to be simulated, ascending, in non-empty arrays of at most `BLOCK`."""
        for first in range(0, self.n, BLOCK):
            found = np.flatnonzero(self.status(slice(first, first + BLOCK)) == Status.PENDING)
            if found.size:
                yield found + first

    def design(self) -> NDArray[np.void]:
        """Variant, case and group of every joint, (n,) table DESIGN.

        Raises
        ------
        StoreError
            When all rows have the study's joint, or the table is damaged.
        """
        if "design" not in self._file:
            remedy = 'give the result file of a study with sampling.method = "cases", or of a sweep of dimensions'
            raise store_error(self.path, "has no list of variants", remedy)
        table = self._described("design", slice(None))
        for name, end in (("variant", len(self.variants)), ("case", len(self.case_names) or 1)):
            if table[name].min() < 0 or table[name].max() >= end:
                found = f"is damaged: design/{name} is not between 0 and {end - 1}"
                raise store_error(self.path, found, RUN_AGAIN)
        self._check_errors(slice(None), self._errors(slice(None)))
        return table

    def origin(self, rows: slice = slice(None)) -> NDArray[np.void]:
        """How every joint was drawn, (n,) table with the columns `draw_records.columns`, or of a slice of file slots.

        Raises
        ------
        StoreError
            When the sampling method has no such table, or it is damaged.
        """
        if "origin" not in self._file:
            remedy = 'give a result file with sampling.method = "importance", or of tolstat rare'
            raise store_error(self.path, "has no record of how its joints were drawn", remedy)
        self.errors(rows)  # checks this table too: it enters the checksums of the errors
        return self._described("origin", rows)

    def errors(self, rows: slice = slice(None), fields: Sequence[str] | None = None) -> NDArray[np.void]:
        """Errors of every joint, (n,) table ERROR, or of a slice of file slots.

        With `fields` the table has these only: all fields are read and checked in blocks, the others then dropped.

        Raises
        ------
        StoreError
            When the errors are damaged.
        """
        if fields is not None:
            return self._in_blocks(self.errors, rows, tables.ERROR, fields)
        table = self._errors(rows)
        self._check_errors(rows, table)
        return table

    def results(self, rows: slice = slice(None), fields: Sequence[str] | None = None) -> NDArray[np.void]:
        """Results of every joint, (n,) table RESULT, or of a slice of file slots.

        A joint whose row is damaged is PENDING. Results of pending joints are NaN (integers 0), as are columns that
        the campaign does not keep. With `fields` the table has these only, as in `errors`.

        Raises
        ------
        StoreError
            When a status is unknown to this version.
        """
        if fields is not None:
            return self._in_blocks(self.results, rows, tables.RESULT, fields)
        table = self._results(rows)
        broken = (table["status"] == Status.PENDING) | ~self._intact(rows, table)
        for field in tables.RESULT_FIELDS:
            table[field.name][broken] = np.nan if np.dtype(field.dtype).kind == "f" else 0
        self._check_status(table["status"])
        return table

    def attempt(self, rows: slice = slice(None)) -> NDArray[np.int32]:
        """Attempt that each joint's results belong to, (n,): 0 for the study's settings, k for ``retries[k - 1]``."""
        return np.asarray(self.column("ledger", "attempt", rows))

    def histories(self, name: str, rows: NDArray[np.intp] | None = None) -> NDArray[Any]:
        """Read the histories of one kind.

        Parameters
        ----------
        name : str
            One of `history_specs`.
        rows : (m,) array of int, optional
            File slots to read; all without it.

        Returns
        -------
        (m, ...) array
            NaN for joints that are pending or have no results.

        Raises
        ------
        StoreError
            When the file holds no such histories, or those of finished joints are missing or damaged.
        """
        if name not in self.history_specs:
            held = ", ".join(self.history_specs) or "none"
            remedy = f'write histories = "full" or "harmonics" in [output] of the study, and {RUN_AGAIN}'
            raise store_error(self.path, f"holds no histories {name!r} (it holds: {held})", remedy)
        rows = np.arange(self.n) if rows is None else np.asarray(rows, dtype=np.intp)
        if "histories" not in self._file:
            done = self.status()[rows] != Status.PENDING  # read first: histories are written before the status
            try:
                values = self._parts.read(name, rows, done)
                self._check_history(name, rows, values, done)
                return values
            except StoreError:
                if not self._reopen():
                    raise
        unique, back = np.unique(rows, return_inverse=True)
        values = np.asarray(self.column("histories", name, unique))
        self._check_history(name, unique, values, np.ones(len(unique), bool))
        return values[back]

    def to_pandas(self, units: bool = False) -> pd.DataFrame:
        """Export errors and results as one DataFrame, one row per joint, pending and failed joints included.

        Parameters
        ----------
        units : bool
            Give the columns a second level with the SI unit.

        Returns
        -------
        pandas.DataFrame
            Index ``row``: row of the campaign. Columns: case, variant, family and group for a study that lists its
            joints; how each joint was drawn, where that is recorded; errors; kept results, ``status`` as text.
        """
        return to_pandas(self, units)

    def to_xarray(self) -> xarray.Dataset:
        """Export errors and results along ``row``, with units and descriptions; raises InputError without xarray."""
        return to_xarray(self)

    def _read_study_attributes(self) -> None:
        attrs = self._file.attrs
        self.study_name = text(attrs, "study_name")
        self.study_text = text(attrs, "study")
        self.limits: dict[str, float] = json.loads(text(attrs, "limits"))

    def _reopen(self) -> bool:
        """Switch to the file that has replaced this one and includes the histories; return whether there is one."""
        if self._file.mode != "r":
            return False
        file = open_hdf5(self.path, "r")
        if "histories" not in file or campaign_digest(file) != self._parts.campaign:
            file.close()
            return False
        self._file.close()
        self._file = file
        return True

    def _status(self, rows: slice) -> NDArray[np.uint8]:
        found = np.asarray(self.column("results", "status", rows))
        self._check_status(found)
        return found

    def _status_if_intact(self, rows: slice) -> NDArray[np.uint8]:
        found = self._status(rows)
        # any(): PENDING is 0; copy(): a view would keep the whole table of the block in memory
        return self.results(rows)["status"].copy() if found.any() else found

    def _check_status(self, found: NDArray[np.uint8]) -> None:
        if found.size and found.max() > max(Status):
            raise store_error(self.path, f"is damaged: a joint has the unknown status {found.max()}", RUN_AGAIN)

    def _described(self, group: str, rows: slice) -> NDArray[np.void]:
        return self._read(group, *descriptions(self._file)[group], rows)

    def _errors(self, rows: slice) -> NDArray[np.void]:
        return self._read("errors", ERROR_COLUMNS, tables.ERROR, rows)

    def _results(self, rows: slice) -> NDArray[np.void]:
        table = self._read("results", self.columns, tables.RESULT, rows)
        selected_results.blank_others(table, self.columns)
        return table

    def _intact(self, rows: slice, results: NDArray[np.void]) -> NDArray[np.bool_]:
        """Whether rows match their checksums, (m,); checksums are read after the values, the order of writing."""
        attempt, errors, held = (self.column("ledger", c.name, rows) for c in LEDGER_COLUMNS)
        return np.asarray(integrity.results_hash(errors, attempt, results, self.columns) == held)

    def _check_errors(self, rows: slice, errors: NDArray[np.void]) -> None:
        first = self.row(rows.indices(self.n)[0])
        described = [(c, self._read(name, c, dtype, rows)) for name, (c, dtype) in descriptions(self._file).items()]
        right = integrity.errors_hash(first, errors, described) == self.column("ledger", "errors_check", rows)
        if not right.all():
            found = f"is damaged: the errors of row {first + int(np.argmin(right))} do not match their checksum"
            raise store_error(self.path, found, f"restore a copy of the file, or {RUN_AGAIN}")

    def _check_history(self, name: str, rows: NDArray[np.intp], values: NDArray[Any], done: NDArray[np.bool_]) -> None:
        held = self.column("ledger", f"{name}_check", slice(None))[rows[done]]
        wrong = integrity.history_checks(values[done], self.row(rows[done])) != held
        if wrong.any():
            row = self.rows[rows[done][np.argmax(wrong)]]
            found = f"is damaged: the history {name} of row {row} does not match its checksum"
            raise store_error(self.path, found, f"restore a copy of the file, or {RUN_AGAIN}")

    def _in_blocks(
        self, read: Callable[[slice], NDArray[np.void]], rows: slice, dtype: np.dtype[np.void], fields: Sequence[str]
    ) -> NDArray[np.void]:
        """Selected fields of a table; all fields are read and checked, `BLOCK` rows at a time."""
        first, last, _ = rows.indices(self.n)
        table = np.empty(max(0, last - first), [(name, dtype[name]) for name in fields])
        for begin in range(first, last, BLOCK) if fields else ():
            block = read(slice(begin, min(begin + BLOCK, last)))
            for name in fields:
                table[name][begin - first : begin - first + len(block)] = block[name]
        return table

    def _read(self, group: str, columns: tuple[Column, ...], dtype: Any, rows: slice) -> NDArray[np.void]:
        first, last, _ = rows.indices(self.n)
        table = np.zeros(max(0, last - first), dtype)
        # The status is read first among the results: the values that it declares valid were written before it.
        for c in columns:
            c.of(table)[:] = self.column(group, c.name, slice(first, last))
        return table

    def attributes(self) -> dict[str, str | int]:
        """All attributes of the file as integers or text; JSON is not parsed."""
        attrs = self._file.attrs
        return {
            name: int(value) if isinstance(value, (int, np.integer)) else text(attrs, name)
            for name, value in attrs.items()
        }

    def column(self, group: str, name: str, rows: Any) -> NDArray[Any]:
        """Read a dataset at an index or slice of its rows.

        Raises
        ------
        StoreError
            When it cannot be read.
        """
        try:
            return np.asarray(self._file[group][name][rows])
        except checks.DAMAGE_ERRORS as error:
            if not self._file:
                raise
            raise store_error(self.path, f"is damaged: {group}/{name} cannot be read", RUN_AGAIN) from error


def parts_folder(path: Path) -> Path:
    """Folder of the histories of a campaign that is not complete yet."""
    return path.with_name(path.name + ".parts")
