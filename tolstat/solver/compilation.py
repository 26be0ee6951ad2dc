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


def _starts(options: Options) -> None:
    simulation.starts(np.zeros(1, PARAM).view(np.recarray), options)


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
    "simulate.simulate_joint": _alone,
    "explicit.explicit": _explicit,
    "starts.write_starts": _starts,
    "explicit.count_steps": _count_steps,
    "rainflow.count_joint": _rainflow,
}
"""Name of each kernel that Python calls in its cache, and a call that compiles it; those that take longest first."""

SHARES = {"lockstep.lockstep": 10, "simulate.simulate_joint": 8, "explicit.explicit": 8, "starts.write_starts": 2}
"""How long they take to compile, as ratios; others 1."""


def kernels(options: Options, params: NDArray[np.void] | None = None) -> list[str]:
    """Names of the kernels that joints with these settings need.

    Kernels with explicit steps are only among them where one of the joints `params` needs them; without them such a
    joint compiles them when it is simulated.
    """
    left_out = set() if simulation.in_lanes(options) else {"lockstep.lockstep", "starts.write_starts"}
    if params is None or not len(simulation.hitting(params, options)):
        left_out |= {"explicit.explicit", "explicit.count_steps"}
    return [name for name in KERNELS if name not in left_out]


def missing(options: Options, params: NDArray[np.void] | None = None) -> list[str]:
    """Names of those that do not lie in the cache."""
    from tolstat.kernel.simd.cache_folder import CACHE_DIRECTORY, SUFFIX

    return [name for name in kernels(options, params) if not any(CACHE_DIRECTORY.rglob(f"{name}*{SUFFIX}"))]


def is_compiled(options: Options | None = None, params: NDArray[np.void] | None = None) -> bool:
    """Whether the kernels that joints with `options` need, such as `params`, lie in the cache."""
    return not missing(options or Options(), params)


def load() -> None:
    """Load the kernels that joints with default options need, if they lie in the cache."""
    if is_compiled():
        compile_kernels(kernels(Options()), Options())


def warm_up(options: Options | None = None, params: NDArray[np.void] | None = None) -> None:
    """Compile the kernels that joints with `options` need, such as `params`, in two processes, or load them."""
    options = options or Options()
    own, others = halves(missing(options, params))
    with _compiling(others, options):
        compile_kernels(own, options)
    compile_kernels(kernels(options, params), options)


def halves(names: list[str]) -> tuple[list[str], list[str]]:
    """Divide kernels between two processes that take about as long: each goes to the one that is done earlier."""
    parts: tuple[list[str], list[str]] = [], []
    busy = [0, 0]
    for name in names:
        earlier = int(busy[1] < busy[0])
        parts[earlier].append(name)
        busy[earlier] += SHARES.get(name, 1)
    return parts


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
