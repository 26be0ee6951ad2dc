"""Compilation of the kernels, once per machine and version."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import CARDAN
from tolstat.common.channels import load_histories
from tolstat.common.mechanism import Mechanism
from tolstat.common.parameters import mark_of
from tolstat.common.tables import Fidelity, Options, blank_params
from tolstat.solver import histories, refinement, simulation

LOG = logging.getLogger("tolstat")
HEAD = 16384
"""Bytes of a file with compiled code in which the types of the kernel's arguments are."""


def _outside_model(mechanism: Mechanism, torque_reverses: bool = False) -> NDArray[np.void]:
    """Parameters of a joint with negative clearance, whose simulation ends at once."""
    params = blank_params(1, mechanism)
    params["clearance"] = -1.0
    if torque_reverses:
        params["omega"], params["alpha"], params["Js"] = 1.0, 0.1, 1.0
    return params


def _simulate(options: Options, mechanism: Mechanism) -> None:
    params, results = _outside_model(mechanism), simulation.blank_results(1, mechanism)
    list(simulation.simulate_together(params, options, np.ones(1, np.int64), False, results, mechanism=mechanism))


def _explicit(options: Options, mechanism: Mechanism) -> None:
    results, steps = simulation.blank_results(1, mechanism), np.full(1, options.steps_per_rev)
    joint, settings = _outside_model(mechanism, torque_reverses=True), refinement.settings(options)
    left, blocks = np.full(1, 2**31), results[:, None]
    list(simulation.simulate_together(joint, settings, left, False, results, blocks, steps, mechanism))


def _count_steps(options: Options, mechanism: Mechanism) -> None:
    simulation.explicit_steps(_outside_model(mechanism, torque_reverses=True), options, mechanism)


def _starts(options: Options, mechanism: Mechanism) -> None:
    simulation.starts(blank_params(1, mechanism).view(np.recarray), options, mechanism)


def _count_cycles(options: Options, mechanism: Mechanism) -> None:
    loads = {name: np.zeros((2, *history.shape)) for name, history in load_histories(mechanism).items()}
    histories.cycles(loads, mechanism)


KERNELS: dict[str, Callable[[Options, Mechanism], object]] = {
    "lockstep.lockstep": _simulate,
    "explicit.explicit": _explicit,
    "explicit.count_steps": _count_steps,
    "starts.write_starts": _starts,
    "ideal.ideal_revolution": _simulate,
    "rainflow.count_joint": _count_cycles,
}
"""Kernels that Python calls, by their names in the cache, each with a call that compiles it."""


def kernels(options: Options, params: NDArray[np.void] | None = None, mechanism: Mechanism = CARDAN) -> list[str]:
    """Names of the kernels that joints with these settings need.

    Kernels with explicit steps are only among them where one of the joints `params` needs them; without them such a
    joint compiles them when it is simulated.
    """
    if options.fidelity == Fidelity.IDEAL:
        return ["ideal.ideal_revolution", "rainflow.count_joint"]
    left_out = {"ideal.ideal_revolution"}
    if params is None or not len(simulation.hitting(params, options, mechanism)):
        left_out |= {"explicit.explicit", "explicit.count_steps"}
    return [name for name in KERNELS if name not in left_out]


def missing(options: Options, params: NDArray[np.void] | None = None, mechanism: Mechanism = CARDAN) -> list[str]:
    """Names of those that are not in the cache for a mechanism."""
    from tolstat.kernel.simd.cache_folder import CACHE_DIRECTORY, SUFFIX

    def is_there(name: str) -> bool:
        return any(_is_for(mechanism, path) for path in CACHE_DIRECTORY.rglob(f"{name}*{SUFFIX}"))

    return [name for name in kernels(options, params, mechanism) if not is_there(name)]


def _is_for(mechanism: Mechanism, path: Path) -> bool:
    """Whether compiled code is for a mechanism: PARAM has its mark, or is not among the types of the arguments."""
    with path.open("rb") as file:
        head = file.read(HEAD)
    return mark_of(mechanism).encode() in head or b"numbers_" not in head


def is_compiled(
    options: Options | None = None, params: NDArray[np.void] | None = None, mechanism: Mechanism = CARDAN
) -> bool:
    """Whether the kernels that joints with `options` need, such as `params`, are in the cache."""
    return not missing(options or Options(), params, mechanism)


def warm_up(
    options: Options | None = None, params: NDArray[np.void] | None = None, mechanism: Mechanism = CARDAN
) -> None:
    """Compile the kernels that joints with `options` need, such as `params`, or load them."""
    options = options or Options()
    if missing(options, params, mechanism):
        LOG.info("compiling the kernels of this study, up to some minutes, once per version")
    for name in kernels(options, params, mechanism):
        KERNELS[name](options, mechanism)


def stage_name(mechanism: Mechanism = CARDAN) -> str:
    """Name of the stage that makes the kernels ready: says that they are compiled if they are not in the cache."""
    compiled = is_compiled(mechanism=mechanism)
    return "loading the kernels" if compiled else "compiling the kernels, up to some minutes, once"
