"""Axes of the four pairs of the loop, the constraints of the pairs, their reactions, and the degrees of freedom.

Links are numbered 0 frame, 1 input fork, 2 cross, 3 output fork; pair i joins link i to the next (3 to the frame).
Twists and wrenches are taken about O in axes of the ground frame G, lengths in units of `Lines.length`: a twist is
(v / length, ω), a wrench (force, moment / length). Both halves then have similar magnitude, which ranks and
conditioning need.

The RCCC linkage is statically determinate: three moving links give 18 equations of equilibrium; the pairs transmit
5 + 4 + 4 + 4 = 17 components, and the eighteenth unknown is the torque that drives the input shaft.

Kutzbach's count of freedoms, eq. (1), assumes independent constraints. Those of four revolute pairs whose axes meet in
one point are dependent: the count gives -2, yet the joint turns. With errors the axes do not meet, and a joint of rigid
parts locks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.joint.material import Array

FREEDOMS = {"R": 1, "C": 2}
"""Freedoms of a pair: a revolute pair turns about its axis, a cylindrical one slides along it too."""


class Lines(NamedTuple):
    """Axes of the four pairs at k poses, in axes of G.

    Attributes
    ----------
    point : ndarray, shape (k, 4, 3)
        A point of each axis, m.
    axis : ndarray, shape (k, 4, 3)
        Direction of each axis, a unit vector.
    length : float
        Length that moments and velocities are scaled by, m: the joint's ``cross.R``.
    """

    point: Array
    axis: Array
    length: float


def kinds(pairs: str) -> str:
    """Check a chain's pairs, one letter each in the order of `Lines`.

    Raises
    ------
    ValueError
        When it is not four letters out of R and C.
    """
    if len(pairs) != 4 or not set(pairs) <= set(FREEDOMS):
        raise ValueError(f"pairs = {pairs!r}: give four letters out of R and C, such as 'RCCC'")
    return pairs


def _pair_wrenches(lines: Lines, pair: int, kind: str) -> Array:
    """Unit wrenches that a pair can transmit from link `pair` to the next: reciprocal to the twists it allows.

    Parameters
    ----------
    lines : Lines
        Axes of the pairs.
    pair : int
        0 to 3.
    kind : str
        ``"R"`` or ``"C"``.

    Returns
    -------
    ndarray, shape (k, 6 - freedoms, 6)
        Force and moment / length about O: two forces and two moments normal to the axis, and a force along it in a
        revolute pair.
    """
    axis, point = lines.axis[:, pair], lines.point[:, pair] / lines.length
    aside = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    first = np.cross(axis, aside)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(axis, first)
    forces = [first, second] if kind == "C" else [first, second, axis]
    wrenches = [np.concatenate([f, np.cross(point, f)], axis=1) for f in forces]
    wrenches += [np.concatenate([np.zeros_like(m), m], axis=1) for m in (first, second)]
    return np.stack(wrenches, axis=1)


def constraint_jacobian(lines: Lines, pairs: str = "RCCC") -> Array:
    """Jacobian of the constraints with respect to the twists of the three moving links.

    Each row is one direction in which a pair allows no relative velocity of its two links. The transpose maps the
    pairs' reactions to the wrenches on the links.

    Parameters
    ----------
    lines : Lines
        Axes of the pairs.
    pairs : str
        Kind of each pair, ``"RCCC"`` or ``"RRRR"``.

    Returns
    -------
    ndarray, shape (k, m, 18)
        m = 17 for RCCC, 20 for RRRR; columns: twists of input fork, cross, output fork, six each. Pure numbers.

    Raises
    ------
    ValueError
        As `kinds`.
    """
    blocks = []
    for pair, kind in enumerate(kinds(pairs)):
        wrenches = _pair_wrenches(lines, pair, kind)
        rows = np.zeros((*wrenches.shape[:2], 24))
        link, following = pair, (pair + 1) % 4
        rows[..., 6 * following : 6 * following + 6] = wrenches
        rows[..., 6 * link : 6 * link + 6] = -wrenches
        blocks.append(rows[..., 6:])  # the frame does not move
    return np.concatenate(blocks, axis=1)


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
        wrenches = _pair_wrenches(lines, pair, kind)
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


RANK_TOL = 1e-9
"""Singular values below this share of the largest count as zero.

Rounding leaves 1e-15. Tilts of the order ε (rad, or position errors in units of ``cross.R``) leave values of the order
ε, so errors down to some 1e-8 are distinguished from zero.
"""


class Mobility(NamedTuple):
    """Degrees of freedom of a chain at k poses.

    Attributes
    ----------
    kutzbach : int
        Degrees of freedom by eq. (1).
    equations : int
        Constraint equations: rows of the Jacobian.
    rank : ndarray of int, shape (k,)
        Rank of the constraint Jacobian.
    dof : ndarray of int, shape (k,)
        Degrees of freedom: 18 velocities of three moving links less the rank.
    redundant : ndarray of int, shape (k,)
        Equations less rank: reactions that statics cannot determine.
    singular_values : ndarray, shape (k, min(equations, 18))
        Singular values of the Jacobian, descending, pure numbers.
    """

    kutzbach: int
    equations: int
    rank: NDArray[np.int64]
    dof: NDArray[np.int64]
    redundant: NDArray[np.int64]
    singular_values: Array


def kutzbach(links: int, freedoms: list[int] | tuple[int, ...]) -> int:
    """Degrees of freedom by Kutzbach's formula, Cirelli et al. (2021), eq. (1): 6(l - j - 1) + sum of f.

    Parameters
    ----------
    links : int
        Number of bodies l, the frame included.
    freedoms : sequence of int
        Degrees of freedom f of each of the j pairs.

    Returns
    -------
    int
        -2 for the RRRR joint, 1 for the RCCC linkage; negative when there are more constraints than velocities.
    """
    return 6 * (links - len(freedoms) - 1) + sum(freedoms)


def mobility(lines: Lines, pairs: str = "RCCC") -> Mobility:
    """Degrees of freedom of the chain whose pairs have these axes, by count and by rank.

    For an RRRR joint with errors give the axes of a closed RCCC linkage with the same errors, as `solve` returns them:
    the pose in which the parts can be assembled, here with pairs that cannot slide. An error locks the joint where an
    axis no longer meets the next (a pin of the cross moved along z or tilted about t, a hole moved along t or tilted
    about z). An error does not lock the joint where the four axes still meet after cross and output shaft have slid,
    nor at alpha = 0, where both shafts and the cross turn as one piece. With errors on the output side alone a freedom
    to first order remains at input angles where the axes of both shafts and of the input pin lie in one plane.

    Parameters
    ----------
    lines : Lines
        Axes of the pairs at k poses.
    pairs : str
        Kind of each pair, ``"RCCC"`` or ``"RRRR"``.

    Returns
    -------
    Mobility
        Count and rank at each pose. Poses where the linkage does not close (NaN) have rank and dof -1.

    Raises
    ------
    ValueError
        When `pairs` is not four letters out of R and C.
    """
    count = kutzbach(4, [FREEDOMS[kind] for kind in kinds(pairs)])
    jacobian = constraint_jacobian(lines, pairs)
    closed = np.isfinite(jacobian).all(axis=(1, 2))
    equations, columns = jacobian.shape[1:]
    values = np.full((len(jacobian), min(equations, columns)), np.nan)
    values[closed] = np.linalg.svd(jacobian[closed], compute_uv=False)
    rank = np.where(closed, np.sum(values > RANK_TOL * values[:, :1], axis=1), -1)
    dof = np.where(closed, columns - rank, -1)
    return Mobility(count, equations, rank, dof, np.where(closed, equations - rank, -1), values)
