"""CPU time of a joint: in lanes, one at a time, quasi-static."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.benchmarks.joints import Params, parameters
from tolstat.benchmarks.timing import in_turn
from tolstat.common.tables import RESULT, Fidelity, Method, Options, Status, for_kernels
from tolstat.solver import simulation

if TYPE_CHECKING:
    from tolstat.study import Study


@dataclass(frozen=True)
class Rates:
    """CPU time of a joint on one core, and counts of its numerical work.

    Attributes
    ----------
    joints : int
        Number of joints simulated in each way.
    settled : int
        Number of them that settled.
    lanes_ms, alone_ms, quasistatic_ms : float
        CPU time of a joint, ms: dynamic in lanes, dynamic one at a time, quasi-static.
    lanes_per_second, alone_per_second, quasistatic_per_second : float
        Joints a second.
    lanes_ratio : float
        Time alone over time in lanes.
    quasistatic_ratio, quasistatic_ratio_alone : float
        Time of a dynamic joint, in lanes and alone, over that of a quasi-static one.
    steps, iterations, factorisations, halvings, revolutions : float
        Counts of a dynamic joint, mean.
    iterations_per_step : float
        Newton iterations a step.
    """

    joints: int
    settled: int
    lanes_ms: float
    alone_ms: float
    quasistatic_ms: float
    lanes_per_second: float
    alone_per_second: float
    quasistatic_per_second: float
    lanes_ratio: float
    quasistatic_ratio: float
    quasistatic_ratio_alone: float
    steps: float
    iterations: float
    factorisations: float
    halvings: float
    revolutions: float
    iterations_per_step: float


class Sample(NamedTuple):
    """Joints that are measured, and their settings.

    Attributes
    ----------
    params : ndarray of PARAM, shape (n,)
        Joints, all with the same number of contact stations.
    options : Options
        Settings of the study, with BDF2 at fixed steps, dynamic fidelity and no refinement: the same work in lanes and
        one at a time.
    """

    params: Params
    options: Options


def sample(study: Study, n: int) -> Sample:
    """Take the first n random joints of a study, and keep those with as many contact stations as the first."""
    first = study.first_sample
    params = parameters(study, np.arange(first, min(first + n, study.rows)))
    alike = params["n_stations"] == params["n_stations"][0]
    options = study.solver.options()
    fixed = options._replace(fidelity=int(Fidelity.DYNAMIC), method=int(Method.BDF2), rtol=0.0, max_refinements=0)
    return Sample(np.ascontiguousarray(params[alike]), fixed)


def alone(params: Params, options: Options) -> NDArray[np.void]:
    """Simulate joints one after the other, without lanes; results, (n,) RESULT."""
    from tolstat.kernel.integrators.state import UNLIMITED
    from tolstat.kernel.revolution.simulate import simulate_joint

    results = np.zeros(len(params), RESULT)
    rows, out = params.view(np.recarray), for_kernels(results)
    scratch = simulation.scratch(options)
    for i in range(len(params)):
        simulate_joint(rows[i], options, UNLIMITED, scratch, out[i])
    return results


def measure(these: Sample, rounds: int) -> Rates:
    """Measure the CPU time of a joint in each way, and its counts.

    Parameters
    ----------
    these : Sample
        The joints.
    rounds : int
        Number of rounds; each simulates all joints once in each way.

    Returns
    -------
    Rates
    """
    params, options = these
    static = options._replace(fidelity=int(Fidelity.QUASISTATIC))
    tasks: dict[str, Callable[[], object]] = {
        "lanes": lambda: simulation.simulate_rows(params, options),
        "alone": lambda: alone(params, options),
        "quasistatic": lambda: simulation.simulate_rows(params, static),
    }
    times = in_turn(tasks, rounds)
    results = times.returned["lanes"].results
    n = len(params)
    each = {name: times.typical(name) / n for name in tasks}
    mean = {name: float(results[name].mean()) for name in ("steps", "newton_iterations", "factorisations", "halvings")}
    return Rates(
        joints=n,
        settled=int((results["status"] == Status.OK).sum()),
        **{f"{name}_ms": 1e3 * seconds for name, seconds in each.items()},
        **{f"{name}_per_second": 1 / seconds for name, seconds in each.items()},
        lanes_ratio=times.ratio("alone", "lanes"),
        quasistatic_ratio=times.ratio("lanes", "quasistatic"),
        quasistatic_ratio_alone=times.ratio("alone", "quasistatic"),
        steps=mean["steps"],
        iterations=mean["newton_iterations"],
        factorisations=mean["factorisations"],
        halvings=mean["halvings"],
        revolutions=float(np.nanmean(results["revolutions"])),
        iterations_per_step=mean["newton_iterations"] / mean["steps"],
    )
