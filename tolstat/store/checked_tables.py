"""Tables of a result file: read column by column, checked against their checksums."""

from __future__ import annotations

import posixpath
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common import selected_results, tables
from tolstat.common.columns import ERROR_COLUMNS, Column
from tolstat.common.tables import Status, Variant
from tolstat.store import checks, integrity
from tolstat.store.numbering import Numbering
from tolstat.store.result_file import BLOCK, POINT_GROUPS, RUN_AGAIN, Handle, descriptions, place_of, store_error
from tolstat.study.points import Point


class CheckedTables(Numbering):
    """Tables of an open result file, row i for joint i; part of `Reader`, which has the attributes."""

    path: Path
    _handle: Handle
    n: int
    columns: tuple[Column, ...]
    case_names: tuple[str, ...]
    variants: tuple[Variant, ...]
    _left_out: NDArray[np.bool_]
    """File slots whose results were found damaged while they were read, at any operating point, (n,)."""
    points: Mapping[str, Point]
    point: str | None

    @property
    def _file(self) -> h5py.File:
        return self._handle.file

    def _held(self) -> h5py.Group:
        """Group with the tables of the operating point; exceptions as of `_place`."""
        return self._file[self._place()]

    def _place(self) -> str:
        """Path of the group with the tables of the operating point.

        Raises
        ------
        StoreError
            When the file has several and none is chosen.
        """
        if self.point is None:
            names = ", ".join(self.points)
            remedy = f"give one of them: --point {next(iter(self.points))}, or store.at({next(iter(self.points))!r})"
            raise store_error(self.path, f"has results at several operating points: {names}", remedy)
        return place_of(self.point)

    def status(self, slots: slice = slice(None)) -> NDArray[np.uint8]:
        """Status of the joints, (n,), or of a slice of file slots; joints whose row is damaged are PENDING.

        Raises
        ------
        StoreError
            When a status is unknown to this version.
        """
        if self._file.mode != "r":
            return self._status(slots)  # opening for writing has already marked damaged rows as pending
        first, last, _ = slots.indices(self.n)
        blocks = (slice(begin, min(begin + BLOCK, last)) for begin in range(first, last, BLOCK))
        return np.concatenate([np.empty(0, np.uint8), *map(self._status_if_intact, blocks)])

    def damaged(self) -> NDArray[np.intp]:
        """File slots whose results do not match their checksums, as after an interrupted write or a disk fault."""
        found = [np.empty(0, np.intp)]
        for first in range(0, self.n, BLOCK):
            slots = slice(first, first + BLOCK)
            done = self._status(slots) != Status.PENDING
            if done.any():
                found.append(first + np.flatnonzero(done & ~self._intact(slots, self._results(slots))))
        return np.concatenate(found)

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

    def origin(self, slots: slice = slice(None)) -> NDArray[np.void]:
        """How every joint was drawn, (n,) table with the columns `draw_records.columns`, or of a slice of file slots.

        Raises
        ------
        StoreError
            When the sampling method has no such table, or it is damaged.
        """
        if "origin" not in self._file:
            remedy = 'give a result file with sampling.method = "importance", or of tolstat rare'
            raise store_error(self.path, "has no record of how its joints were drawn", remedy)
        self.errors(slots)  # checks this table too: it enters the checksums of the errors
        return self._described("origin", slots)

    def errors(self, slots: slice = slice(None), fields: Sequence[str] | None = None) -> NDArray[np.void]:
        """Errors of every joint, (n,) table ERROR, or of a slice of file slots.

        With `fields` the table has these only: all fields are read and checked in blocks, the others then dropped.

        Raises
        ------
        StoreError
            When the errors are damaged.
        """
        if fields is not None:
            return self._in_blocks(self.errors, slots, tables.ERROR, fields)
        table = self._errors(slots)
        self._check_errors(slots, table)
        return table

    def results(self, slots: slice = slice(None), fields: Sequence[str] | None = None) -> NDArray[np.void]:
        """Results of every joint, (n,) table RESULT, or of a slice of file slots.

        A joint whose row is damaged is PENDING. Results of pending joints are NaN (integers 0), as are columns that
        the campaign does not keep. With `fields` the table has these only, as in `errors`.

        Raises
        ------
        StoreError
            When a status is unknown to this version.
        """
        if fields is not None:
            return self._in_blocks(self.results, slots, tables.RESULT, fields)
        table = self._results(slots)
        pending = table["status"] == Status.PENDING
        broken = pending | ~self._intact(slots, table)
        if (broken & ~pending).any():
            self._left_out[slots] |= broken & ~pending
        for field in tables.RESULT_FIELDS:
            table[field.name][broken] = np.nan if np.dtype(field.dtype).kind == "f" else 0
        self._check_status(table["status"])
        return table

    def attempt(self, slots: slice = slice(None)) -> NDArray[np.int32]:
        """Attempt that each joint's results belong to, (n,): 0 for the study's settings, k for ``retries[k - 1]``.

        Raises
        ------
        StoreError
            When an attempt is damaged.
        """
        attempt, errors, held = (
            self.column("ledger", name, slots) for name in ("attempt", "errors_check", "attempt_check")
        )
        wrong = integrity.attempt_hash(errors, attempt) != held
        if wrong.any():
            row = self.row(slots.indices(self.n)[0] + int(np.argmax(wrong)))
            found = f"is damaged: the attempt of row {row} does not match its checksum"
            raise store_error(self.path, found, f"restore a copy of the file, or {RUN_AGAIN}")
        return attempt

    def column(self, group: str, name: str, slots: Any) -> NDArray[Any]:
        """Read a dataset at a file slot or slice of them.

        Raises
        ------
        StoreError
            When it cannot be read.
        """
        path = posixpath.join(self._place() if group in POINT_GROUPS else "/", group, name)
        try:
            return np.asarray(self._handle.dataset(path)[slots])
        except checks.DAMAGE_ERRORS as error:
            if not self._file:
                raise
            raise store_error(self.path, f"is damaged: {group}/{name} cannot be read", RUN_AGAIN) from error

    def _status(self, slots: slice) -> NDArray[np.uint8]:
        found = np.asarray(self.column("results", "status", slots))
        self._check_status(found)
        return found

    def _status_if_intact(self, slots: slice) -> NDArray[np.uint8]:
        found = self._status(slots)
        # any(): PENDING is 0; copy(): a view would keep the whole table of the block in memory
        return self.results(slots)["status"].copy() if found.any() else found

    def _check_status(self, found: NDArray[np.uint8]) -> None:
        if not np.isin(found, list(Status)).all():
            raise store_error(self.path, f"is damaged: a joint has the unknown status {found.max()}", RUN_AGAIN)

    def _described(self, group: str, slots: slice) -> NDArray[np.void]:
        return self._read(group, *descriptions(self._file)[group], slots)

    def _errors(self, slots: slice) -> NDArray[np.void]:
        return self._read("errors", ERROR_COLUMNS, tables.ERROR, slots)

    def _results(self, slots: slice) -> NDArray[np.void]:
        table = self._read("results", self.columns, tables.RESULT, slots)
        selected_results.blank_others(table, self.columns)
        return table

    def _intact(self, slots: slice, results: NDArray[np.void]) -> NDArray[np.bool_]:
        """Whether rows match their checksums, (m,); checksums are read after the values, the order of writing."""
        names = ("attempt", "errors_check", "results_check")
        attempt, errors, held = (self.column("ledger", name, slots) for name in names)
        return np.asarray(integrity.results_hash(errors, attempt, results, self.columns) == held)

    def _check_errors(self, slots: slice, errors: NDArray[np.void]) -> None:
        checks = self._file[place_of(next(iter(self.points)))]["ledger/errors_check"]  # the same at all points
        first = self.row(slots.indices(self.n)[0])
        described = [(c, self._read(name, c, dtype, slots)) for name, (c, dtype) in descriptions(self._file).items()]
        right = integrity.errors_hash(first, errors, described) == checks[slots]
        if not right.all():
            found = f"is damaged: the errors of row {first + int(np.argmin(right))} do not match their checksum"
            raise store_error(self.path, found, f"restore a copy of the file, or {RUN_AGAIN}")

    def _in_blocks(
        self, read: Callable[[slice], NDArray[np.void]], slots: slice, dtype: np.dtype[np.void], fields: Sequence[str]
    ) -> NDArray[np.void]:
        """Selected fields of a table; all fields are read and checked, `BLOCK` rows at a time."""
        first, last, _ = slots.indices(self.n)
        table = np.empty(max(0, last - first), [(name, dtype[name]) for name in fields])
        for begin in range(first, last, BLOCK) if fields else ():
            block = read(slice(begin, min(begin + BLOCK, last)))
            for name in fields:
                table[name][begin - first : begin - first + len(block)] = block[name]
        return table

    def _read(self, group: str, columns: tuple[Column, ...], dtype: Any, slots: slice) -> NDArray[np.void]:
        first, last, _ = slots.indices(self.n)
        table = np.zeros(max(0, last - first), dtype)
        # The status is read first among the results: the values that it declares valid were written before it.
        for c in columns:
            c.of(table)[:] = self.column(group, c.name, slice(first, last))
        return table
