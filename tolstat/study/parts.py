"""What is made of the sections of a study or case file while it is read."""

from __future__ import annotations

from typing import Any


class Parts:
    """Parts of a study by name; None while they are not made, and where faults leave none."""

    fit: Any = None
    joint: Any = None
    assumed: Any = None
    linkage: Any = None
    joint2: Any = None
    shaft: Any = None
    points: Any = None
    operation: Any = None
    solver: Any = None
    errors: Any = None
    scatter: Any = None
    copula: Any = None
    sampling: Any = None
    sweep: Any = None
    limits: Any = None
    fatigue: Any = None
    output: Any = None
    listed: Any = None
    swept: Any = None
    notes: tuple[str, ...] = ()
