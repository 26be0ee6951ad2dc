"""Compilation of the kernels, once per machine and version, in two processes where there are two cores."""

from __future__ import annotations

import logging
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.channels import LOAD_HISTORIES
from tolstat.common.cores import available_cores
from tolstat.common.tables import PARAM, RESULT, Options
from tolstat.solver import rainflow, refinement, simulation

LOG = logging.getLogger("tolstat")
POLL_S = 0.2
"""Time between two looks for kernels that have been compiled, s."""


def announce() -> None:
    """Tell that kernels will be compiled, if they have to be."""
    if not is_compiled():
        LOG.info("compiling the kernels: about half a minute, once per machine and version")


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
    rainflow.count({history.name: np.zeros((2, *history.shape)) for history in LOAD_HISTORIES})


class Kernel(NamedTuple):
    """A kernel that Python calls: what it is for, a call that compiles it, and how long that takes, as a ratio."""

    what: str
    compile: Callable[[Options], None]
    share: int = 1


KERNELS = {
    "lockstep.lockstep": Kernel("joints in lanes", _lockstep, 10),
    "simulate.simulate_joint": Kernel("single joints", _alone, 8),
    "explicit.explicit": Kernel("explicit steps", _explicit, 8),
    "starts.write_starts": Kernel("starts of joints", _starts, 2),
    "explicit.count_steps": Kernel("number of explicit steps", _count_steps),
    "rainflow.count_joint": Kernel("load cycles", _rainflow),
}
"""Kernels by their names in the cache; those that take longest first."""


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
    return [name for name in kernels(options, params) if not _is_held(name)]


def _is_held(name: str) -> bool:
    from tolstat.kernel.simd.cache_folder import CACHE_DIRECTORY, SUFFIX

    return any(CACHE_DIRECTORY.rglob(f"{name}*{SUFFIX}"))


def is_compiled(options: Options | None = None, params: NDArray[np.void] | None = None) -> bool:
    """Whether the kernels that joints with `options` need, such as `params`, lie in the cache."""
    return not missing(options or Options(), params)


def warm_up(options: Options | None = None, params: NDArray[np.void] | None = None) -> None:
    """Compile the kernels that joints with `options` need, such as `params`, in two processes, or load them."""
    options = options or Options()
    names = missing(options, params)
    own, others = halves(names)
    with _told(names):
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
        busy[earlier] += KERNELS[name].share
    return parts


def compile_kernels(names: list[str], options: Options) -> None:
    """Compile or load these kernels of `KERNELS`."""
    for name in names:
        KERNELS[name].compile(options)


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


@contextmanager
def _told(names: list[str]) -> Iterator[None]:
    """Log each of these kernels when it is compiled, in whatever process: it lies in the cache then."""
    if not names:
        yield
        return
    ended = threading.Event()
    watch = threading.Thread(target=_watch, args=(names, ended), daemon=True)
    watch.start()
    try:
        yield
    finally:
        ended.set()
        watch.join()


def _watch(names: list[str], ended: threading.Event) -> None:
    begun, work, left = time.monotonic(), sum(KERNELS[name].share for name in names), list(names)
    over = False
    while left and not over:
        over = ended.wait(POLL_S)
        for name in [name for name in left if _is_held(name)]:
            left.remove(name)
            done = 1 - sum(KERNELS[name].share for name in left) / work
            LOG.info("compiled: %s (%.0f %%, %.0f s)", KERNELS[name].what, 100 * done, time.monotonic() - begun)


def stage_name() -> str:
    """Name of the stage that makes the kernels ready: says that they are compiled if they are not in the cache."""
    return "loading the kernels" if is_compiled() else "compiling the kernels, about half a minute, once"
