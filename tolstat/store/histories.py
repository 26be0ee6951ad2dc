"""Load histories of a campaign in progress: one small file a block beside the result file.

HDF5 keeps the places of compressed chunks in an index that it rewrites as chunks are added. A process killed
between two of those writes leaves a file that opens and cannot be read. Compressed histories therefore never
go into a result file that is being written: each block's become a file of their own in ``FILE.h5.parts``,
complete before it gets its name, and when no row is pending a copy of the result file with all of them takes
its place.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.errors import Fault, StoreError
from tolstat.files import writing
from tolstat.tables import HistorySpec

CHUNK_BYTES = 1 << 16
"""About how much of a history one compressed chunk holds."""


def blank(spec: HistorySpec, n: int) -> NDArray[Any]:
    """Return the history of `n` joints that have none: NaN (0 for integers) throughout."""
    dtype = np.dtype(spec.dtype)
    return np.full((n, *spec.shape), np.nan if dtype.kind == "f" else 0, dtype)


def rows_per_chunk(spec: HistorySpec, n: int) -> int:
    """Return how many of `n` joints share a compressed chunk."""
    return max(1, min(n, CHUNK_BYTES // blank(spec, 1).nbytes))


def create_dataset(group: h5py.Group, name: str, n: int, spec: HistorySpec) -> h5py.Dataset:
    """Create the compressed dataset of one history of `n` joints."""
    dataset = group.create_dataset(
        name,
        shape=(n, *spec.shape),
        dtype=spec.dtype,
        chunks=(rows_per_chunk(spec, n), *spec.shape),
        compression="gzip",
        shuffle=True,
        fillvalue=blank(spec, 1).flat[0],
    )
    dataset.attrs["units"] = spec.unit
    dataset.attrs["description"] = spec.description
    return dataset


class HistoryParts:
    """The folder of history files beside a result file.

    Parameters
    ----------
    folder : Path
        ``FILE.h5.parts``; made when the first part is added.
    n : int
        Number of joints of the campaign.
    specs : mapping of str to HistorySpec
        Histories of the campaign.
    """

    def __init__(self, folder: Path, n: int, specs: Mapping[str, HistorySpec]) -> None:
        self.folder = folder
        self.n = n
        self.specs = specs
        self._next: int | None = None

    def add(self, rows: NDArray[np.intp], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write the histories of `rows`; when this returns they are on the disk.

        Parameters
        ----------
        rows : (m,) array of int
            Rows of the campaign.
        arrays : mapping of str to (m, ...) array
            One array for each history of the campaign.
        """
        if set(arrays) != set(self.specs):
            raise ValueError(f"histories {sorted(arrays)} given, {sorted(self.specs)} expected")
        for name, spec in self.specs.items():
            expected = (len(rows), *spec.shape)
            if arrays[name].shape != expected:
                raise ValueError(f"history {name}: shape {arrays[name].shape}, {expected} expected")
        self.folder.mkdir(exist_ok=True)
        if self._next is None:
            paths = self.paths()
            self._next = int(paths[-1].stem) + 1 if paths else 0
        with writing(self.folder / f"{self._next:08d}.h5") as temporary, h5py.File(temporary, "w") as file:
            file["rows"] = rows
            for name, spec in self.specs.items():
                create_dataset(file, name, len(rows), spec)[...] = arrays[name]
        self._next += 1

    def paths(self) -> list[Path]:
        """Finished parts in the order in which they were written."""
        return sorted(self.folder.glob("[0-9]*.h5"))

    def index(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Where each row's histories are.

        Returns
        -------
        part : (n,) array of int
            Index into `paths`, -1 for a row that no part holds.
        position : (n,) array of int
            Index of the row within that part.

        Raises
        ------
        StoreError
            When a part cannot be read.
        """
        part = np.full(self.n, -1, np.intp)
        position = np.zeros(self.n, np.intp)
        for k, path in enumerate(self.paths()):
            try:
                with h5py.File(path, "r", locking=False) as file:
                    rows = file["rows"][:]
            except (OSError, KeyError) as error:
                remedy = "delete it and run the campaign again: its rows will be simulated again"
                raise StoreError(str(Fault(str(path), "is damaged", remedy))) from error
            part[rows] = k
            position[rows] = np.arange(len(rows))
        return part, position

    def read(self, name: str, rows: NDArray[np.intp]) -> NDArray[Any]:
        """Histories of `rows`, (m, ...); NaN for a row that no part holds."""
        part, position = self.index()
        return self._gather(name, rows, part, position)

    def _gather(
        self, name: str, rows: NDArray[np.intp], part: NDArray[np.intp], position: NDArray[np.intp]
    ) -> NDArray[Any]:
        out = blank(self.specs[name], len(rows))
        paths = self.paths()
        for k in np.unique(part[rows]):
            if k < 0:
                continue
            here = np.flatnonzero(part[rows] == k)
            with h5py.File(paths[k], "r", locking=False) as file:
                at = position[rows[here]]
                out[here] = file[name][at.min() : at.max() + 1][at - at.min()]
        return out

    def gather_into(self, group: h5py.Group) -> None:
        """Copy all histories to datasets in `group`, a few chunks at a time."""
        part, position = self.index()
        for name, spec in self.specs.items():
            dataset = create_dataset(group, name, self.n, spec)
            step = 16 * rows_per_chunk(spec, self.n)
            for first in range(0, self.n, step):
                rows = np.arange(first, min(first + step, self.n))
                dataset[first : first + len(rows)] = self._gather(name, rows, part, position)

    def remove(self) -> None:
        """Delete the folder with all parts."""
        if self.folder.exists():
            shutil.rmtree(self.folder)
