"""What the paper does not print, and how far each choice of it moves its tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.cirelli2021.tables import SAME_ALPHA, directions, misfit, printed

Array = NDArray[np.float64]


class Fit(NamedTuple):
    """How near one joint comes to the printed tables.

    Attributes
    ----------
    variant : int
        Index of the joint.
    objective : float
        Mean of ``| |Gamma| - printed |`` over the 128 entries of Tables 4 to 7, percentage points; NaN when a
        printed case has no direction with a result at both misalignments.
    cases : tuple of str
        Direction of each printed case: one for both misalignments, since it is the same joint.
    """

    variant: int
    objective: float
    cases: tuple[str, ...]


class Sweep(NamedTuple):
    """A family of joints in which one quantity moves.

    Attributes
    ----------
    family, key : str
        Name of the family; dotted key of the joint that moves.
    values : ndarray, shape (k,)
        SI, ascending.
    variants : ndarray of int, shape (k,)
        The joints.
    """

    family: str
    key: str
    values: Array
    variants: NDArray[np.intp]


def fits(
    gamma: Array, variant: NDArray[np.int32], case: NDArray[np.int32], alpha: Array, cases: tuple[str, ...]
) -> list[Fit]:
    """Objective of the search at every joint.

    Parameters
    ----------
    gamma : ndarray, shape (n, 8, 2)
        Gamma of all rows, per cent.
    variant, case : ndarray of int, shape (n,)
        Joint and case of each row.
    alpha : ndarray, shape (n,)
        Misalignment of each row, rad.
    cases : tuple of str
        Names of the cases.

    Returns
    -------
    list of Fit
        One for each number in `variant`, ascending.
    """
    found = []
    for number in np.unique(variant):
        here = variant == number
        found.append(_fit(int(number), gamma[here], case[here], alpha[here], cases))
    return found


def _fit(number: int, gamma: Array, case: NDArray[np.int32], alpha: Array, cases: tuple[str, ...]) -> Fit:
    table = printed()
    chosen, apart = [], []
    for c, name in enumerate(table.cases):
        options = directions(name, cases)
        far = np.full((len(options), len(table.alpha)), np.nan)
        for d, option in enumerate(options):
            for a, angle in enumerate(table.alpha):
                rows = (case == option) & (np.abs(alpha - angle) < SAME_ALPHA)
                if rows.any():
                    far[d, a] = misfit(gamma[rows][0], table.gamma[c, a])
        total = far.mean(axis=1)
        best = int(np.nanargmin(total)) if np.isfinite(total).any() else 0
        chosen.append(cases[options[best]])
        apart.append(float(total[best]))
    return Fit(number, float(np.mean(apart)), tuple(chosen))


def no_effect() -> float:
    """Objective of a model in which errors change nothing: the mean of all printed values, percentage points."""
    return float(printed().gamma.mean())


def sweeps(families: tuple[str, ...], values: tuple[Mapping[str, Any], ...]) -> list[Sweep]:
    """Families in which exactly one number moves.

    Parameters
    ----------
    families : tuple of str
        Family of each joint.
    values : tuple of mapping
        What makes each joint, by dotted key.

    Returns
    -------
    list of Sweep
        In the order of their first joint; joints of a family are sorted by the value.
    """
    found = []
    for family in dict.fromkeys(families):
        members = [index for index, name in enumerate(families) if name == family]
        key = _moving(members, values)
        if len(members) > 1 and len(key) == 1:
            x = np.array([float(values[index][key[0]]) for index in members])
            order = np.argsort(x, kind="stable")
            found.append(Sweep(family, key[0], x[order], np.array(members, np.intp)[order]))
    return found


def searched(families: tuple[str, ...], values: tuple[Mapping[str, Any], ...]) -> tuple[list[int], list[str]]:
    """Joints of the families in which several quantities move at once, and those quantities.

    Parameters as in `sweeps`.

    Returns
    -------
    members : list of int
        The joints.
    keys : list of str
        Dotted keys of the numbers that move.
    """
    joints: list[int] = []
    keys: list[str] = []
    for family in dict.fromkeys(families):
        members = [index for index, name in enumerate(families) if name == family]
        moving = _moving(members, values)
        if len(moving) > 1:
            joints += members
            keys += [key for key in moving if key not in keys]
    return joints, keys


def _moving(members: list[int], values: tuple[Mapping[str, Any], ...]) -> list[str]:
    keys = dict.fromkeys(key for index in members for key in values[index])
    moving = []
    for key in keys:
        held = [values[index].get(key) for index in members]
        if all(isinstance(x, float) for x in held) and len(set(held)) > 1:
            moving.append(key)
    return moving
