"""Result files that are changed behind the back of the store: by accident, or with checksums that are right again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
import pytest

from tolstat.store import checksums, metadata, reader, writer


def flip(path: Path, offset: int, bit: int = 6) -> None:
    """Change one bit of a file."""
    with path.open("r+b") as file:
        file.seek(offset)
        (old,) = file.read(1)
        file.seek(offset)
        file.write(bytes([old ^ 1 << bit]))


def flip_in(path: Path, name: str, row: int = 0, bit: int = 6) -> None:
    """Change one bit of the first byte of a row of a dataset."""
    with h5py.File(path) as file:
        held = file[name]
        offset = held.id.get_offset() + row * held.dtype.itemsize * int(np.prod(held.shape[1:]))
    flip(path, offset, bit)


@contextmanager
def rewritten(path: Path) -> Iterator[h5py.File]:
    """Change numbers of a file as if they had been written so: its checksums are made again."""
    with h5py.File(path, "r+") as file:
        yield file
        held = metadata.read(file)
        for at_points in (False, True):
            checksums.update(file, held, at_points, np.arange(checksums.blocks_of(held.n)))


def small_blocks(monkeypatch: pytest.MonkeyPatch, rows: int) -> None:
    """Give each block of `rows` rows its checksums."""
    for module in (checksums, reader, writer):
        monkeypatch.setattr(module, "ROWS", rows)
