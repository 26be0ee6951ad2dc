"""Solver options in words: the result file holds ``"bdf2"`` and ``"static"``, the kernel reads integer codes."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import Any

from tolstat.common.tables import Fidelity, Method, Options, Start

CODES: dict[str, type[IntEnum]] = {"method": Method, "start": Start, "fidelity": Fidelity}
"""Options that are names in a study and in a result file."""


def to_names(options: Options) -> dict[str, Any]:
    """Return the options by name, with ``method``, ``start`` and ``fidelity`` as a study writes them."""
    held = options._asdict()
    return held | {name: code(held[name]).name.lower() for name, code in CODES.items()}


def from_names(held: Mapping[str, Any]) -> Options:
    """Return the options that `to_names` has written."""
    return Options(**{k: int(CODES[k][v.upper()]) if k in CODES else v for k, v in held.items()})
