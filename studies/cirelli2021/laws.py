"""What the contact law, which the paper leaves open, does to single loads and to the answers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.cirelli2021.evidence import Evidence
from studies.cirelli2021.statements import answers
from studies.cirelli2021.tables import BUSHINGS, OUTPUT_SIDE

Array = NDArray[np.float64]


class Law(NamedTuple):
    """One contact law with all errors at both misalignments.

    Attributes
    ----------
    name : str
        The law.
    change : ndarray, shape (2,)
        Largest ``|delta Gamma|`` of a force and of a torque against the first law, percentage points.
    where : tuple of str
        The joint and the bushing of each.
    largest : ndarray, shape (2,)
        Largest increase of a force and of a torque, all bushings and directions, per cent.
    yes : dict
        Answer to each of the paper's sentences, by `Answer.key`.
    """

    name: str
    change: Array
    where: tuple[str, str]
    largest: Array
    yes: dict[str, bool]


def compare(joints: dict[str, Evidence]) -> list[Law]:
    """Compare laws with the first.

    Parameters
    ----------
    joints : dict
        Name of each law, and its joints: the same rows for all.
    """
    first = next(iter(joints.values()))
    return [_law(name, evidence, first) for name, evidence in joints.items()]


def _law(name: str, e: Evidence, first: Evidence) -> Law:
    apart = np.abs(e.gamma - first.gamma)
    change = apart.max(axis=(0, 1))
    places = []
    for load in (0, 1):
        row, bushing = np.unravel_index(int(np.argmax(apart[..., load])), apart.shape[:2])
        places.append(f"{e.name(int(row))}, {BUSHINGS[int(bushing)]}" if change[load] else "")
    largest = e.gamma[:, OUTPUT_SIDE].max(axis=(0, 1))
    return Law(name, change, (places[0], places[1]), largest, {a.key: a.yes for a in answers(e)})
