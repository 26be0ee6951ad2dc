"""The one ``njit`` of the kernel."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from typing import Any

import numba
from numba.core import config
from numba.core.registry import CPUDispatcher

from tolstat.kernel.simd.cache_folder import CACHE_DIRECTORY, tell

try:
    import tolstat.kernel.simd.without_blas  # noqa: F401
    from tolstat.kernel.simd.cache import keep
    from tolstat.kernel.simd.unit import Kernel
except (ImportError, AttributeError) as error:  # a Numba with other internals
    Kernel, keep = CPUDispatcher, CPUDispatcher.enable_caching
    if multiprocessing.parent_process() is None:  # workers need not say it again
        slower = "kernels are compiled function by function, which takes longer; results are the same"
        tell(f"Numba {numba.__version__} is not one that this version was written for ({error}): {slower}")

OPTIONS = {"nopython": True, "boundscheck": None, "error_model": "numpy", "fastmath": False, "no_cfunc_wrapper": True}
"""No ``fastmath``: it removes the checks for NaN. No ``parallel``: the work is divided among processes."""
OPTIONS |= {"nogil": True}  # so that a worker notices the end of its parent while a kernel runs


def njit(function: Callable[..., Any]) -> Any:
    """Compile `function` with the kernel's options; code of a kernel that Python calls is cached on disk."""
    kernel = njit_inner(function)
    if kernel is not function:
        before = config.CACHE_DIR
        config.CACHE_DIR = str(CACHE_DIRECTORY)  # read when a cache is made; functions of other packages keep their own
        try:
            keep(kernel)
        finally:
            config.CACHE_DIR = before
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
