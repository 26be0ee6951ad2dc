"""Environment of other processes; apart from `fakes`, so that a worker of a test need not import all of tolstat."""

from __future__ import annotations

import os
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
"""Folder of the checkout."""


def environment() -> dict[str, str]:
    """Environment in which another Python finds tolstat and these modules."""
    return os.environ | {"PYTHONPATH": str(ROOT)}
