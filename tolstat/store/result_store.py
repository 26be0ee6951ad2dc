"""The result file of a campaign: errors and results of every joint, and the list of what is still to do.

Everything but histories lies in datasets of a fixed size, written in full when the file is created. From then
on only numbers inside them change and none of HDF5's own structures, so a process killed at any moment leaves
a file that can be read. Values are on the disk before the status that declares them valid. What changes more, the
histories taken in at the end and limits edited between two runs, makes a new file that takes the old one's place.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat import tables
from tolstat.errors import StoreError
from tolstat.files import writing
from tolstat.store.counts import Counts
from tolstat.store.frame import to_pandas
from tolstat.store.histories import HistoryParts
from tolstat.store.result_file import (
    attributes,
    campaign_digest,
    check_schema,
    create_table,
    fault,
    judgement,
    open_hdf5,
    pending_results,
    put,
    replace,
)
from tolstat.tables import HistorySpec, Simulation, Status, Variant

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.study import Study


class ResultStore:
    """A result file; make one with `create` or `open`, and use it as a context manager.

    Attributes
    ----------
    path : Path
        The file.
    n : int
        Number of joints.
    study_name, study_text : str
        Name of the study and the TOML that it was read from.
    identity : dict
        Everything that decides the numbers, by dotted key.
    joint, options, sampling, versions : dict
        The joint as resolved, solver options, sampling (with ``dimensions``), versions of what ran.
    limits : dict of str to float
        Limits of the study in SI units, ``{"cross1.F": 700.0}``.
    case_names : tuple of str
        Cases of a study that lists its joints, ``"ideal"`` first; empty for other methods.
    variants : tuple of Variant
        Family and values (dotted key of the joint to SI value or word) of each of its joints; empty likewise.
    created, git_commit : str
        Time of creation (UTC) and commit of the code, if known.
    history_specs : dict of str to HistorySpec
        Histories asked for; empty if none.
    """

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path = path
        self._file = file
        attrs = file.attrs
        self._read_judgement()
        self.created = str(attrs["created"])
        self.git_commit = str(attrs["git_commit"])
        self.identity: dict[str, Any] = json.loads(attrs["identity"])
        self.joint: dict[str, Any] = json.loads(attrs["joint"])
        self.options: dict[str, Any] = json.loads(attrs["options"])
        self.sampling: dict[str, Any] = json.loads(attrs["sampling"])
        self.versions: dict[str, str] = json.loads(attrs["versions"])
        design: dict[str, Any] = json.loads(attrs["design"])
        self.case_names: tuple[str, ...] = tuple(design["cases"])
        self.variants = tuple(Variant(**variant) for variant in design["variants"])
        specs: dict[str, Any] = json.loads(attrs["histories"])
        self.history_specs = {k: HistorySpec(tuple(shape), *rest) for k, (shape, *rest) in specs.items()}
        self.n = int(file["results/status"].shape[0])
        self._parts = HistoryParts(_parts_folder(path), self.n, self.history_specs, campaign_digest(file))

    @classmethod
    def create(
        cls,
        path: str | Path,
        study: Study,
        errors: NDArray[np.void],
        histories: Mapping[str, HistorySpec] | None = None,
        dimensions: Mapping[str, int] | None = None,
    ) -> Self:
        """Create the file of a new campaign, all rows pending, and open it for writing.

        Parameters
        ----------
        path : str or Path
            The file; must not exist.
        study : Study
            What is to be kept of it goes into the file's attributes.
        errors : (n,) table ERROR
            Errors of every joint.
        histories : mapping of str to HistorySpec, optional
            Load histories to keep.
        dimensions : mapping of str to int, optional
            Which dimension of the sequence each error is drawn from.

        Raises
        ------
        StoreError
            When the file, or the parts of an earlier one, exist, or the file cannot be written.
        """
        path = Path(path)
        specs = {name: HistorySpec(*spec) for name, spec in (histories or {}).items()}
        parts = _parts_folder(path)
        if parts.exists():
            raise fault(parts, "holds histories of another campaign", "delete it or use another --out")
        if not path.parent.is_dir():
            raise fault(path, "cannot be written: no such folder", "make the folder first")
        try:
            with writing(path, overwrite=False) as temporary, h5py.File(temporary, "w") as file:
                file.attrs.update(attributes(study, specs, dimensions or {}))
                if study.case_names:
                    create_table(file.create_group("design"), tables.DESIGN_COLUMNS, study.design)
                create_table(file.create_group("errors"), tables.ERROR_COLUMNS, errors)
                pending = pending_results(len(errors))
                create_table(file.create_group("results"), tables.RESULT_COLUMNS, pending)
        except FileExistsError as error:
            raise fault(path, "exists already", "go on with it, delete it, or use another --out") from error
        except OSError as error:
            reason = error.strerror or str(error)
            remedy = "check the folder, its permissions and space"
            raise fault(path, f"cannot be written: {reason}", remedy) from error
        return cls.open(path, "r+")

    @classmethod
    def open(cls, path: str | Path, mode: str = "r") -> Self:
        """Open a result file.

        Parameters
        ----------
        path : str or Path
            The file.
        mode : {"r", "r+"}
            For reading, also while a campaign writes it; or for writing, by one process at a time.

        Raises
        ------
        StoreError
            When it is not a result file of this or an earlier version, is damaged, or is being written by
            another process.
        """
        if mode not in ("r", "r+"):
            raise ValueError(f"mode is {mode!r}, 'r' or 'r+' expected")
        path = Path(path)
        file = open_hdf5(path, mode)
        try:
            check_schema(path, file)
            store = cls(path, file)
        except KeyError as error:
            file.close()
            raise fault(path, f"is damaged: {error}", "run the campaign again with another --out") from error
        except StoreError:
            file.close()
            raise
        if mode == "r+":
            store._forget_lost_histories()
        return store

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
        return self.pending().size == 0

    def status(self) -> NDArray[np.uint8]:
        """Status of every joint, (n,)."""
        return np.asarray(self._file["results/status"][:])

    def counts(self) -> Counts:
        """How far the campaign is."""
        return Counts(self.n, 0, 0, 0).after(self.status())

    def pending(self) -> NDArray[np.intp]:
        """Rows still to be simulated, ascending."""
        return np.flatnonzero(self.status() == Status.PENDING)

    def write(self, rows: NDArray[np.intp], simulation: Simulation) -> None:
        """Write the results of `rows`; when this returns they are on the disk and no longer pending.

        Parameters
        ----------
        rows : (m,) array of int
            Rows of the campaign.
        simulation : Simulation
            Results, and the histories if the campaign keeps them, of these rows.

        Raises
        ------
        StoreError
            When the file cannot be written, e.g. for want of space.
        """
        results = simulation.results
        if len(results) != len(rows):
            raise ValueError(f"{len(results)} results for {len(rows)} rows")
        if np.any(results["status"] == Status.PENDING):
            raise ValueError("a simulated joint must not have the status PENDING")
        try:
            if self.history_specs:
                self._parts.add(rows, simulation.histories)
            for column in tables.RESULT_COLUMNS:
                if column.name != "status":
                    self._put(column.name, rows, column.of(results))
            self._sync()
            self._put("status", rows, results["status"])
            self._sync()
        except OSError as error:
            reason = error.strerror or str(error)
            remedy = "make room and run the campaign again: finished joints are kept"
            raise fault(self.path, f"cannot be written: {reason}", remedy) from error

    def finish(self) -> None:
        """Take the histories of a complete campaign into the file.

        Does nothing while rows are pending, and nothing the second time.

        Raises
        ------
        StoreError
            When there is no room for them, or parts of them are gone.
        """
        if not self.history_specs or not self.complete:
            return
        if "histories" not in self._file:
            self._replace(lambda file: self._parts.gather_into(file.create_group("histories")))
        self._parts.remove()

    def judge_by(self, study: Study) -> None:
        """Take over what decides no number: limits, text and name of a study of the same identity.

        Does nothing where the file has them already.

        Raises
        ------
        StoreError
            When there is no room for a second copy of the file.
        """
        wanted = judgement(study)
        if any(self._file.attrs[name] != value for name, value in wanted.items()):
            self._replace(lambda file: file.attrs.update(wanted))
            self._read_judgement()

    def design(self) -> NDArray[np.void]:
        """Variant, case and group of every joint, (n,) table DESIGN.

        Raises
        ------
        StoreError
            When the study does not list its joints.
        """
        if "design" not in self._file:
            remedy = 'give the file of a study with sampling.method = "cases"'
            raise fault(self.path, "has no list of cases and variants", remedy)
        return self._read("design", tables.DESIGN_COLUMNS, tables.DESIGN)

    def errors(self) -> NDArray[np.void]:
        """Errors of every joint, (n,) table ERROR."""
        return self._read("errors", tables.ERROR_COLUMNS, tables.ERROR)

    def results(self) -> NDArray[np.void]:
        """Results of every joint, (n,) table RESULT; those of a joint that is PENDING mean nothing."""
        return self._read("results", tables.RESULT_COLUMNS, tables.RESULT)

    def histories(self, name: str, rows: NDArray[np.intp] | None = None) -> NDArray[Any]:
        """Load histories of one kind.

        Parameters
        ----------
        name : str
            One of `history_specs`.
        rows : (m,) array of int, optional
            Rows to read; all without it.

        Returns
        -------
        (m, ...) array
            NaN for joints that are pending or have no results.

        Raises
        ------
        StoreError
            When the file holds no such histories, or those of joints that are done are gone.
        """
        if name not in self.history_specs:
            held = ", ".join(self.history_specs) or "none"
            remedy = 'set histories = "full" or "harmonics" in [output] of the study and run it anew'
            raise fault(self.path, f"holds no histories {name!r} (it holds: {held})", remedy)
        rows = np.arange(self.n) if rows is None else np.asarray(rows, dtype=np.intp)
        if "histories" not in self._file:
            done = self.status()[rows] != Status.PENDING  # asked first: histories are there before the status
            try:
                return self._parts.read(name, rows, done)
            except StoreError:
                if not self._reopen():
                    raise
        unique, back = np.unique(rows, return_inverse=True)
        return np.asarray(self._file["histories"][name][unique])[back]

    def to_pandas(self, units: bool = False) -> pd.DataFrame:
        """Errors and results as one frame, a row per joint, none dropped.

        Parameters
        ----------
        units : bool
            Give the columns a second level with the SI unit.

        Returns
        -------
        pandas.DataFrame
            Index ``row``; the errors' columns, then the results'; ``status`` as text. Before them, where the study
            lists its joints, name of the case, index and family of the variant, and group.
        """
        return to_pandas(self, units)

    def _read_judgement(self) -> None:
        attrs = self._file.attrs
        self.study_name = str(attrs["study_name"])
        self.study_text = str(attrs["study"])
        self.limits: dict[str, float] = json.loads(attrs["limits"])

    def _replace(self, change: Callable[[h5py.File], None]) -> None:
        try:
            self._file = replace(self.path, self._file, change)
        except OSError as error:
            reason = error.strerror or str(error)
            remedy = "make room for a second copy and run the campaign again: finished joints are kept"
            raise fault(self.path, f"cannot be replaced: {reason}", remedy) from error

    def _reopen(self) -> bool:
        """Go over to the file that has taken this one's place with the histories in it; whether there is one."""
        if self._file.mode != "r":
            return False
        file = open_hdf5(self.path, "r")
        if "histories" not in file or campaign_digest(file) != self._parts.campaign:
            file.close()
            return False
        self._file.close()
        self._file = file
        return True

    def _put(self, name: str, rows: NDArray[np.intp], values: NDArray[Any]) -> None:
        put(self._file["results"][name], rows, values)

    def _read(self, group: str, columns: tuple[tables.Column, ...], dtype: Any) -> NDArray[np.void]:
        table = np.empty(self.n, dtype)
        # The status comes first among the results: what it declares valid was written before it was.
        for c in columns:
            c.of(table)[:] = self._file[group][c.name][:]
        return table

    def _sync(self) -> None:
        self._file.flush()
        os.fsync(self._file.id.get_vfd_handle())

    def _forget_lost_histories(self) -> None:
        """Make rows pending whose histories are gone, as when the file was moved without its parts."""
        if not self.history_specs or "histories" in self._file:
            return
        part = self._parts.index().part
        lost = np.flatnonzero((part < 0) & (self.status() != Status.PENDING))
        if lost.size:
            self._put("status", lost, np.full(lost.size, Status.PENDING, np.uint8))
            self._sync()


def _parts_folder(path: Path) -> Path:
    return path.with_name(path.name + ".parts")
