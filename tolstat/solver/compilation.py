"""Compilation of the kernels, once per machine and version, in two processes where there are two cores."""

from __future__ import annotations

import logging
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tolstat.common.channels import LOAD_HISTORIES
from tolstat.common.cores import available_cores
from tolstat.common.tables import RESULT, Fidelity, Options, blank_params
from tolstat.solver import histories, refinement, simulation

LOG = logging.getLogger("tolstat")


def announce() -> None:
    """Tell that kernels will be compiled, if they have to be."""
    if not is_compiled():
        LOG.info("compiling the kernels: about half a minute, once per machine and version")


def _outside_model(torque_reverses: bool = False) -> NDArray[np.void]:
    """Parameters of a joint with negative clearance, whose simulation ends at once."""
    params = blank_params(1)
    params["clearance"] = -1.0
    if torque_reverses:
        params["omega"], params["alpha"], params["Js"] = 1.0, 0.1, 1.0
    return params


def _simulate(joints: int, options: Options) -> None:
    params, results = np.repeat(_outside_model(), joints), np.zeros(joints, RESULT).view(np.recarray)
    list(simulation.simulate_together(params, options, np.ones(joints, np.int64), False, results))


def _explicit(options: Options) -> None:
    results, steps = np.zeros(1, RESULT).view(np.recarray), np.full(1, options.steps_per_rev)
    joint, settings, revolutions = _outside_model(torque_reverses=True), refinement.settings(options), np.full(1, 2**31)
    list(simulation.simulate_together(joint, settings, revolutions, False, results, results[:, None], steps))


KERNELS: dict[str, Callable[[Options], object]] = {
    "lockstep.lockstep": partial(_simulate, simulation.MOST_ALONE + 1),
    "lockstep.one_at_a_time": partial(_simulate, 1),
    "explicit.explicit": _explicit,
    "explicit.count_steps": lambda options: simulation.explicit_steps(_outside_model(torque_reverses=True), options),
    "starts.write_starts": lambda options: simulation.starts(blank_params(1).view(np.recarray), options),
    "ideal.ideal_revolution": partial(_simulate, 1),
    "rainflow.count_joint": lambda options: histories.cycles(
        {history.name: np.zeros((2, *history.shape)) for history in LOAD_HISTORIES}
    ),
}
"""Kernels that Python calls, by their names in the cache, each with a call that compiles it."""
SECOND = ("lockstep.one_at_a_time", "explicit.explicit")
"""Kernels that the second process compiles; they take about as long as all others together."""


def kernels(options: Options, params: NDArray[np.void] | None = None) -> list[str]:
    """Names of the kernels that joints with these settings need.

    Kernels with explicit steps are only among them where one of the joints `params` needs them; without them such a
    joint compiles them when it is simulated.
    """
    if options.fidelity == Fidelity.IDEAL:
        return ["ideal.ideal_revolution", "rainflow.count_joint"]
    left_out = {"ideal.ideal_revolution"}
    if params is None or not len(simulation.hitting(params, options)):
        left_out |= {"explicit.explicit", "explicit.count_steps"}
    return [name for name in KERNELS if name not in left_out]


def missing(options: Options, params: NDArray[np.void] | None = None) -> list[str]:
    """Names of those that are not in the cache."""
    from tolstat.kernel.simd.cache_folder import CACHE_DIRECTORY, SUFFIX

    return [name for name in kernels(options, params) if not any(CACHE_DIRECTORY.rglob(f"{name}*{SUFFIX}"))]


def is_compiled(options: Options | None = None, params: NDArray[np.void] | None = None) -> bool:
    """Whether the kernels that joints with `options` need, such as `params`, are in the cache."""
    return not missing(options or Options(), params)


def warm_up(options: Options | None = None, params: NDArray[np.void] | None = None) -> None:
    """Compile the kernels that joints with `options` need, such as `params`, in two processes, or load them."""
    options = options or Options()
    names = missing(options, params)
    second = [name for name in names if name in SECOND and names != [name] and available_cores() > 1]
    with _compiling(second, options):
        compile_kernels([name for name in names if name not in second], options)
    compile_kernels(kernels(options, params), options)


def compile_kernels(names: list[str], options: Options) -> None:
    """Compile or load these kernels of `KERNELS`."""
    for name in names:
        KERNELS[name](options)


@contextmanager
def _compiling(names: list[str], options: Options) -> Iterator[None]:
    """Compile kernels into the cache in a second process; what fails there is compiled when it is called."""
    if not names:
        yield
        return
    code = f"from {__name__} import *; compile_kernels({names!r}, Options{tuple(options)!r})"
    none = subprocess.DEVNULL
    with subprocess.Popen([sys.executable, "-c", code], stdin=none, stdout=none, stderr=none) as second:
        try:
            yield
            second.wait()
        finally:
            second.kill()


def stage_name() -> str:
    """Name of the stage that makes the kernels ready: says that they are compiled if they are not in the cache."""
    return "loading the kernels" if is_compiled() else "compiling the kernels, about half a minute, once"
