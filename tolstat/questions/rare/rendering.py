"""Result of a subset simulation, as a table of its levels and a sentence."""

from __future__ import annotations

import math
from itertools import accumulate
from operator import mul

import pandas as pd

from tolstat.analysis.subset import Estimate, Level
from tolstat.common.loads import Limit
from tolstat.display import text
from tolstat.display.table import Column

LEVELS = (
    Column("level", lambda row: str(row["level"])),
    Column("threshold", lambda row: "-" if math.isinf(row["threshold"]) else text.value(row["threshold"], row["unit"])),
    Column("P(above it)", lambda row: text.formed(row["probability"])),
    Column("share that goes on", lambda row: text.percent(row["share"])),
    Column("its deviation", lambda row: text.percent(row["deviation"])),
    Column("joints", lambda row: str(row["joints"])),
    Column("accepted moves", lambda row: text.percent(row["acceptance"]), rank=1),
    Column("step", lambda row: text.formed(row["step"]), rank=2),
)
"""Columns of the table `table`; the deviation is the coefficient of variation of the share."""


def table(levels: list[Level], limit: Limit) -> pd.DataFrame:
    """Levels of a subset simulation.

    Parameters
    ----------
    levels : list of Level
        Loads in SI units.
    limit : Limit
        The limit whose exceedance is estimated.

    Returns
    -------
    DataFrame
        One row per level: ``level``, ``load``, ``unit``, ``threshold`` (-inf at level 0), ``probability`` of a load
        above it, then the other fields of `analysis.subset.Level`.
    """
    frame = pd.DataFrame([level._asdict() for level in levels])
    frame.insert(0, "level", range(len(levels)))
    frame.insert(1, "load", limit.name)
    frame.insert(2, "unit", limit.unit)
    frame.insert(4, "probability", list(accumulate([1.0, *frame["share"][:-1]], mul)))
    return frame


def sentence(estimate: Estimate, limit: Limit) -> str:
    """The probability with its interval, or its upper bound if the levels did not reach the limit."""
    head = f"P({limit})"
    if math.isnan(estimate.probability):
        return f"{head} < {estimate.upper:.2g}: the limit was not reached"
    ppm = f"{text.ppm(estimate.probability)} ppm"
    return f"{head} = {estimate.probability:.3g} ({ppm}), 95 % interval {estimate.lower:.3g} .. {estimate.upper:.3g}"
