"""The one ``njit`` of the kernel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import UserProvidedCacheLocator

import tolstat.kernel.simd.without_blas  # noqa: F401
from tolstat.kernel.simd.cache import CheckedCache
from tolstat.kernel.simd.cache_folder import CACHE_DIRECTORY, KERNEL
from tolstat.kernel.simd.unit import Kernel

OPTIONS = {"nopython": True, "boundscheck": None, "error_model": "numpy", "fastmath": False, "no_cfunc_wrapper": True}
"""No ``fastmath``: it removes the checks for NaN. No ``parallel``: the work is divided among processes."""
OPTIONS |= {"nogil": True}  # so that a worker notices the end of its parent while a kernel runs


class Locator(UserProvidedCacheLocator):
    """Cache locator that ignores the folder of the sources: one compilation serves every environment."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """Subfolder of the cache directory; the hash in the directory's name already identifies the sources."""
        of_kernel = Path(py_file).is_relative_to(KERNEL)
        return KERNEL.name if of_kernel else str(super().get_suitable_cache_subpath(py_file))

    def ensure_cache_path(self) -> None:
        """Require nothing: a folder that can only be read will do."""


def njit(function: Callable[..., Any]) -> Any:
    """Compile `function` with the kernel's options; code of a kernel that Python calls is cached on disk."""
    kernel = njit_inner(function)
    if kernel is not function:
        before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
        # Numba reads both when a cache is made; functions of other packages keep their own directory
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(CACHE_DIRECTORY), f"{__name__}.{Locator.__name__}"
        try:
            kernel._cache = CheckedCache(function)
        finally:
            config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before
    return kernel


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
