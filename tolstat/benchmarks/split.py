"""A joint's time put together of its parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Once(NamedTuple):
    """Seconds of doing each part once, for a joint; a lane's share of it in lanes."""

    residual: float
    contact: float
    assembly: float
    elimination: float
    substitution: float


class Parts(NamedTuple):
    """Numbers by part: times, operations.

    Attributes
    ----------
    start : float
        Equilibrium that a joint starts from; in lanes the guess only, from which on it is one of the lanes.
    contact : float
        Contacts, once a residual.
    bodies : float
        The rest of a residual: bushings and inertia.
    assembly : float
        Tangent.
    factor : float
        Its elimination.
    solve : float
        Forward and back substitution.
    rest : float
        All else.
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
    """Where the time of a joint goes.

    Attributes
    ----------
    joint_us : Parts
        Of a joint, µs.
    once_us : Parts
        Of doing each part once, µs; in lanes a lane's share. The rest is that of a joint.
    iteration_us : float
        Time of a joint over its Newton iterations, µs.
    residuals, tangents, solutions : float
        How often a joint has them done, in lanes with its start, alone after it; in lanes idle ones count too.
    flops : float
        Operations of a joint in the parts counted (not start and rest), idle lanes left out.
    gflops : float
        Those operations over the time of those parts, 1e9/s.
    share_of_peak : float
        That over what the core can do.
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
    """Put a joint's time together; `counts` residuals, tangents and solutions are done for it, `own` of use."""
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
