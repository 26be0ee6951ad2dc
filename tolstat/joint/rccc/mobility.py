"""Degrees of freedom of the joint: Kutzbach's count, and the rank of the constraints, which the count ignores.

The count, eq. (1), assumes independent constraints. Those of four revolute pairs whose axes meet in one point are
dependent: the count gives -2, yet the joint turns. With errors the axes do not meet, and a joint of rigid parts locks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.joint.rccc.constraints import FREEDOMS, Array, Lines, constraint_jacobian, kinds

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
