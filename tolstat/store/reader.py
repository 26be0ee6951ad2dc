"""Reading a result file: its attributes, its tables and the status of its joints."""

from __future__ import annotations

import math
from copy import copy
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common import selected_results
from tolstat.common.errors import StoreError
from tolstat.common.loads import limits_in_words
from tolstat.common.shown import table
from tolstat.common.tables import Status, Variant
from tolstat.store import checks, integrity, left_out, metadata, session
from tolstat.store.checked_tables import CheckedTables
from tolstat.store.counts import Counts
from tolstat.store.frame import to_pandas, to_xarray
from tolstat.store.histories import HistoryParts, parts_folder
from tolstat.store.named_loads import NamedLoads
from tolstat.store.result_file import (
    BLOCK,
    RUN_AGAIN,
    Handle,
    campaign_digest,
    is_locked,
    open_hdf5,
    store_error,
    text,
)
from tolstat.store.view import View
from tolstat.study.points import only_one

if TYPE_CHECKING:
    import pandas as pd
    import xarray

    from tolstat.joint import Operation
    from tolstat.store.revolutions import Ahead


class Reader(CheckedTables):
    """A result file that is open for reading, also while a campaign writes it; close it, or use a ``with`` block.

    Attributes
    ----------
    path : Path
        The file.
    n : int
        Number of joints in the file.
    rows : range
        Rows of the campaign in the file: all of them, unless the file holds a slice. File slot i (row i of every
        table) is row ``rows[i]`` of the campaign.
    campaign_rows : int
        Number of rows of the campaign.
    study_name, study_text : str
        Name of the study and the TOML that it was read from.
    identity : dict
        All settings that determine results, by dotted key.
    columns : tuple of Column
        Columns of the results that the campaign keeps, in the order of the table.
    joint, options, sampling, versions : dict
        Nominal joint with all values resolved, solver options, sampling (with ``dimensions``), software versions.
    points : dict of str to Point
        Operating points by name; one without a name unless the study has several.
    point : str or None
        Operating point whose results are read; None where there are several and none is chosen, see `at`.
    limits : dict of str to float
        Limits of the study in SI units, ``{"cross1.F": 700.0}``; those of some operating points only are named
        ``cross1.F at cruise``.
    case_names : tuple of str
        Cases of a study that lists its joints, ``"ideal"`` first; empty for other methods.
    variants : tuple of Variant
        Family and values (dotted key to SI value or word) of each joint that the study lists; else empty.
    created, git_commit : str
        Time of creation (UTC) and commit of the code, if known.
    stop : dict
        Stop rule and its outcome, if the precision asked for was reached before all rows were simulated; else empty.
    retries : list of dict
        Settings of each retry, in chronological order; see `attempt`.
    history_specs : dict of str to HistorySpec
        Histories that the campaign keeps; empty if none.
    ahead : Ahead or None
        Joints that are simulated again for all who ask for their loads over the revolution; see `revolutions.ahead`.
    """

    ahead: Ahead | None = None

    @classmethod
    def open(cls, path: str | Path) -> Reader:
        """Open a result file for reading, also while a campaign writes it.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Reader
            Has no method that writes; close it, or use it in a ``with`` block.

        Raises
        ------
        StoreError
            When it is not a result file of this schema version, or is damaged.

        Examples
        --------
        >>> with tolstat.open("iso2768_f.h5") as store:  # doctest: +SKIP
        ...     store.loads["cross1.F"].describe()
        """
        return Reader._opened(Path(path), "r")

    @classmethod
    def _opened(cls, path: Path, mode: str) -> Self:
        file = open_hdf5(path, mode)
        try:
            return cls(path, file)
        except StoreError:
            file.close()
            raise
        except checks.DAMAGE_ERRORS as error:
            file.close()
            raise store_error(path, f"is damaged: {error}", RUN_AGAIN) from error

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path = path
        self._handle = Handle(file)
        attrs = file.attrs
        held = checks.check_schema(path, file)
        self._read_study_attributes()
        self.created = text(attrs, "created")
        self.git_commit = text(attrs, "git_commit")
        self.identity: dict[str, Any] = metadata.read(file, "identity")
        self.columns = selected_results.columns(self.identity)
        self.options: dict[str, Any] = metadata.read(file, "options")
        self.sampling: dict[str, Any] = metadata.read(file, "sampling")
        self.fidelity: dict[str, Any] = metadata.read(file, "fidelity", {})
        self.versions: dict[str, str] = metadata.read(file, "versions")
        self.retries: list[dict[str, Any]] = metadata.read(file, "retries")
        self.stop: dict[str, Any] = metadata.read(file, "stop", {})
        design = metadata.read(file, "design")
        self.case_names: tuple[str, ...] = tuple(design["cases"])
        self.variants = tuple(Variant(**variant) for variant in design["variants"])
        self.history_specs = checks.history_specs(file)
        self.n = checks.check_tables(file, held, self.columns, self.history_specs)
        self._left_out = np.zeros(self.n, bool)
        first = checks.integer(file, "first_row", 0)
        self.rows = range(first, first + self.n)
        self.campaign_rows = checks.integer(file, "campaign_rows", self.n)
        if self.rows.stop > self.campaign_rows:
            raise ValueError(f"rows {first}:{self.rows.stop} of a campaign of {self.campaign_rows}")
        checks.check_number(self.sampling, self.campaign_rows)
        self.point = next(iter(self.points)) if len(self.points) == 1 else None
        self._campaign = campaign_digest(file)

    @cached_property
    def _parts(self) -> HistoryParts:
        self._held()
        folder = parts_folder(self.path) / (self.point or "")
        return HistoryParts(folder, self.n, self.history_specs, self._campaign)

    def at(self, point: str) -> Self:
        """Return the file at one of its operating points; both are closed together.

        Raises
        ------
        InputError
            When there is no such point.
        """
        only_one(point, list(self.points), str(self.path))
        found = copy(self)
        for kept in ("_parts", "loads"):
            found.__dict__.pop(kept, None)
        found.point = point
        return found

    def each(self) -> list[Self]:
        """Return the file at each of its operating points, or at the one that it is at."""
        return [self.at(name) for name in (self.points if self.point is None else [self.point])]

    @property
    def operation(self) -> Operation:
        """Operating point whose results are read, without the deviations of the joints.

        Raises
        ------
        StoreError
            When the file has several and none is chosen.
        """
        self._held()
        return self.points[self.point or ""].operation

    def __repr__(self) -> str:
        if not self._file:
            return f"<result file {self.path.name!r}, closed>"
        joints = f"{self.n - self.first_sample} joints"
        progress = [f"{one.point}: {one._progress()}" if one.point else one._progress() for one in self.each()]
        return f"<result file {self.path.name!r}: {joints} ({'; '.join(progress)})>"

    def _repr_html_(self) -> str:
        entries: list[tuple[str, object]] = [("study", self.study_name), ("file", str(self.path))]
        entries += [("sampling", self.sampling["method"]), ("created", self.created)]
        entries.append(("limits", limits_in_words(self.limits)))
        if self._file:
            entries.append(("loads", ", ".join(self.loads)))
        return table(repr(self)[1:-1], entries)

    def _progress(self) -> str:
        """Numbers of joints by status, the nominal joint not counted; states as the file has them, unchecked."""
        codes, numbers = np.unique(self.column("results", "status", slice(self.first_sample, None)), return_counts=True)
        labels = {status.value: status.label for status in Status}
        return ", ".join(f"{n} {labels.get(code, 'damaged')}" for code, n in zip(codes.tolist(), numbers, strict=True))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; joints that were left out because their results are damaged are told as a warning."""
        if self._file and self._file.mode == "r":
            left_out.tell(self, "are left out", f"simulate these joints again: tolstat run STUDY --out {self.path}")
        self._file.close()

    def view(self, study_path: Path | None = None) -> View:
        """View of the file that questions read, while the file is open.

        Parameters
        ----------
        study_path : Path, optional
            Study file to read if the text in the result file can no longer be read.
        """
        return View(self, study_path)

    @cached_property
    def loads(self) -> NamedLoads:
        """Largest loads of the joints by name, as pandas Series: ``store.loads["cross1.F"]``.

        They are read when first used, and kept: open the file anew to see more of a campaign under way.
        """
        return NamedLoads(self.view())

    @property
    def heaviest(self) -> float:
        """Largest weight that a joint of importance sampling can have: one over the share of the tolerances, else 1."""
        return 1.0 / (1.0 - math.fsum(share for share, _ in self.identity.get("proposal", ())))

    @property
    def nominal(self) -> pd.Series[float]:
        """Largest loads of the nominal joint by name, SI; NaN where the file has none or its results are not valid."""
        return self.loads.nominal()

    @property
    def complete(self) -> bool:
        """Whether no row is pending, at any operating point."""
        return all(next(one.pending_blocks(), None) is None for one in self.each())

    @property
    def whole(self) -> bool:
        """Whether the file holds all rows of its campaign, not a slice."""
        return self.rows == range(self.campaign_rows)

    def counts(self) -> Counts:
        """Count the joints of the file by status; each at every operating point."""
        each = self.each()
        counts = Counts(self.n * len(each), 0, 0, 0, points=len(each))
        for one in each:
            for first in range(0, self.n, BLOCK):
                counts = counts.after(one.status(slice(first, first + BLOCK)))
        return counts

    def session(self) -> session.Session | None:
        """Return the run under way; None if no process is writing the file."""
        if "session" not in self._file or not is_locked(self.path):
            return None
        return session.read(self._file["session"], len(self.points) * self.n)

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
        slots = np.arange(self.n) if slots is None else np.asarray(slots, dtype=np.intp)
        if "histories" not in self._held():
            done = self.status()[slots] != Status.PENDING  # read first: histories are written before the status
            try:
                values = self._parts.read(name, slots, done)
                self._check_history(name, slots, values, done)
                return values
            except StoreError:
                if not self._reopen():
                    raise
        unique, back = np.unique(slots, return_inverse=True)
        values = np.asarray(self.column("histories", name, unique))
        self._check_history(name, unique, values, np.ones(len(unique), bool))
        return values[back]

    def to_pandas(self, nominal: bool = False) -> pd.DataFrame:
        """Export errors and results as one DataFrame, one row per joint, pending and failed joints included.

        Parameters
        ----------
        nominal : bool
            Include the nominal joint, and a column ``nominal`` that marks it.

        Returns
        -------
        pandas.DataFrame
            Index ``row``: row of the campaign. Columns: case, variant, family and group for a study that lists its
            joints; how each joint was drawn, where that is recorded; errors; kept results, ``status`` and ``motion``
            as text. ``attrs["units"]`` has the SI unit of each column.
        """
        return to_pandas(self, nominal)

    def to_xarray(self, nominal: bool = False) -> xarray.Dataset:
        """Export errors and results along ``row``, with units and descriptions.

        Parameters
        ----------
        nominal : bool
            As in `to_pandas`.

        Raises
        ------
        InputError
            Without xarray.
        """
        return to_xarray(self, nominal)

    def attributes(self) -> dict[str, str | int]:
        """All attributes of the file as integers or text; JSON is not parsed."""
        attrs = self._file.attrs
        return {
            name: int(value) if isinstance(value, (int, np.integer)) else text(attrs, name)
            for name, value in attrs.items()
        }

    def _read_study_attributes(self) -> None:
        attrs = self._file.attrs
        self.study_name = text(attrs, "study_name")
        self.study_text = text(attrs, "study")
        self.points = checks.points(self._file)
        self.limits = checks.limits(self._file, self.points)
        self.joint = checks.joint(self._file)

    def _reopen(self) -> bool:
        """Switch to the file that has replaced this one and includes the histories; return whether there is one."""
        if self._file.mode != "r":
            return False
        file = open_hdf5(self.path, "r")
        if "histories" not in file[self._held().name] or campaign_digest(file) != self._campaign:
            file.close()
            return False
        self._file.close()
        self._handle.file = file
        return True

    def _check_history(self, name: str, slots: NDArray[np.intp], values: NDArray[Any], done: NDArray[np.bool_]) -> None:
        held = self.column("ledger", f"{name}_check", slice(None))[slots[done]]
        wrong = integrity.history_checks(values[done], self.row(slots[done])) != held
        if wrong.any():
            row = self.rows[slots[done][np.argmax(wrong)]]
            found = f"is damaged: the history {name} of row {row} does not match its checksum"
            raise store_error(self.path, found, f"restore a copy of the file, or {RUN_AGAIN}")
