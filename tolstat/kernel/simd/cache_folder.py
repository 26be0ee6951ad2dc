"""Folder of the compiled code: which one it is, who may write to it, what lies in it.

Numba's cache notices an edit in the file of a cached function, but not in a file whose functions it calls. The folder's
name therefore has a hash of all kernel sources: code compiled from other sources, or for another Numba, is never used.
"""

import contextlib
import getpass
import hashlib
import os
import shutil
import stat
import sys
import tempfile
from functools import cache
from importlib import metadata
from pathlib import Path

import platformdirs

KERNEL = Path(__file__).parent.parent
TABLES = ("load_kinds.py", "mechanism.py", "parameters.py", "tables.py")
"""Files of ``common/`` whose constants are part of compiled code; sizes of records are part of its signature."""
PREFIX, SUFFIX = "kernel-", ".nbc"
"""How names of folders begin, and how those of files with compiled code end."""


@cache
def source_hash() -> str:
    """Hash of what compiled kernels depend on: their sources, the tables' layout, versions of Python and Numba."""
    versions = sys.version + metadata.version("numba") + metadata.version("llvmlite")  # numba is slow to import
    digest = hashlib.sha256(versions.encode())
    for path in [*sorted(KERNEL.rglob("*.py")), *(KERNEL.parent / "common" / name for name in TABLES)]:
        digest.update(path.relative_to(KERNEL.parent).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def tell(text: str) -> None:
    """Write a message about the cache to stderr, once in a process."""
    print(f"tolstat: {text}", file=sys.stderr, flush=True)


def is_trusted(path: Path) -> bool:
    """Whether a folder belongs to the user or to root, and nobody else may write to it; Windows has no such modes."""
    if not hasattr(os, "getuid"):
        return path.is_dir()
    try:
        owner = os.lstat(path)
    except OSError:
        return False
    return stat.S_ISDIR(owner.st_mode) and owner.st_uid in (os.getuid(), 0) and not owner.st_mode & 0o022


def root() -> Path:
    """Folder of the folders of all versions: ``NUMBA_CACHE_DIR`` if set, else the system's for caches of the user."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return Path(os.environ["NUMBA_CACHE_DIR"]).absolute()
    return platformdirs.user_cache_path("tolstat", appauthor=False)


def user() -> int | str:
    """Number of the user, or the name where users have no numbers."""
    return os.getuid() if hasattr(os, "getuid") else getpass.getuser()


def cache_directory() -> Path:
    """Folder of the compiled code: in `root`, or a temporary one if that one cannot be used or is not trusted.

    A folder that can only be read, as in an image, is used if it has compiled code.
    """
    path = root() / f"{PREFIX}{source_hash()}"
    with contextlib.suppress(OSError):  # a read-only home
        path.parent.mkdir(parents=True, exist_ok=True)
        path.mkdir(mode=0o700, exist_ok=True)
    if path.exists() or path.is_symlink():
        if not is_trusted(path):
            tell(f"others than you and root may write to {path}: its compiled code is not used")
        elif os.access(path, os.W_OK) or any(path.rglob(f"*{SUFFIX}")):
            return path
    return _temporary_directory()


def _temporary_directory() -> Path:
    path = Path(tempfile.gettempdir()) / f"tolstat-{user()}-{PREFIX}{source_hash()}"
    with contextlib.suppress(OSError):
        path.mkdir(mode=0o700, exist_ok=True)
    return path if is_trusted(path) else Path(tempfile.mkdtemp(prefix=f"tolstat-{PREFIX}"))


CACHE_DIRECTORY = cache_directory()


def folders() -> list[Path]:
    """Folders with compiled code of all versions, the one in use first."""
    others = [path for path in sorted(root().glob(f"{PREFIX}*")) if path != CACHE_DIRECTORY and is_trusted(path)]
    return [CACHE_DIRECTORY, *others]


def size(folder: Path) -> tuple[int, int]:
    """Number of files with compiled code in a folder, and bytes of all its files."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return sum(path.suffix == SUFFIX for path in files), sum(path.stat().st_size for path in files)


def clear() -> int:
    """Remove the folders of all versions; return the number of bytes that they had."""
    freed = 0
    for folder in folders():
        freed += size(folder)[1]
        shutil.rmtree(folder, ignore_errors=True)
    return freed
