"""What a command says when the machine has no memory or disk space left: what was needed, and what helps."""

from __future__ import annotations

import errno

from tolstat.common.errors import Fault, InputError
from tolstat.common.files import reason

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

DISK = {
    *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM),
    *(errno.EISDIR, errno.ENOTDIR, errno.ENAMETOOLONG),
}
"""Numbers of the errors that say that a file cannot be written here."""
LIBRARIES_MB = 700
"""Address space that a process takes before it has any joints, MB: libraries and kernels."""


def check_memory() -> None:
    """Refuse to simulate in a process that may not even load the libraries; it would end with any error.

    Raises
    ------
    InputError
        When a process may use less than `LIBRARIES_MB`.
    """
    if 0 < _limit_mb() < LIBRARIES_MB:
        raise InputError([_memory("libraries cannot be loaded")])


def shortage(error: MemoryError | OSError | ImportError) -> Fault | None:
    """Describe an error that another machine, or another folder, would not have had; None for any other error."""
    unloaded = isinstance(error, ImportError) or (isinstance(error, OSError) and error.errno is None)
    if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM or (unloaded and _limit_mb()):
        return _memory("libraries cannot be loaded" if unloaded else str(error) or "no more could be allocated")
    if isinstance(error, OSError) and error.errno in DISK:
        remedy = "check that the folder is writable and the disk has space"
        return Fault(str(error.filename or "a file"), f"cannot be written: {reason(error)}", remedy)
    return None


def _memory(found: str) -> Fault:
    limit, remedy = _limit_mb(), "use fewer workers (--workers 1), keep fewer results ([output]), or end other programs"
    if not limit:
        return Fault("memory", found, remedy)
    allowed = f"a process may use {limit} MB (ulimit -v) and needs {LIBRARIES_MB} MB before any joints"
    return Fault("memory", f"{found}; {allowed}", f"{remedy}, or raise ulimit -v")


def _limit_mb() -> int:
    """Address space that this process may use, MB; 0 if it is not limited."""
    if resource is None:
        return 0
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    return 0 if soft == resource.RLIM_INFINITY else soft // 10**6
