"""The one ``njit`` of the kernel, and the cache directory of its compiled code.

Numba's cache notices an edit in the file of a cached function, but not in a file whose functions it calls. The
name of the cache directory therefore has a hash of all kernel sources: code compiled from other sources is never used.
"""

from __future__ import annotations

import getpass
import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import UserProvidedCacheLocator

try:
    from tolstat.kernel.simd.unit import Kernel
except ImportError:  # Numba's internals differ: compile each function separately, which takes minutes
    from numba.core.registry import CPUDispatcher as Kernel

KERNEL = Path(__file__).parent.parent
TABLES = ("fields.py", "parameters.py", "tables.py")
"""Files of ``common/`` that the layout of the tables follows from."""
OPTIONS = {"nopython": True, "boundscheck": None, "error_model": "numpy", "fastmath": False, "no_cfunc_wrapper": True}
"""No ``fastmath``: it removes the checks for NaN. No ``parallel``: the work is divided among processes."""


def source_hash() -> str:
    """Hash of everything that compiled kernels depend on: the kernel's sources and the tables' layout."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in [*sorted(KERNEL.rglob("*.py")), *(KERNEL.parent / "common" / name for name in TABLES)]:
        digest.update(path.relative_to(KERNEL.parent).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_directory() -> str:
    """Directory of compiled kernels: ``NUMBA_CACHE_DIR`` if set, else one in the user's cache."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return str(config.CACHE_DIR)
    root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    path = root / "tolstat" / f"kernel-{source_hash()}"
    try:
        path.mkdir(parents=True, exist_ok=True)
        if os.access(path, os.W_OK):
            return str(path)
    except OSError:
        pass  # a read-only home: compile into the temporary directory instead
    return _temporary_directory()


def _temporary_directory() -> str:
    """Directory for compiled code that nobody else can write to: Numba trusts what it finds there."""
    path = Path(tempfile.gettempdir()) / f"tolstat-{getpass.getuser()}-kernel-{source_hash()}"
    path.mkdir(mode=0o700, parents=True, exist_ok=True)
    status = path.stat()
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o077):
        return tempfile.mkdtemp(prefix="tolstat-kernel-")
    return str(path)


CACHE_DIRECTORY = cache_directory()


class Locator(UserProvidedCacheLocator):
    """Cache locator that ignores the folder of the sources: one compilation serves every environment."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """Subfolder of the cache directory; the hash in the directory's name already identifies the sources."""
        own = Path(py_file).is_relative_to(KERNEL)
        return KERNEL.name if own else str(super().get_suitable_cache_subpath(py_file))


def njit(function: Callable[..., Any]) -> Any:
    """Compile `function` with the kernel's options; code of a kernel that Python calls is cached on disk."""
    before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
    # Numba reads both when a function is decorated; functions of other packages keep their own directory
    config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = CACHE_DIRECTORY, f"{__name__}.{Locator.__name__}"
    try:
        kernel = njit_inner(function)
        if kernel is not function:
            kernel.enable_caching()
        return kernel
    finally:
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before


def njit_inner(function: Callable[..., Any]) -> Any:
    """Compile a function made by a factory; it is cached with the entry point that calls it."""
    return function if config.DISABLE_JIT else Kernel(function, targetoptions=OPTIONS)


def compiled_entry(function: Any, *arguments: Any) -> Any:
    """Compiled code of a kernel for the types of `arguments`, without Numba's type dispatch at each call.

    The dispatch takes longer than a residual of the joint. Arguments of other types must never be passed.
    """
    if not hasattr(function, "compile"):  # compilation is switched off
        return function
    return function.compile(tuple(numba.typeof(argument) for argument in arguments))
