"""Joints with dimensions of their own: those of a sweep, and joints that are listed one by one.

Listed is every variant of the joint, at every point of a grid, with the errors of every case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.late import stats
from tolstat.common.tables import Variant
from tolstat.joint import Joint, Operation, affects_results
from tolstat.joint.sections import quantities
from tolstat.study.axes import own
from tolstat.study.model import Solver, SweepAxis

IDEAL = "ideal"
"""Name of the case without errors, the first of every list."""

SOBOL_BITS = 30


@dataclass(frozen=True)
class Design:
    """Variant, grid point and case of each row of a study.

    Attributes
    ----------
    variants : tuple of Variant
        In the order of the file, families expanded.
    joints : tuple of Joint
        The joint of each variant.
    operations : tuple of Operation
        The operating point of each variant; values of the grid override it.
    solvers : tuple of Solver
        The numerical settings of each variant.
    cases : dict
        Name of a case to its errors (SI), `IDEAL` first.
    points : tuple of dict
        Points of the grid: error name to value (SI).
    table : ndarray, (rows,), dtype DESIGN
        Variant, case and group of each row. A group is a variant at a point of the grid.
    """

    variants: tuple[Variant, ...]
    joints: tuple[Joint, ...]
    operations: tuple[Operation, ...]
    solvers: tuple[Solver, ...]
    cases: dict[str, dict[str, float]]
    points: tuple[dict[str, float], ...]
    table: NDArray[np.void]

    def point(self) -> NDArray[np.intp]:
        """Index of each row's point of the grid, (rows,)."""
        return np.asarray(self.table["group"], np.intp) % len(self.points)

    def identity(self) -> dict[str, Any]:
        """Return all parts of the design that determine results, nested by key."""
        families = [[name, len(list(members))] for name, members in groupby(v.family for v in self.variants)]
        return {
            "grid": list(self.points),
            "case": self.cases,
            "variants": families,
            "variant": {
                f"{number} {variant.family}": variant.values
                | {"cases": np.unique(self.table["case"][self.table["variant"] == number]).tolist()}
                for number, variant in enumerate(self.variants)
            },
        }


def cube(design: str, n: int, dimensions: int, seed: int) -> list[list[float]]:
    """Points of a family in the unit cube, n lists of `dimensions`: its diagonal (``line``) or a Sobol' sequence."""
    if design == "line":
        return [[number / (n - 1)] * dimensions for number in range(n)]
    engine = stats.qmc.Sobol(dimensions, scramble=True, bits=SOBOL_BITS, seed=np.random.default_rng(seed))
    points = engine.random_base2((n - 1).bit_length())[:n] + 2.0 ** -(SOBOL_BITS + 1)  # the middle of their cells
    return [[float(share) for share in point] for point in points]


KEYS = {key: unit for key, unit in quantities(Joint).items() if affects_results(key)}
"""SI unit of each quantity of a joint that affects results, by dotted key."""
MAX_JOINTS = 10_000
"""Maximum number of joints with dimensions of their own."""


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
        feature, _, kind = axis.names[0].rpartition(".")
        key = keys.get(kind) or keys.get(f"{own(feature).rstrip('1234')}.{kind}")
        if axis.names[0] not in KEYS and key is not None:
            ends = (f"{1e3 * end:.6g}" for end in (axis.start, axis.stop))
            whole = (f"{1e3 * (getattr(of, key) + end):.6g}" for end in (axis.start, axis.stop))
            others = len(axis.names) - 1
            what = f"{axis.names[0]}{f' and {others} others' if others else ''}"
            lines.append(f"sweep of {what}: deviations from {' to '.join(ends)} mm,")
            lines.append(f"  the {kind} is {' to '.join(whole)} mm; to sweep it itself: contact.{key}")
    return lines
