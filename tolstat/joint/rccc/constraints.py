"""Axes of the four pairs of the loop frame, input fork, cross, output fork, and the constraints of the pairs.

Links are numbered 0 frame, 1 input fork, 2 cross, 3 output fork; pair i joins link i to the next (3 to the frame).
Twists and wrenches are taken about O in axes of the ground frame G, lengths in units of `Lines.length`: a twist is
(v / length, ω), a wrench (force, moment / length). Both halves then have similar magnitude, which ranks and
conditioning need.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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


def pair_wrenches(lines: Lines, pair: int, kind: str) -> Array:
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
        wrenches = pair_wrenches(lines, pair, kind)
        rows = np.zeros((*wrenches.shape[:2], 24))
        link, following = pair, (pair + 1) % 4
        rows[..., 6 * following : 6 * following + 6] = wrenches
        rows[..., 6 * link : 6 * link + 6] = -wrenches
        blocks.append(rows[..., 6:])  # the frame does not move
    return np.concatenate(blocks, axis=1)
