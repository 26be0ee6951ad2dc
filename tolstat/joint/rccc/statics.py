"""Reactions of the RCCC linkage: statically determinate, one linear system per pose.

Three moving links give 18 equations of equilibrium; the pairs transmit 5 + 4 + 4 + 4 = 17 components, and the
eighteenth unknown is the torque that drives the input shaft.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.joint.rccc.constraints import Array, Lines, constraint_jacobian, pair_wrenches

INPUT_BEARING, INPUT_PIN, OUTPUT_PIN, OUTPUT_BEARING = 0, 1, 2, 3
"""Pairs in the order of every array with an axis of pairs."""


class Reactions(NamedTuple):
    """Reactions of the pairs at k poses, in axes of G.

    Attributes
    ----------
    at_centre : ndarray, shape (k, 4, 6)
        Force (N) and moment about O (N m) that each pair transmits from its link to the next: frame to input fork,
        input fork to cross, cross to output fork, output fork to frame. The next link exerts the opposite.
    at_point : ndarray, shape (k, 4, 6)
        The same with the moment about the pair's own point, `Lines.point`.
    driving_torque : ndarray, shape (k,)
        Torque that drives the input shaft about its axis, N m.
    """

    at_centre: Array
    at_point: Array
    driving_torque: Array


def react(lines: Lines, external: Array) -> Reactions:
    """Reactions that hold the RCCC linkage in equilibrium under wrenches on its links.

    If `external` includes inertial wrenches (d'Alembert), the equilibrium is the Newton-Euler equations.

    Parameters
    ----------
    lines : Lines
        Axes of the pairs at k poses.
    external : ndarray, shape (k, 3, 6)
        Force (N) and moment about O (N m), axes of G, on input fork, cross and output fork.

    Returns
    -------
    Reactions
        NaN where the axes are NaN.

    Raises
    ------
    numpy.linalg.LinAlgError
        When the three cylindrical pairs' axes are exactly parallel to one plane: no torque holds the linkage then.
    """
    n = len(lines.point)
    jacobian = constraint_jacobian(lines, "RCCC")
    matrix = np.zeros((n, 18, 18))
    matrix[:, :, :17] = np.swapaxes(jacobian, 1, 2)
    matrix[:, 3:6, 17] = lines.axis[:, INPUT_BEARING]
    loads = np.array(external, float)
    loads[..., 3:] /= lines.length
    unknown = np.linalg.solve(matrix, -loads.reshape(n, 18, 1))[..., 0]

    at_centre = np.empty((n, 4, 6))
    first = 0
    for pair, kind in enumerate("RCCC"):
        wrenches = pair_wrenches(lines, pair, kind)
        last = first + wrenches.shape[1]
        at_centre[:, pair] = np.einsum("ki,kij->kj", unknown[:, first:last], wrenches)
        first = last
    at_centre[..., 3:] *= lines.length
    at_point = at_centre.copy()
    at_point[..., 3:] -= np.cross(lines.point, at_centre[..., :3])
    return Reactions(at_centre, at_point, unknown[:, 17] * lines.length)


def output_load(lines: Lines, torque: float) -> Array:
    """Wrenches of a torque (N m) that resists the output shaft's rotation, as `react` takes them; shape (k, 3, 6)."""
    external = np.zeros((len(lines.point), 3, 6))
    external[:, 2, 3:] = -torque * lines.axis[:, OUTPUT_BEARING]
    return external
