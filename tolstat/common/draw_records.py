"""Sampling methods, and tables of how each joint was drawn for those that need one (`importance`, `subset`).

The result file keeps them in the group ``origin``; row i is joint i.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tolstat.common.columns import Column, flat
from tolstat.common.fields import Field, dtype_of

IMPORTANCE_FIELDS = (
    Field("component", "1", "what it was drawn from: 0 the tolerances, k proposal k; -1 the nominal joint", "i4"),
    Field("weight", "1", "density of its errors under the tolerances over that under the mixture; 0 if not drawn"),
)
SUBSET_FIELDS = (
    Field("level", "1", "level of the subset simulation: 0 is drawn from the tolerances, -1 the nominal joint", "i4"),
    Field("parent", "1", "row of the joint whose errors were moved to give these; -1 at level 0", "i8"),
)
FIELDS: dict[str, tuple[Field, ...]] = {"importance": IMPORTANCE_FIELDS, "subset": SUBSET_FIELDS}
"""Columns of the table by sampling method; other methods have no such table."""
IMPORTANCE, SUBSET = dtype_of(IMPORTANCE_FIELDS), dtype_of(SUBSET_FIELDS)

METHODS = {
    "random": "random sampling",
    "sobol": "Sobol' points",
    "lhs": "Latin hypercube",
    "sweep": "sweep",
    "importance": "importance sampling",
    "pick_freeze": "pick-freeze design",
}
"""Sampling methods in words."""
DRAWN = ("random", "sobol", "lhs")
"""Sampling methods that draw every joint from the tolerances, all with the same weight."""


def columns(sampling: Mapping[str, Any]) -> tuple[Column, ...]:
    """Columns of the table; empty where the method needs none.

    Parameters
    ----------
    sampling : mapping
        The attribute ``sampling`` of a result file.
    """
    return flat(FIELDS.get(sampling["method"], ()))


def dtype(sampling: Mapping[str, Any]) -> np.dtype[np.void]:
    """Structured type of a row of the table."""
    return dtype_of(FIELDS[sampling["method"]])
