"""Reader of a result file: its metadata, its tables and the status of its joints; numbers are checked as they are read.

Damaged errors refuse the file. Damaged results make the joints of their block (`checksums.ROWS`) pending.
"""

from __future__ import annotations

import hashlib
import logging
import time
from collections.abc import Iterator, Sequence
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import Any, Self, TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import DESIGN_COLUMNS, SUBSET, Column, drawn_columns, error_columns, kept_columns
from tolstat.common.counts import Counts, Session
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.tables import DESIGN, Status, tables
from tolstat.common.wording import row_of
from tolstat.joint import Operation
from tolstat.store import layout, metadata
from tolstat.store.checksums import GROUP, ROWS, CheckedFile, Integrity
from tolstat.store.hdf5 import RUN_AGAIN, TOGETHER, open_hdf5, pick, store_error, told_as_damage
from tolstat.store.lock import is_locked
from tolstat.study.points import Point, only_one

LOG = logging.getLogger("tolstat.store")
RESTORE = f"restore a copy of the file, or {RUN_AGAIN}"
MAX_TOLD = 5
"""Most blocks of damaged rows that a warning lists."""
Number = TypeVar("Number", int, NDArray[np.intp])


class Reader:
    """A result file that is open for reading, also while a campaign writes it; close it, or use a ``with`` block.

    Attributes
    ----------
    path : Path
        The file.
    metadata : Metadata
        All that it says of itself beyond the tables; the following attributes are from it.
    mechanism : Mechanism
        What was simulated.
    n : int
        Number of joints in the file.
    rows : range
        Rows of the campaign in the file: all of them, unless the file holds a slice. File slot i (row i of every
        table) is row ``rows[i]`` of the campaign.
    columns : tuple of Column
        Columns of the results that the campaign keeps, in the order of the table.
    points : dict of str to Point
        Operating points by name; one without a name unless the study has several.
    point : str or None
        Operating point whose results are read; None where there are several and none is chosen, see `at`.
    ahead : object
        Joints that are simulated again for all who ask for their loads over the revolution; see `revolutions.ahead`.
    """

    ahead: Any = None

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Open a result file for reading, also while a campaign writes it.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises a `StoreError` when it is not a result file of this schema version, or is damaged.
        """
        return cls._opened(Path(path), "r")

    @classmethod
    def _opened(cls, path: Path, mode: str) -> Self:
        file = open_hdf5(path, mode)
        try:
            with told_as_damage(path):
                layout.check_schema(path, file)
                return cls(path, file)
        except StoreError:
            file.close()
            raise

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path = path
        self._describe(metadata.read(file))
        layout.check_names(file, self.metadata)
        self._checked = CheckedFile(path, file, self.metadata)
        self._left_out: set[int] = set()
        self.point = next(iter(self.points)) if len(self.points) == 1 else None

    def _describe(self, document: metadata.Metadata) -> None:
        self.metadata = document
        try:
            self.mechanism = document.simulated
        except (InputError, KeyError, ValueError) as error:
            found = f"has mechanism {document.mechanism!r}, which this tolstat does not know"
            raise store_error(self.path, found, "use a newer tolstat") from error
        self.study_name, self.study_text = document.study_name, document.study
        self.joint, self.limits = document.joint, document.limits
        self.identity, self.options, self.fidelity = document.identity, document.options, document.fidelity
        self.sampling, self.versions, self.history_specs = document.sampling, document.versions, document.histories
        self.retries, self.stop = document.retries, document.stop
        self.created, self.git_commit = document.created, document.git_commit
        self.case_names, self.variants = document.design.cases, document.design.variants
        self.n, self.campaign_rows = document.n, document.campaign_rows
        self.rows = range(document.first_row, document.first_row + document.n)
        self.columns = kept_columns(document.identity, self.mechanism)
        self.points = {name: Point.of(name, values) for name, values in document.points.items()}

    def at(self, point: str) -> Self:
        """Return the file at one of its operating points; both are closed together. `InputError` if it has no such."""
        only_one(point, list(self.points), str(self.path))
        other = copy(self)
        other.__dict__.pop("loads", None)  # those that a `ResultFile` keeps are of another point
        other.point = point
        return other

    def each(self) -> list[Self]:
        """Return the file at each of its operating points, or at the one that it is at."""
        return [self.at(name) for name in (self.points if self.point is None else [self.point])]

    @property
    def operation(self) -> Operation:
        """Operating point whose results are read, without the deviations; `StoreError` unless one is chosen."""
        return self.points[self._point()].operation

    def _point(self) -> str:
        if self.point is None:
            first = next(iter(self.points))
            remedy = f"give one of them: --point {first}, or store.at({first!r})"
            found = f"has results at several operating points: {', '.join(self.points)}"
            raise store_error(self.path, found, remedy)
        return self.point

    @property
    def is_open(self) -> bool:
        """Whether the file has not been closed."""
        return self._checked.is_open

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; joints that were left out because their results are damaged are told as a warning."""
        if self.is_open:
            self._tell("are left out", f"simulate these joints again: tolstat run STUDY --out {self.path}")
        self._checked.close()

    def _tell(self, done: str, remedy: str) -> None:
        """Warn of the blocks that were found damaged so far, once."""
        rows = [self._rows_of(block) for block in sorted(self._left_out)]
        if rows:
            listed = ", ".join(rows[:MAX_TOLD]) + ", ..." * (len(rows) > MAX_TOLD)
            found = f"the results of rows {listed} are damaged and {done}"
            LOG.warning("warning: %s", Fault(str(self.path), found, remedy))
            self._left_out.clear()

    def _rows_of(self, block: int) -> str:
        rows = self.rows[block * ROWS : (block + 1) * ROWS]
        return f"{rows.start}:{rows.stop}"

    def row(self, slot: Number) -> Number:
        """Row of the campaign in a file slot; also of many, (m,)."""
        return slot + self.rows.start

    def slot(self, row: Number) -> Number:
        """File slot of a row of the campaign; also of many, (m,)."""
        return row - self.rows.start

    @property
    def first_sample(self) -> int:
        """File slot of the first random joint: 1 if slot 0 holds the nominal joint, else 0."""
        return int(bool(self.sampling["nominal_first"]) and self.rows.start == 0)

    @property
    def samples(self) -> range:
        """Numbers of the random joints of this file among those of the campaign; from 0 unless it is a slice."""
        nominal = int(self.sampling["nominal_first"])
        return range(max(0, self.rows.start - nominal), self.rows.stop - nominal)

    @property
    def whole(self) -> bool:
        """Whether the file holds all rows of its campaign, not a slice."""
        return self.rows == range(self.campaign_rows)

    @property
    def complete(self) -> bool:
        """Whether no row is pending, at any operating point."""
        return next(self.pending_blocks(), None) is None

    def counts(self) -> Counts:
        """Count the joints of the file by status; each at every operating point."""
        each = self.each()
        counts = Counts(self.n * len(each), points=len(each), noun=f"{row_of(self.mechanism)}s")
        for at_point in each:
            counts = counts.after(at_point.status())
        return counts

    def session(self) -> Session | None:
        """Return the run under way; None if no process is writing the file, or its record means nothing."""
        if not is_locked(self.path):
            return None
        with told_as_damage(self.path):
            started, done = (float(self._checked.file["session"][name][()]) for name in ("started", "done"))
        valid = 0 < started <= time.time() and 0 <= done <= len(self.points) * self.n
        return Session(started, int(done)) if valid else None

    def status(self, slots: slice = slice(None)) -> NDArray[np.uint8]:
        """Status of the joints, (n,), or of a slice of file slots; joints whose results are damaged are PENDING.

        Raises a `StoreError` when a status is unknown to this version.
        """
        codes = np.array(self.column("results", "status", slots))
        if codes.any():  # PENDING is 0
            codes[self._damaged(slots)] = Status.PENDING
        if codes.size and codes.max() > max(Status):
            raise store_error(self.path, f"is damaged: a joint has the unknown status {codes.max()}", RUN_AGAIN)
        return codes

    def pending(self) -> NDArray[np.intp]:
        """File slots still to be simulated at the operating point, ascending."""
        return np.flatnonzero(self.status() == Status.PENDING)

    def pending_blocks(self, stop: int | None = None) -> Iterator[tuple[Self, NDArray[np.intp]]]:
        """Yield the pending file slots below `stop`, ascending, with the file at their operating point.

        Of `TOGETHER` rows at a time those of all points: after an interruption few joints are done at some points only.
        """
        each, stop = self.each(), self.n if stop is None else stop
        for first in range(0, stop, TOGETHER):
            for at_point in each:
                status = at_point.status(slice(first, min(first + TOGETHER, stop)))
                slots = first + np.flatnonzero(status == Status.PENDING)
                if slots.size:
                    yield at_point, slots

    def results(self, slots: slice = slice(None), fields: Sequence[str] | None = None) -> NDArray[np.void]:
        """Results of every joint, (n,) table RESULT, or of a slice of file slots.

        A joint whose results are damaged is PENDING. Results of pending joints are NaN (integers 0), as are columns
        that the campaign does not keep. With `fields` the table has these only.

        Raises a `StoreError` when a code is unknown to this version.
        """
        dtype = tables(self.mechanism).RESULT
        names = (dtype.names or ()) if fields is None else fields
        status = self.status(slots)  # first: the values that it declares valid were written before it
        others = tuple(c for c in self.columns if c.field != "status")
        table = self._table("results", others, dtype, slots, names)
        pending = status == Status.PENDING
        for name in names:
            table[name][pending] = np.nan if dtype[name].base.kind == "f" else 0
        if "status" in names:
            table["status"] = status
        return table

    def attempt(self, slots: slice = slice(None)) -> NDArray[np.int32]:
        """Attempt that each joint's results belong to, (n,): 0 for the study's settings, k for ``retries[k - 1]``.

        Raises a `StoreError` when an attempt is damaged.
        """
        attempts = np.array(self.column("ledger", "attempt", slots))
        attempts[self._damaged(slots)] = 0
        wrong = (attempts < 0) | (attempts > len(self.retries))
        if wrong.any():
            row = self.row(slots.indices(self.n)[0] + int(np.argmax(wrong)))
            raise store_error(self.path, f"is damaged: row {row} names a retry that the file does not have", RESTORE)
        return attempts

    def errors(self, slots: slice = slice(None), fields: Sequence[str] | None = None) -> NDArray[np.void]:
        """Errors of every joint, (n,) table ERROR, or of a slice of file slots; with `fields` these only.

        Raises a `StoreError` when the errors are damaged.
        """
        dtype = tables(self.mechanism).ERROR
        return self._table("errors", error_columns(self.mechanism), dtype, slots, fields or dtype.names or ())

    @cached_property
    def design(self) -> NDArray[np.void]:
        """Variant, case and group of every joint, (n,) table DESIGN.

        Raises a `StoreError` when all rows have the study's joint, or the table is damaged.
        """
        if not self.variants:
            remedy = 'give the result file of a study with sampling.method = "cases", or of a sweep of dimensions'
            raise store_error(self.path, "has no list of variants", remedy)
        return self._table("design", DESIGN_COLUMNS, DESIGN, slice(None), DESIGN.names or ())

    def origin(self, slots: slice = slice(None)) -> NDArray[np.void]:
        """How every joint was drawn, (n,) table with the columns `columns.drawn_columns`, or of a slice of file slots.

        Raises a `StoreError` when the sampling method has no such table, or it is damaged.
        """
        columns = drawn_columns(self.sampling)
        if not columns:
            remedy = "give the result file of tolstat rare"
            raise store_error(self.path, "has no record of how its joints were drawn", remedy)
        return self._table("origin", columns, SUBSET, slots, SUBSET.names or ())

    def histories(self, name: str, slots: NDArray[np.intp] | None = None) -> NDArray[Any]:
        """Read the histories of one kind.

        Parameters
        ----------
        name : str
            One of `history_specs`.
        slots : (m,) array of int, optional
            File slots to read; all without it.

        Returns
        -------
        (m, ...) array
            NaN (integers 0) for joints that are pending or have no results.

        Raises a `StoreError` when the file holds no such histories, or they are damaged.
        """
        if name not in self.history_specs:
            kinds = ", ".join(self.history_specs) or "none"
            remedy = f'write histories = "full", "harmonics" or "cycles" in [output] of the study, and {RUN_AGAIN}'
            raise store_error(self.path, f"holds no histories {name!r} (it holds: {kinds})", remedy)
        slots = np.arange(self.n) if slots is None else np.asarray(slots, dtype=np.intp)
        values = self.history_specs[name].blank(len(slots))
        wanted, back = np.unique(slots, return_inverse=True)
        if not wanted.size:
            return values
        pending = pick(self.status, wanted) == Status.PENDING  # first: histories are written before the status
        read = pick(lambda part: self.column("histories", name, part), wanted)
        read[pending] = self.history_specs[name].blank(1)
        return np.asarray(read[back])

    def column(self, group: str, name: str, slots: slice) -> NDArray[Any]:
        """Read a slice of file slots of a dataset: of results as they are, `StoreError` for others that are damaged."""
        path = layout.path_of(self._point() if group in layout.AT_POINTS else "", group, name)
        first, last, _ = slots.indices(self.n)
        if group not in ("results", "ledger"):
            self._refuse(path, self._checked.damaged((path,), first, last))
        return self._checked.read(path, first, last)

    def group(self, name: str, at_point: bool = True) -> h5py.Group | None:
        """Group that a file may have beside its tables, at the operating point or in the whole file."""
        with told_as_damage(self.path):
            path = "/".join(part for part in (layout.place_of(self._point()) if at_point else "", name) if part)
            return self._checked.file.get(path)

    def check(self) -> Integrity:
        """Compare everything that has a checksum with it, histories included."""
        checked = self._checked.number % 2 == 0
        damaged = self._checked.check().items()
        return Integrity(checked, {path: [self._rows_of(b) for b in blocks.tolist()] for path, blocks in damaged})

    def results_checksum(self) -> str:
        """Number that is equal for files with the same joints and results; empty while they have no checksums."""
        if self._checked.number % 2:
            return ""
        with told_as_damage(self.path):
            results = [k for k, path in enumerate(self._checked.stored) if path.split("/")[-2] == "results"]
            return hashlib.sha256(self._checked.file[GROUP]["crc"][:][results].tobytes()).hexdigest()

    def _table(
        self, group: str, columns: tuple[Column, ...], dtype: np.dtype[np.void], slots: slice, fields: Sequence[str]
    ) -> NDArray[np.void]:
        """Selected fields of a table, in the order asked for if not all are; columns that the file lacks are NaN."""
        first, last, _ = slots.indices(self.n)
        whole = tuple(fields) == dtype.names
        table = np.zeros(max(0, last - first), dtype if whole else [(name, dtype[name]) for name in fields])
        if group == "results":
            for name in (name for name in fields if dtype[name].base.kind == "f"):
                table[name] = np.nan
        for c in columns:
            if c.field in fields:
                c.of(table)[:] = self.column(group, c.name, slice(first, last))
        return table

    def _damaged(self, slots: slice) -> NDArray[np.bool_]:
        """Whether rows are in a block of which a result is damaged, (m,)."""
        first, last, _ = slots.indices(self.n)
        groups = [layout.path_of(self._point(), group, "") for group in ("results", "ledger")]
        paths = tuple(path for path in self._checked.stored if path.rpartition("/")[0] in groups)
        blocks = self._checked.damaged(paths, first, last)
        self._left_out.update(blocks.tolist())
        return np.isin(np.arange(first, max(first, last)) // ROWS, blocks)

    def _refuse(self, path: str, blocks: NDArray[np.intp]) -> None:
        if blocks.size:
            found = f"is damaged: {path} of rows {self._rows_of(int(blocks[0]))} does not match its checksum"
            again = f"simulate these joints again: tolstat run STUDY --out {self.path}"
            raise store_error(self.path, found, again if layout.is_at_point(path) else RESTORE)
