"""Compilation of the kernels, once per machine and version, in two processes where there are two cores."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cores import available_cores
from tolstat.common.tables import PARAM, RESULT, Options
from tolstat.solver import rainflow, refinement, simulation


def _outside() -> NDArray[np.void]:
    """One joint with negative clearance: it ends at once."""
    params = np.zeros(1, PARAM)
    params["clearance"] = -1.0
    return params


def _reversing() -> NDArray[np.void]:
    """One such joint whose torque reverses."""
    params = _outside()
    params["omega"], params["alpha"], params["Js"] = 1.0, 0.1, 1.0
    return params


def _lockstep(options: Options) -> None:
    found = np.zeros(1, RESULT).view(np.recarray)
    list(simulation.simulate_together(_outside(), options, np.ones(1, np.int64), False, found))


def _alone(options: Options) -> None:
    found = np.zeros(1, RESULT).view(np.recarray)
    list(simulation.simulate_alone(_outside(), options, np.ones(1, np.int64), False, found))


def _explicit(options: Options) -> None:
    found, steps = np.zeros(1, RESULT).view(np.recarray), np.full(1, options.steps_per_rev)
    settings = refinement.settings(options)
    list(simulation.simulate_together(_reversing(), settings, np.full(1, 2**31), False, found, found[:, None], steps))


def _count_steps(options: Options) -> None:
    simulation.explicit_steps(_reversing(), options)


def _rainflow(options: Options) -> None:
    rainflow.count(np.zeros((2, 8, 6)))


KERNELS: dict[str, Callable[[Options], None]] = {
    "lockstep.lockstep": _lockstep,
    "explicit.explicit": _explicit,
    "explicit.count_steps": _count_steps,
    "simulate.simulate_joint": _alone,
    "rainflow.count_joint": _rainflow,
}
"""Name of each kernel that Python calls in its cache, and a call that compiles it; those that take longest first."""


def kernels(options: Options) -> list[str]:
    """Names of the kernels that joints with these settings need."""
    left_out = set() if simulation.in_lanes(options) else {"lockstep.lockstep"}
    if not refinement.may_refine(options):
        left_out |= {"explicit.explicit", "explicit.count_steps"}
    return [name for name in KERNELS if name not in left_out]


def missing(options: Options) -> list[str]:
    """Names of those that do not lie in the cache."""
    from tolstat.kernel.simd.cache_folder import CACHE_DIRECTORY, SUFFIX

    return [name for name in kernels(options) if not any(CACHE_DIRECTORY.rglob(f"{name}*{SUFFIX}"))]


def is_compiled(options: Options | None = None) -> bool:
    """Whether the kernels that `options` need lie in the cache, so that `warm_up` only has to load them."""
    return not missing(options or Options())


def warm_up(options: Options | None = None) -> None:
    """Compile the kernels that `options` need, every other one in a second process, or load them from the cache."""
    options = options or Options()
    uncompiled = missing(options)
    with _compiling(uncompiled[1::2], options):
        compile_kernels(uncompiled[::2], options)
    compile_kernels(kernels(options), options)


def compile_kernels(names: list[str], options: Options) -> None:
    """Compile or load these kernels of `KERNELS`."""
    for name in names:
        KERNELS[name](options)


@contextmanager
def _compiling(names: list[str], options: Options) -> Iterator[None]:
    """Compile kernels into the cache in another process; what fails there is compiled when it is called."""
    if not names or available_cores() < 2:
        yield
        return
    said = f"from {__name__} import *; compile_kernels({names!r}, Options{tuple(options)!r})"
    none = subprocess.DEVNULL
    other = subprocess.Popen([sys.executable, "-c", said], stdin=none, stdout=none, stderr=none)
    try:
        yield
        other.wait()
    finally:
        other.kill()
        other.wait()
