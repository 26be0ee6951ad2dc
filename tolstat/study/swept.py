"""Sweeps of dimensions of the joint: each point of their axes is a variant of the study's joint."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import Fault, InputError
from tolstat.common.tables import DESIGN, Variant
from tolstat.common.units import Quantity
from tolstat.joint import Joint, affects_results
from tolstat.joint.overrides import nested
from tolstat.joint.sections import quantities
from tolstat.study.listing import Variants
from tolstat.study.model import SweepAxis

KEYS = {key: unit for key, unit in quantities(Joint).items() if affects_results(key)}
"""SI unit of each quantity of a joint that affects results, by dotted key."""
MAX_JOINTS = 10_000
"""Maximum number of joints with dimensions of their own."""


class Swept(NamedTuple):
    """Joints of a sweep.

    Attributes
    ----------
    variants : tuple of Variant
        The study's joint, then one for each point of the axes of dimensions, the last axis varying fastest.
    joints : tuple of Joint
        The joint of each variant.
    table : ndarray, shape (rows,), dtype DESIGN
        Variant of each row.
    """

    variants: tuple[Variant, ...]
    joints: tuple[Joint, ...]
    table: NDArray[np.void]


def meaning(axes: Sequence[SweepAxis], joint: Joint) -> list[str]:
    """Describe the axes of clearances and diameters, whose values are deviations from those of the joint.

    Returns
    -------
    list of str
        One line for each such axis, with the key that has the value itself; empty for other sweeps.
    """
    of = joint.contact
    keys = {"clearance": "clearance"} | {f"{part}.diameter": key for part, key in (("hole", "D_H"), ("pin", "D_P"))}
    lines = []
    for axis in axes:
        part, _, kind = axis.names[0].partition(".")
        key = keys.get(kind) or keys.get(f"{part.rstrip('1234')}.{kind}")
        if axis.names[0] not in KEYS and key is not None:
            ends = (f"{1e3 * end:.6g}" for end in (axis.start, axis.stop))
            whole = (f"{1e3 * (getattr(of, key) + end):.6g}" for end in (axis.start, axis.stop))
            others = len(axis.names) - 1
            what = f"{axis.names[0]}{f' and {others} others' if others else ''}"
            lines.append(f"sweep of {what}: deviations from {' to '.join(ends)} mm,")
            lines.append(f"  the {kind} is {' to '.join(whole)} mm; to sweep it itself: contact.{key}")
    return lines


def read(axes: Sequence[SweepAxis], variants: Variants, joint: Joint, nominal_first: bool, place: str) -> Swept | None:
    """Make the joints of a sweep.

    Parameters
    ----------
    axes : sequence of SweepAxis
        All axes of the sweep.
    variants : Variants
        What makes the joints.
    joint : Joint
        The study's joint.
    nominal_first : bool
        Whether row 0 is the joint without errors.
    place : str
        File name shown in faults.

    Returns
    -------
    Swept
        None if no axis is a dimension of the joint.

    Raises
    ------
    InputError
        When there are too many joints, or one of them is not valid.
    """
    own = [number for number, axis in enumerate(axes) if axis.names[0] in KEYS]
    if not own:
        return None
    shape = [axes[number].points for number in own]
    if np.prod(shape) > MAX_JOINTS:
        found = f"gives {np.prod(shape)} joints with dimensions of their own"
        raise InputError([Fault(f"{place}: sweep", found, f"give at most {MAX_JOINTS}")])
    made = [(Variant("joint", {}), joint)]
    for values in product(*(np.linspace(axes[k].start, axes[k].stop, axes[k].points).tolist() for k in own)):
        point = {name: value for k, value in zip(own, values, strict=True) for name in axes[k].names}
        text = {key: Quantity(KEYS[key]).written(value) for key, value in point.items()}
        one = variants.joint(nested(text), ("sweep",))
        made.append((Variant("sweep", variants.values(one, list(point))), one))
    all_points = [axis.points for axis in axes]
    index = np.unravel_index(np.arange(np.prod(all_points)), all_points)
    number = 1 + np.ravel_multi_index([index[k] for k in own], shape)
    table = np.zeros(nominal_first + len(number), DESIGN)
    table["variant"][int(nominal_first) :] = number
    table["group"] = np.arange(len(table))
    names, joints = zip(*made, strict=True)
    return Swept(names, joints, table)
