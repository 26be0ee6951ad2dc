"""Time of a joint as the sum of its parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Once(NamedTuple):
    """Time of one execution of each part for a joint, s; in lanes, the time of all lanes over their number."""

    residual: float
    contact: float
    assembly: float
    elimination: float
    substitution: float


class Parts(NamedTuple):
    """One number per part of a simulation.

    Attributes
    ----------
    start : float
        Initial equilibrium; in lanes its guess only, since the lanes do its iterations.
    contact : float
        Contacts, evaluated once per residual.
    bodies : float
        The rest of a residual: bushings and inertia.
    assembly : float
        Assembly of the tangent.
    factor : float
        Elimination of the tangent.
    solve : float
        Forward and back substitution.
    rest : float
        Everything else.
    """

    start: float
    contact: float
    bodies: float
    assembly: float
    factor: float
    solve: float
    rest: float


@dataclass(frozen=True)
class Split:
    """Time of a joint by part, and rate of its operations.

    Attributes
    ----------
    joint_us : Parts
        Time per joint, µs.
    once_us : Parts
        Time of one execution of each part, µs; in lanes, of all lanes over their number. `rest` is per joint.
    iteration_us : float
        Time of a joint over its Newton iterations, µs.
    residuals, tangents, solutions : float
        Executions per joint: in lanes including the start and idle lanes, alone without the start.
    flops : float
        Operations of a joint in the parts counted (not start and rest), idle lanes left out.
    gflops : float
        `flops` over the time of the parts counted, 1e9/s.
    share_of_peak : float
        That rate over the core's peak rate.
    """

    joint_us: Parts
    once_us: Parts
    iteration_us: float
    residuals: float
    tangents: float
    solutions: float
    flops: float
    gflops: float
    share_of_peak: float


def split(
    whole: float,
    start: float,
    once: Once,
    counts: NDArray[np.float64],
    own: NDArray[np.float64],
    iterations: float,
    operations: dict[str, float],
    peak: float,
) -> Split:
    """Split the time of a joint into its parts.

    Parameters
    ----------
    whole, start : float
        Time of a joint, and of its start, s.
    once : Once
        Time of one execution of each part, s.
    counts, own : ndarray, shape (3,)
        Residuals, tangents and solutions executed per joint, and those of them not in idle lanes.
    iterations : float
        Newton iterations of a joint.
    operations : dict of str to float
        Floating-point operations of one execution of each part.
    peak : float
        Peak rate of the core, 1/s.

    Returns
    -------
    Split
    """
    residuals, tangents, solutions = map(float, counts)
    single = {
        "start": start,
        "contact": once.contact,
        "bodies": once.residual - once.contact,
        "assembly": once.assembly,
        "factor": once.elimination - once.assembly,
        "solve": once.substitution,
    }
    often = {"start": 1.0, "contact": residuals, "bodies": residuals, "assembly": tangents, "factor": tangents}
    joint = {name: seconds * often.get(name, solutions) for name, seconds in single.items()}
    rest = whole - sum(joint.values())
    done = np.array(
        [operations["residual"], operations["assembly"] + operations["elimination"], operations["substitution"]]
    )
    flops = float(own @ done)
    rate = flops / (sum(joint.values()) - start)
    return Split(
        Parts(**{name: 1e6 * seconds for name, seconds in joint.items()}, rest=1e6 * rest),
        Parts(**{name: 1e6 * seconds for name, seconds in single.items()}, rest=1e6 * rest),
        1e6 * whole / iterations,
        residuals,
        tangents,
        solutions,
        flops,
        rate / 1e9,
        rate / peak,
    )
