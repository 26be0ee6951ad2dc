"""Meanings of the columns that hold codes, as CF has them: ``flag_values`` and ``flag_meanings``."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping
from enum import IntEnum
from typing import Any

import h5py
import numpy as np

from tolstat.common.tables import Mode, Motion, Status
from tolstat.store.result_file import put_attributes

Meanings = Mapping[int, str]
MAX_MEANINGS = 1000
"""Largest number of meanings that a column carries: attributes of HDF5 are small."""


def _names(codes: type[IntEnum]) -> dict[int, str]:
    return {code.value: code.name.lower() for code in codes}


FIXED: dict[str, Meanings] = {
    "status": _names(Status),
    "motion": _names(Motion),
    "settled": {0: "not_settled", 1: "settled"},
    "nominal": {0: "joint_with_errors", 1: "nominal_joint"},
    "mode": _names(Mode),
}
"""Meanings that are the same in every file, by column or history."""
LABELS = {
    name: np.array([FIXED[name].get(code, "") for code in range(max(FIXED[name]) + 1)], dtype=object)
    for name in ("status", "motion")
}
"""Columns that an export holds as text: label of each code."""


def of_file(attrs: Mapping[str, Any]) -> dict[str, Meanings]:
    """Meanings of all columns of a file with codes.

    Parameters
    ----------
    attrs : mapping
        Attributes of the file, see `new_file.attributes`.
    """
    design, identity = json.loads(attrs["design"]), json.loads(attrs["identity"])
    proposals = range(1, len(identity.get("proposal", ())) + 1)
    families = [variant["family"] for variant in design["variants"]]
    shared = {family for family, number in Counter(families).items() if number > 1}
    return FIXED | {
        "case": dict(enumerate(design["cases"])),
        "variant": {k: f"{name}_{k}" if name in shared else name for k, name in enumerate(families)},
        "component": {-1: "nominal_joint", 0: "tolerances"} | {k: f"proposal_{k}" for k in proposals},
    }


def put(dataset: h5py.Dataset, meanings: Meanings) -> None:
    """Write the meanings of a column's codes to its attributes; blanks inside a meaning become underscores."""
    if len(meanings) <= MAX_MEANINGS:
        dataset.attrs["flag_values"] = np.array([*meanings], dataset.dtype)
        words = (re.sub(r"[^\w.+@-]+", "_", meaning) or "_" for meaning in meanings.values())
        put_attributes(dataset, {"flag_meanings": " ".join(words)})
