"""Load histories of a campaign in progress: one small file per block, beside the result file.

HDF5 keeps the addresses of compressed chunks in an index that it rewrites as chunks are added. A process killed
between two of these writes leaves a file that opens but cannot be read. Compressed histories are therefore never
added to a result file under way: the histories of each block are written to a separate file in ``FILE.h5.parts``,
which gets its final name only when complete. When no row is pending, a copy of the result file that includes all
histories replaces the result file.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.files import atomic_write
from tolstat.common.tables import HistorySpec
from tolstat.store import layout, meanings
from tolstat.store.axes import attach_scales
from tolstat.store.result_file import link_rows, put_attributes, store_error

CHUNK_BYTES = 1 << 16
"""Approximate size of one chunk of a history before compression, bytes."""
PARTS = ".parts"
"""Ending of the folder of the histories of a campaign that is not complete yet."""
HISTORY_BYTES = 1 << 25
"""Approximate amount of history data copied at a time, bytes."""


def rows_per_chunk(spec: HistorySpec, n: int) -> int:
    """Return how many of `n` joints share a compressed chunk."""
    return max(1, min(n, CHUNK_BYTES // spec.blank(1).nbytes))


def create_group(file: h5py.Group) -> h5py.Group:
    """Create the group of the histories of an operating point in a result file."""
    group = file.create_group("histories")
    put_attributes(group, {"description": "loads of each joint over its last revolution, or what follows from them"})
    link_rows(file, group)
    return group


def create_dataset(group: h5py.Group, name: str, n: int, spec: HistorySpec) -> h5py.Dataset:
    """Create the compressed dataset of one history of `n` joints."""
    dataset = group.create_dataset(
        name,
        shape=(n, *spec.shape),
        dtype=spec.dtype,
        chunks=(rows_per_chunk(spec, n), *spec.shape),
        compression="gzip",
        shuffle=True,
        fillvalue=spec.blank(1).flat[0],
    )
    put_attributes(dataset, {"units": spec.unit, "description": spec.description})
    if name in meanings.FIXED:
        meanings.put(dataset, meanings.FIXED[name])
    return dataset


class Index(NamedTuple):
    """Location of the histories of each file slot.

    Attributes
    ----------
    paths : list of Path
        Files of the parts.
    part : (n,) array of int
        Index into `paths`, -1 for a slot that no part holds.
    position : (n,) array of int
        Index of the slot within that part.
    """

    paths: list[Path]
    part: NDArray[np.intp]
    position: NDArray[np.intp]


class HistoryParts:
    """The folder of history files beside a result file.

    Parameters
    ----------
    folder : Path
        ``FILE.h5.parts``, or the folder in it of an operating point; created when the first part is added.
    n : int
        Number of joints in the result file.
    specs : mapping of str to HistorySpec
        Histories of the campaign.
    campaign : str
        Identifier of the campaign (`campaign_digest`); parts with another one are rejected.
    """

    def __init__(self, folder: Path, n: int, specs: Mapping[str, HistorySpec], campaign: str) -> None:
        self.folder = folder
        self.n = n
        self.specs = specs
        self.campaign = campaign
        self._next: int | None = None

    def add(self, rows: NDArray[np.intp], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write the histories of `rows`; on return they are on disk.

        Parameters
        ----------
        rows : (m,) array of int
            File slots.
        arrays : mapping of str to (m, ...) array
            One array for each history of the campaign.
        """
        if set(arrays) != set(self.specs):
            raise ValueError(f"histories {sorted(arrays)} given, {sorted(self.specs)} expected")
        for name, spec in self.specs.items():
            expected = (len(rows), *spec.shape)
            if arrays[name].shape != expected:
                raise ValueError(f"history {name}: shape {arrays[name].shape}, {expected} expected")
        self.folder.mkdir(parents=True, exist_ok=True)
        if self._next is None:
            paths = self.paths()
            self._next = int(paths[-1].stem) + 1 if paths else 0
        content = BytesIO()  # on a full disk a plain write raises a clear error, HDF5 does not
        with h5py.File(content, "w") as file:
            file.attrs["campaign"] = self.campaign
            file["rows"] = rows
            for name, spec in self.specs.items():
                create_dataset(file, name, len(rows), spec)[...] = arrays[name]
        with atomic_write(self.folder / f"{self._next:08d}.h5") as temporary:
            temporary.write_bytes(content.getbuffer())
        self._next += 1

    def size(self) -> int:
        """Total size of all parts, bytes."""
        return sum(path.stat().st_size for path in self.paths())

    def paths(self) -> list[Path]:
        """Finished parts in the order in which they were written."""
        return sorted(self.folder.glob("[0-9]*.h5"))

    def index(self) -> Index:
        """Locate the histories of each file slot.

        Raises
        ------
        StoreError
            When a part cannot be read or is of another campaign.
        """
        index = Index(self.paths(), np.full(self.n, -1, np.intp), np.zeros(self.n, np.intp))
        for k, path in enumerate(index.paths):
            with self._open(path) as file:
                rows = file["rows"][:]
                if rows.ndim != 1 or rows.dtype.kind != "i" or not np.isin(rows, np.arange(self.n)).all():
                    raise ValueError("rows outside the file")
                if any(file[name].shape != (len(rows), *spec.shape) for name, spec in self.specs.items()):
                    raise ValueError("histories of another shape")
            index.part[rows] = k
            index.position[rows] = np.arange(len(rows))
        return index

    def read(self, name: str, rows: NDArray[np.intp], done: NDArray[np.bool_]) -> NDArray[Any]:
        """Read histories of one kind.

        Parameters
        ----------
        name : str
            One of `specs`.
        rows : (m,) array of int
            File slots.
        done : (m,) array of bool
            Which of these joints must have histories, by the status read before this call.

        Returns
        -------
        (m, ...) array
            NaN for a joint that is not done and that no part holds.

        Raises
        ------
        StoreError
            When no part holds a joint that is done, or for the reasons of `index`.
        """
        index = self.index()
        self._check_held(index.part[rows[done]])
        return self._gather(name, rows, index)

    def gather_into(self, file: h5py.Group) -> None:
        """Copy the histories of all joints to datasets in a new group ``histories``, a few chunks at a time.

        Raises
        ------
        StoreError
            When no part holds a joint of the file, or for the reasons of `index`.
        """
        index = self.index()
        self._check_held(index.part)
        group = create_group(file)
        for name, spec in self.specs.items():
            dataset = create_dataset(group, name, self.n, spec)
            attach_scales(dataset, file.file["row"], spec)
            step = 16 * rows_per_chunk(spec, self.n)
            for first in range(0, self.n, step):
                rows = np.arange(first, min(first + step, self.n))
                dataset[first : first + len(rows)] = self._gather(name, rows, index)

    def _check_held(self, part: NDArray[np.intp]) -> None:
        """Raise an error if finished joints have lost their histories, instead of returning NaN for them."""
        lost = np.count_nonzero(part < 0)
        if lost:
            remedy = "restore the folder, or simulate these joints again: run the same tolstat run command"
            raise store_error(self.folder, f"lacks the histories of {lost} finished joints", remedy)

    def _gather(self, name: str, rows: NDArray[np.intp], index: Index) -> NDArray[Any]:
        out = self.specs[name].blank(len(rows))
        part = index.part[rows]
        for k in np.unique(part[part >= 0]):
            here = np.flatnonzero(part == k)
            with self._open(index.paths[k]) as file:
                at = index.position[rows[here]]
                out[here] = file[name][at.min() : at.max() + 1][at - at.min()]
        return out

    @contextmanager
    def _open(self, path: Path) -> Iterator[h5py.File]:
        try:
            with h5py.File(path, "r", locking=False) as file:
                layout.check(file, compressed="")
                if file.attrs.get("campaign") != self.campaign:
                    raise store_error(
                        path,
                        "holds histories of another campaign",
                        "delete the folder, or give another file: --out OTHER.h5",
                    )
                yield file
        except (OSError, KeyError, ValueError, RuntimeError) as error:
            remedy = "delete it, and simulate its joints again: run the same tolstat run command"
            raise store_error(path, "is damaged", remedy) from error

    def remove(self) -> None:
        """Delete the folder with all parts, and the one that it is in if nothing else is."""
        if self.folder.exists():
            shutil.rmtree(self.folder)
            above = self.folder.parent
            if above.suffix == PARTS and not any(above.iterdir()):
                above.rmdir()


def parts_folder(path: Path) -> Path:
    """Folder of the histories of a campaign that is not complete yet."""
    return path.with_name(path.name + PARTS)
