"""The lock of a result file: one process writes it, any may read it.

A file beside it is locked, because on Windows nobody can read what is locked. Where HDF5 can lock, it locks the result
file itself, against other programs.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tolstat.common.errors import Fault, StoreError
from tolstat.common.late import filelock

WAIT_S = 0.5
"""Time that a writer waits for the lock, s: a process that asks if it is held has it for a moment."""


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Hold the lock of a file inside; nothing is locked where there is no file, or no lock can be put beside it.

    Raises
    ------
    StoreError
        When another process holds it.
    """
    lock = filelock.FileLock(_beside(path), WAIT_S, thread_local=False)
    try:
        if path.is_file():
            lock.acquire()
    except filelock.Timeout:
        raise being_written(path) from None
    except (OSError, NotImplementedError):  # a folder that can only be read, a file system without locks
        pass
    try:
        yield
    finally:
        if lock.is_locked:
            with suppress(OSError):  # Windows deletes it when it is released
                Path(lock.lock_file).unlink()
            lock.release()


def is_locked(path: Path) -> bool:
    """Whether a process holds the lock of a file."""
    beside = _beside(path)
    try:
        if beside.exists():
            filelock.FileLock(beside).acquire(timeout=0).lock.release()
    except filelock.Timeout:
        return True
    except (OSError, NotImplementedError):  # a lock of somebody else, who may have been killed
        pass
    return False


def being_written(path: Path) -> StoreError:
    """Error of a file that another process writes."""
    remedy = "wait until that process ends, or stop it"
    return StoreError(str(Fault(str(path), "is being written by another process", remedy)))


def _beside(path: Path) -> Path:
    whole = path.resolve()
    return whole.with_name(f".{whole.name}.lock")
